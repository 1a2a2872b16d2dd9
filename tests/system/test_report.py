"""The report as its reader meets it: in a browser, on a phone, as text."""

import csv
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import cv2
import pytest

import scenes
import validation
from scenes.load import BUNDLED
from tests.looking import NOTHING, WIDTHS, against_wcag, looked_at
from validation.batch.campaign import Campaign
from validation.batch.store import RunFile
from validation.cli.main import app

pytestmark = pytest.mark.render

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--enable-logging=stderr",
]  # fmt: skip


class Page(HTMLParser):
    """What a reader without eyes gets: the verdict's text, pictures with their alternatives, outside addresses."""

    def __init__(self, text):
        super().__init__()
        self.verdict, self.pictures, self.outside, self._inside, self.ids = "", [], [], False, []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self._inside = given.get("id") == "verdict"
        self.ids += [given["id"]] if "id" in given else []
        if tag == "svg" and given.get("class") != "balloon":
            self.pictures.append(given)
        self.outside += [v for k in ("src", "href") if (v := given.get(k)) and not v.startswith("data:")]

    def handle_endtag(self, tag):
        self._inside = False

    def handle_data(self, data):
        self.verdict += data if self._inside else ""


@pytest.fixture(scope="module")
def campaign(small_toml):
    """Two settings under two kinds of noise, one of them named so that it would break a careless page."""
    small = scenes.load(small_toml)
    scene = small.model_copy(update={"title": 'a < b & "c" | d', "settings": small.settings[:2]})
    return Campaign(name="sweep", title=scene.title, scenes=(scene,), sweep={"noise.sigma": (2.4, 4.8)})


