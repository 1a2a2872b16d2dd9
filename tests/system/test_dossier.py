"""`ice dossier`: one folder, the same again byte by byte, whose claims lead to what shows them."""

import asyncio
import json
import re
import shutil
import subprocess

import pytest

import scenes
from tests import chromium
from tests.commands import ice
from tests.rigs import small_rig
from validation.batch.campaign import Campaign
from validation.batch.result import collect
from validation.batch.store import RunFile
from validation.cli.commands import COMMANDS
from validation.dossier.controls import Judge, controls

pytestmark = pytest.mark.render

SIZE = ("--renders", "60", "--stations", "50", "--tables", "200", "--exposures", "40", "--no-hard", "--workers", "1")
SAME = ("dossier.html", "dossier.json", "scene.json", "table.csv", "measurands.csv", "SHA256SUMS")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A dossier of a small `calibrated_rig`, and what the command said."""
    folder = tmp_path_factory.mktemp("dossier")
    small_rig(folder)
    return folder, ice("dossier", "rig.toml", *SIZE, "--out", "one", cwd=folder)


def test_claims_hold_and_what_is_left_out_is_not_shown(made):
    folder, done = made
    assert done.returncode == 1, done.stderr  # the hard cases are left out
    found = json.loads((folder / "one/dossier.json").read_text())
    assert [each["holds"] for each in found["claims"]] == [True, True, True, True, None]
    assert not found["holds"]
    assert found["run"]["verdict"].startswith("agree")
    assert "seconds" not in found["run"]
    planted = {each["name"]: each for each in found["controls"]}
    assert {"noise.sigma", "camera.exposure", "camera.blur_px", "predicted variance", "camera.focal_px",
            "camera.distance", "sensor, polar angle"} <= set(planted)  # fmt: skip
    assert planted["camera.focal_px"]["found"] == ["bias"]
    assert planted["nothing"]["found"] == []
    (told,) = found["coverage"]["measurands"]
    assert (told["n"], told["failed"]) == (50, 0)


def test_the_same_command_writes_the_same_bytes(made):
    """Also from a run that is continued; another seed is another dossier."""
    folder, _ = made
    shutil.copytree(folder / "one/run", folder / "two/run")
    ice("dossier", "rig.toml", *SIZE, "--out", "two", cwd=folder)
    for name in SAME:
        assert (folder / "one" / name).read_bytes() == (folder / "two" / name).read_bytes(), name
    assert "date" in json.loads((folder / "two/made.json").read_text())
    refused = ice("dossier", "rig.toml", *SIZE, "--out", "two", "--seed", "7", cwd=folder)
    assert refused.returncode == 2
    assert "--out must be a new directory or hold this run" in refused.stderr


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="sha256sum is not installed")
def test_sums_tell_of_a_changed_file(made):
    folder, _ = made
    shutil.copytree(folder / "one", folder / "three")
    check = ["sha256sum", "-c", "--quiet", "SHA256SUMS"]
    assert subprocess.run(check, cwd=folder / "three").returncode == 0
    (folder / "three/table.csv").write_text("changed")
    assert subprocess.run(check, cwd=folder / "three", capture_output=True).returncode != 0


def test_every_claim_leads_to_its_heading_and_its_command(made):
    folder, _ = made
    text = (folder / "one/dossier.html").read_text()
    ids = re.findall(r' id="([^"]+)"', text)
    links = re.findall(r'href="#([^"]+)"', text)
    assert len(set(ids)) == len(ids)
    assert set(links) <= set(ids)
    assert not re.findall(r'(?:src|href)="(?!#|data:)', text)
    found = json.loads((folder / "one/dossier.json").read_text())
    for each in found["claims"]:
        assert each["heading"] in links
        assert each["command"].split()[1] in COMMANDS
        assert each["command"] in text
    assert str(folder) not in text


@pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed")
def test_it_prints_and_nothing_stands_out_of_the_page(made):
    folder, _ = made

    async def looked():
        async with chromium.chromium(1280, 900) as page:
            await page.open((folder / "one/dossier.html").absolute().as_uri())
            await page.until("document.readyState == 'complete'")
            wide = await page.value("document.documentElement.scrollWidth - document.documentElement.clientWidth")
            await page.call("Emulation.setEmulatedMedia", media="print")
            broken = await page.value("getComputedStyle(document.querySelector('#task')).breakBefore")
            printed = await page.call("Page.printToPDF", 60, preferCSSPageSize=True)
            return wide, broken, len(printed["data"]), page.errors

    wide, broken, size, errors = asyncio.run(looked())
    assert (wide, broken, errors) == (0, "page", [])
    assert size > 50_000


def test_nothing_wrong_is_not_contradicted_and_a_small_fault_is_not_found(made):
    """Negative control of the controls: what is planted is scaled by the number of exposures, and less is missed."""
    folder, _ = made
    campaign, store = Campaign.of(scenes.load(folder / "rig.toml")), RunFile.reopen(folder / "one/run")
    try:
        found = collect(campaign.measured_by(("arrangement", "gradient", "canny")), store)
        judge = Judge(campaign.case(0).picture, found.rows[0], store.image(0), 40, 3)
        told = {each.name: each for each in controls(judge)}
        assert not told["nothing"].found
        noise = judge.picture.scene.noise
        quieter = noise.model_copy(update={"sigma": 1.02 * noise.sigma})
        assert judge.verdict(9, judge.image, quieter).agrees
    finally:
        store.close()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("calibrated_rig", "--renders", "1"), "--renders must be at least 20, got 1"),
        (("calibrated_rig", "--exposures", "0"), "--exposures must be at least 20, got 0"),
        (("nothing.toml",), "nothing.toml must be a readable file"),
    ],
)
def test_bad_input_is_one_line(options, said, tmp_path):
    done = ice("dossier", *options, "--out", tmp_path / "out")
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1
