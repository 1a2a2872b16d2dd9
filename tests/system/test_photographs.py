"""``ice validate --photos``: repeated photographs in the place of renders, the same table and verdict."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

import render
import scenes
from scenes import InvalidInput
from validation import run
from validation.batch import campaign, photographs
from validation.cli.application import app

pytestmark = pytest.mark.render
COUNT = 30
NAMES = ("sensor_30_90_light_15_270", "sensor_30_90_light_60_210")


@pytest.fixture(scope="module")
def clean(task1):
    return [render.image(task1, setting.sensor, setting.light) for setting in task1.settings[:2]]


def take(folder, images, noise, seed, suffix=".png", names=NAMES):
    """Photographs of each image in a sub-folder of its own: 16 bit PNG or float TIFF."""
    for k, (name, image) in enumerate(zip(names, images, strict=True)):
        (folder / name).mkdir(parents=True)
        shots = render.expose(image, noise, np.random.default_rng([seed, k]), COUNT)
        for i, shot in enumerate(shots):
            level = shot.astype(np.uint16) if suffix == ".png" else shot.astype(np.float32)
            cv2.imwrite(str(folder / name / f"{i:03d}{suffix}"), level)
    return folder


def validate(folder, out, *more):
    done = CliRunner().invoke(
        app, ["validate", "task1", "--photos", str(folder), "--out", str(out), "--workers", "1", "--json", *more]
    )
    return done, json.loads(done.stdout) if done.stdout else None


def test_photographs_are_judged_as_renders_are(clean, task1, tmp_path):
    done, told = validate(take(tmp_path / "photos", clean, task1.noise, 1), tmp_path / "out")
    assert (done.exit_code, told["verdict"].split(":")[0]) == (0, "agree")
    rendered = json.loads((Path(__file__).parents[1] / "regression" / "reference.json").read_text())
    assert rendered.keys() | {"left_out"} <= told.keys()
    assert rendered["settings"][0].keys() <= told["settings"][0].keys()
    assert [(row["n"], row["status"], row["paper_ice"]) for row in told["settings"]] == [
        (COUNT, "ok", 0.079), (COUNT, "ok", 0.352),
    ]  # fmt: skip
    assert (told["variant"], told["left_out"], told["refused"]) == ("photographs", [], [])
    again = validate(tmp_path / "photos", tmp_path / "out")[1]
    assert again["settings"] == told["settings"]
    assert {"table.csv", "result.json", "figures"} <= {path.name for path in (tmp_path / "out").iterdir()}
    assert CliRunner().invoke(app, ["report", str(tmp_path / "out")]).exit_code == 0

    (tmp_path / "photos" / NAMES[0] / "000.png").unlink()
    with pytest.raises(InvalidInput, match="--out must be a new directory or hold this run"):
        CliRunner().invoke(
            app, ["validate", "task1", "--photos", str(tmp_path / "photos"), "--out", str(tmp_path / "out")],
            catch_exceptions=False,
        )  # fmt: skip


def test_photographs_with_twice_the_noise_contradict(clean, task1, tmp_path):
    noise = task1.noise.model_copy(update={"sigma": 2 * task1.noise.sigma})
    done, told = validate(take(tmp_path / "photos", clean, noise, 2), tmp_path / "out")
    assert (done.exit_code, told["verdict"].split(":")[0]) == (1, "contradict")
    # margin: the order is said: four times the variance
    assert all(row["ratio_interval"][0] > 1 for row in told["settings"])


def test_what_is_no_photograph_is_told_of(clean, task1, tmp_path):
    """A file that is none, one of another size, and a setting without photographs; the rest is measured."""
    folder = take(tmp_path / "photos", clean, task1.noise, 3, ".tif")
    (folder / NAMES[0] / "007.tif").write_bytes(b"no image")
    cv2.imwrite(str(folder / NAMES[1] / "008.tif"), np.zeros((10, 20), np.float32))
    (folder / NAMES[0] / "notes.txt").write_text("not a photograph")
    (folder / "sensor_45_225_light_15_45").mkdir()
    done, told = validate(folder, tmp_path / "out")
    assert done.exit_code == 0
    assert [row["n"] for row in told["settings"]] == [COUNT - 1, COUNT - 1]
    assert [len(told["left_out"]), len(told["refused"])] == [2, 1]
    assert "007.tif must be a readable image" in told["left_out"][0]
    assert "008.tif must be 256 x 240 px as the camera, got 20 x 10" in told["left_out"][1]
    assert "must hold at least 2 photographs of 256 x 240 px, got 0" in told["refused"][0]["reason"]
    assert done.stderr.count("left out: ") == 2


def test_an_index_says_which_photographs_are_of_which_setting(clean, task1, tmp_path):
    take(tmp_path, clean, task1.noise, 4, names=("one", "other"))
    (tmp_path / "photos.toml").write_text("""
        [[settings]]
        sensor = [30, 90]
        light = [60, 210]
        files = ["other/*.png"]
        [[settings]]
        sensor = [30, 90]
        light = [[15, 270]]
        files = ["one/000.png", "one/01*.png", "one/nothing.png"]
    """)
    found = photographs.load(campaign.load("task1"), tmp_path)
    assert found.counts == [COUNT, 11]
    assert [setting.paper_ice for setting in found.campaign.scenes[0].settings] == [0.352, 0.079]
    assert "nothing.png must be a readable image" in found.left_out[0]


def test_the_mean_error_is_judged_where_poses_are_exact(clean, task1, tmp_path):
    """Photographs from a sensor half a degree off: the scatter is as predicted, the mean is not."""
    off = [render.image(task1, (30.5, 90), setting.light) for setting in task1.settings[:2]]
    folder = take(tmp_path / "photos", off, task1.noise, 5)
    loaded = campaign.load("task1")

    def reasons(taken, exact):
        photos = photographs.load(loaded, taken, exact)
        return run(loaded, photos=photos, out=tmp_path / f"{taken.name}{exact}", workers=1).verdict.reasons

    assert reasons(folder, False) == ()
    assert reasons(folder, True) == ("bias",)
    assert reasons(take(tmp_path / "same", clean, task1.noise, 5), True) == ()


@pytest.mark.parametrize(
    ("name", "match"),
    [
        ("sensor_30", "must be named as sensor_30_90_light_15_270, got 'sensor_30'"),
        ("sensor_30_90", "light must be 1 pose"),
        ("sensor_300_90_light_15_270", "polar_deg must be between 0 and 180"),
        (".hidden", "--photos must be a folder with photos.toml or sub-folders"),
        ("sensor_30_90_light_15_270", "must hold at least 2 photographs"),
    ],
)
def test_a_folder_that_is_none_is_refused(tmp_path, name, match):
    (tmp_path / name).mkdir()
    with pytest.raises(InvalidInput, match=match):
        photographs.load(campaign.load("task1"), tmp_path)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("x = 1", "settings must be a list of tables"),
        ("settings = [1]", r"settings\[0\]"),
        ('[[settings]]\nsensor = [30, 90]\nlight = [15, 270]\nfiles = ["../x.png"]', "names inside the folder"),
        ('[[settings]]\nsensor = [30]\nlight = [15, 270]\nfiles = ["x.png"]', r"settings\[0\]: pose must be a pair"),
        ('[[settings]]\nsensor = [30, 90]\nlight = [15, 270]\nfiles = []', "files must"),
    ],
)  # fmt: skip
def test_an_index_that_is_none_is_refused(tmp_path, text, match):
    (tmp_path / "photos.toml").write_text(text)
    with pytest.raises(InvalidInput, match=match):
        photographs.load(campaign.load("task1"), tmp_path)


def test_options_that_contradict_photographs_are_refused(tmp_path):
    for more in (["--exact-poses"], ["--photos", str(tmp_path), "--accuracy", "0.1"]):
        with pytest.raises(InvalidInput, match="must be given"):
            CliRunner().invoke(app, ["validate", "task1", "--out", str(tmp_path / "o"), *more], catch_exceptions=False)
    with pytest.raises(InvalidInput, match="--photos must be a readable folder"):
        photographs.load(campaign.load("task1"), tmp_path / "nowhere")
    assert scenes.load("task1").settings  # the scene itself is as it was