@pytest.fixture(scope="module")
def found(campaign, tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    return validation.run(campaign, renders=250, seed=1, out=out, workers=1), out


@pytest.fixture(scope="module")
def page(found):
    with pytest.raises(SystemExit) as ended:
        app(["report", str(found[1])])
    assert ended.value.code == 0
    return found[1] / "report.html"


def test_verdict_pictures_and_no_network(found, page):
    read = Page(page.read_text())
    assert read.verdict == found[0].verdict.text
    assert read.outside == []
    assert len(read.pictures) == 8  # the part, two sketches, scatter, bias, distributions, budget, time
    for picture in read.pictures:
        assert picture["role"] == "img"
        assert len(picture["aria-label"]) > 20
    assert len(set(read.ids)) == len(read.ids)
    assert page.stat().st_size < 3 << 20


def test_table_has_the_numbers_of_the_run(found, page):
    text = page.read_text()
    for row in found[0].rows:
        assert f"{row.main.ratio:.3f} [{row.main.ratio_interval[0]:.3f}, " in text
    assert "a &lt; b &amp; &#34;c&#34; | d" in text


def test_markdown_has_the_same_tables(found, page):
    lines = page.with_suffix(".md").read_text().splitlines()
    assert found[0].verdict.text in lines
    rows = [line for line in lines if re.match(r"\| [1-4] \| (2.4|4.8) \|", line)]
    assert len(rows) == 4 * 4  # settings, and three tables of them
    widths = {line.count("|") for line in lines if line.startswith("|")}
    assert max(widths) > 8


def test_csv_and_parquet_hold_every_setting(found, page):
    with (page.parent / "table.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert [float(line["gradient_empirical"]) for line in lines] == [row.main.empirical for row in found[0].rows]
    assert [float(line["noise.sigma"]) for line in lines] == [2.4, 2.4, 4.8, 4.8]
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra 'parquet' is not installed")
    with pytest.raises(SystemExit):
        app(["report", str(found[1]), "--parquet"])
    table = parquet.read_table(page.parent / "table.parquet")
    assert table["gradient_empirical"].to_pylist() == [row.main.empirical for row in found[0].rows]


def browse(tmp_path, page, width, *flags):
    command = [CHROMIUM, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900", *flags]
    return subprocess.run([*command, page.as_uri()], capture_output=True, text=True, timeout=60)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_in_a_browser(found, page, tmp_path):
    """Screenshot at a phone's width; no message on the console; the verdict from the rendered page; nothing cut off."""
    probe = tmp_path / "probe.html"
    script = "<script>document.title = [document.documentElement.scrollWidth, innerWidth]</script>"
    probe.write_text(page.read_text().replace("</body>", script + "</body>"))
    shot = browse(tmp_path, page, 500, f"--screenshot={tmp_path / 'page.png'}")
    assert "CONSOLE" not in shot.stderr
    picture = cv2.imread(str(tmp_path / "page.png"))
    assert picture.shape[1] == 500
    assert picture.std() > 10
    dom = browse(tmp_path, probe, 500, "--dump-dom")
    width, inner = map(int, re.search("<title>([0-9,]+)</title>", dom.stdout)[1].split(","))
    assert width <= inner <= 500
    assert Page(dom.stdout).verdict == found[0].verdict.text


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
@pytest.mark.parametrize("width", WIDTHS)
def test_nothing_is_cut_off_or_covered(page, width):
    """Wide tables scroll in their own box, all else fits; no label lies on another; text stands out as WCAG AA asks."""
    first, opened, errors = looked_at(page, width)
    assert errors == []
    for found in (first, opened):
        assert found == NOTHING


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_the_look_sees_what_is_wrong(page, tmp_path):
    """Negative control: a line that fits nowhere, one label on another, grey on white, small print."""
    bad = (
        '<p style="white-space: nowrap">' + 300 * "wide " + '</p><p style="color: #999; font-size: 8px">faint</p>'
        '<svg width="50" height="20"><text y="12">one</text><text y="14">two</text></svg>'
        '<svg width="60" height="20"><rect width="60" height="20" fill="#333"/><text x="5" y="12">dark</text></svg>'
        '<svg width="60" height="20"><text x="20" y="12">too long to be seen</text></svg></main>'
    )
    (tmp_path / "page.html").write_text(page.read_text().replace("</main>", bad))
    found = looked_at(tmp_path / "page.html", 390)[0]
    assert found["outside"] or found["clipped"]
    assert found["overlaps"] == ["one | two"]
    assert found["cut"][-1] == "too long to be seen"
    assert ["faint" in each or "dark" in each for each in found["faint"]] == [True, True]
    assert found["small"] == 1


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_axe_core_has_nothing_to_say(page, tmp_path):
    """Nor has it of what is folded; negative control: grey on white, a picture without a name."""
    opened = page.read_text().replace("<details>", "<details open>")
    assert "<details open>" in opened
    (tmp_path / "page.html").write_text(opened)
    assert against_wcag(tmp_path / "page.html") == []
    bad = '<p style="color: #999">faint</p><img src="data:,"></main>'
    (tmp_path / "page.html").write_text(page.read_text().replace("</main>", bad))
    assert [each.split(":")[0] for each in against_wcag(tmp_path / "page.html")] == ["color-contrast", "image-alt"]


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_the_console_check_sees_an_error(tmp_path):
    """Negative control."""
    bad = tmp_path / "bad.html"
    bad.write_text("<script>console.error('wrong')</script>")
    assert "CONSOLE" in browse(tmp_path, bad, 500, "--dump-dom").stderr


def test_report_as_json(found, capsys):
    with pytest.raises(SystemExit):
        app(["report", str(found[1]), "--json"])
    document = json.loads(capsys.readouterr().out)
    assert document["verdict"] == found[0].verdict.text
    assert len(document["files"]) == 4


def test_not_a_run_directory(tmp_path):
    with pytest.raises(scenes.InvalidInput, match="DIR must be a run directory of `ice validate`, got"):
        app(["report", str(tmp_path)], standalone_mode=False)


def test_a_run_on_a_mesh_beside_its_scene_is_reported_from_elsewhere(tmp_path, monkeypatch, capsys):
    """The scene is named without a folder, as one who stands in it does; without where that was it cannot be read."""
    here, there = tmp_path / "here", tmp_path / "there"
    for each in (here, there):
        each.mkdir()
    (here / "plate.ply").write_bytes((BUNDLED / "plate.ply").read_bytes())
    (here / "mine.toml").write_text((BUNDLED / "plate.toml").read_text())
    monkeypatch.chdir(here)
    campaign = Campaign.of(scenes.load("mine.toml")).model_dump(mode="json", by_alias=True)
    others = {"seed": 0, "renders": 2, "chunk": 2, "variant": "scalar_rgb", "effects": "auto", "code": "0"}
    identity = others | {"campaign": campaign} | {key: {} for key in ("quality", "tolerance", "versions")}
    RunFile(tmp_path / "run", identity).close()
    monkeypatch.chdir(there)
    again = RunFile.reopen(tmp_path / "run")
    found = again.campaign().scenes[0].solid
    again.close()
    assert (found.vertices == scenes.load("plate").solid.vertices).all()
    monkeypatch.setattr(RunFile, "fact", lambda self, key, default=None: _fact(self, key, default))
    with pytest.raises(scenes.InvalidInput, match=r"object.file must be a readable mesh, got plate.ply"):
        RunFile.reopen(tmp_path / "run").campaign()


def _fact(store, key, default, read=RunFile.fact):
    """Of a run that does not say where it was started."""
    return default if key == "directory" else read(store, key, default)
