"""A recipe answers as the program does: values, statuses, U and decisions, of good pictures and of bad ones."""

import importlib.util
import json
import shutil
import subprocess
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import measure
import scenes
from measure import Images
from scenes import Noise, Picture
from tests.commands import ice
from tests.oracle import block_image
from tests.recipes import loaded, noisy, same
from validation import kept
from validation.recipe import folder as folders
from validation.recipe.export import check, export
from validation.recipe.runtime import DISPLACED
from validation.strict_json import dumps, plain

POSES = (30, 90), (15, 270)


def _scene(**changes):
    """The paper's block with a requirement, in a picture that is computed exactly."""
    task1 = scenes.load("task1")
    start, end = task1.task.start, task1.task.end
    told = {
        "name": "diagonal",
        "kind": "distance",
        "tolerance": 0.02,
        "features": [start.model_dump(), end.model_dump()],
    }
    width = {"name": "across", "kind": "width", "features": [{"edge": "e4"}, {"edge": "e7"}], "tolerance": 0.05}
    angle = {"name": "corner", "kind": "angle", "features": [{"edge": "e4"}, {"edge": "e9"}]}
    return task1.with_(task=None, measurands=[told, width, angle], uncertainty={"sensor_distance": 0.02}, **changes)


@cache
def _known(gain):
    """A picture, the exact image, and its correction, of a camera whose light has noise of its own, or none."""
    scene = _scene(noise=scenes.load("task1").noise.model_dump() | {"gain": gain})
    picture = Picture.of(scene, *POSES)
    clean = block_image(scene, *POSES) + scene.noise.dark_level
    rng = np.random.default_rng(0)
    correction = measure.correction(Images((clean, clean + rng.normal(0, 0.02, clean.shape))), picture, "gradient")
    return picture, clean, correction


@pytest.fixture(scope="module", params=[0.0, 0.05], ids=["white", "with shot noise"])
def known(request):
    return _known(request.param)


@pytest.fixture(scope="module")
def recipes(known, tmp_path_factory):
    picture, _, correction = known
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kept, "correction", lambda *_: correction)
        return [loaded(export(picture, as_measured=bare), tmp_path_factory.mktemp("recipe")) for bare in (False, True)]


@pytest.mark.parametrize("light", [1.0, 1.4, 0.02, 0.0])
def test_as_the_program_answers(known, recipes, light):
    """Good pictures, saturated ones and dark ones."""
    picture, clean, correction = known
    image = noisy(clean, picture, np.random.default_rng(int(100 * light)), light)
    states, _ = (same(recipe, image, picture, off) for recipe, off in zip(recipes, (correction, None), strict=True))
    assert light != 1.0 or states == ["ok"] * 3
    assert light != 0.0 or states == ["low_contrast"] * 3


def test_a_part_that_is_half_hidden(known, recipes):
    picture, clean, correction = known
    image = noisy(clean, picture, np.random.default_rng(5))
    image[:, : image.shape[1] // 2] = picture.scene.noise.dark_level
    assert "low_contrast" in same(recipes[0], image, picture, correction)


def test_a_displaced_part_is_not_measured(known, recipes):
    """Half a pixel is followed, three are told: no value, no decision."""
    picture, clean, _ = known
    image = noisy(clean, picture, np.random.default_rng(6))
    for row in recipes[0].measure(np.roll(image, 3, 1))["measurands"]:
        assert row["status"] == DISPLACED
        assert row["value"] is row["sigma"] is row["U"] is None
        assert row["decision"] == ("undecided" if row["tolerance"] else None)
    half = (image + np.roll(image, 1, 1)) / 2
    assert DISPLACED not in same(recipes[1], half, picture, None)


@pytest.mark.parametrize(("image", "message"), [
    (np.zeros((240, 255)), r"size 256 x 240, got shape \(240, 255\)"), (np.zeros((1, 240, 256)), "got shape"),
    (np.zeros((240, 256), complex), "real numbers, got complex128"), (np.full((240, 256), np.nan), "finite numbers"),
    (np.full((240, 256), 1e16), "up to 1e\\+15, got 1e\\+16"), ([["a"]], "real numbers"),
])  # fmt: skip
def test_what_is_no_picture(recipes, image, message):
    with pytest.raises(ValueError, match=message):
        recipes[0].measure(image)


def test_whole_numbers_are_levels(known, recipes):
    picture, clean, _ = known
    image = noisy(clean, picture, np.random.default_rng(7))
    assert recipes[0].measure(image.astype(np.uint8)) == recipes[0].measure(image)


@pytest.mark.parametrize(("scene", "poses", "message"), [
    (lambda: _scene(), (POSES[0], None), "--light must be given"),
    (lambda: _scene(noise=Noise(sigma=1.0, row_sigma=0.5).model_dump()), POSES, "independent pixels .*row_sigma"),
])  # fmt: skip
def test_what_has_no_recipe(scene, poses, message):
    with pytest.raises(scenes.InvalidInput, match=message):
        check(Picture.of(scene(), *poses), "gradient")


def test_the_command_refuses_with_one_line(tmp_path):
    for options, message in (
        (("--estimator", "arrangement"), "--estimator must be gradient for a recipe, got arrangement"),
        (("--estimator", "best"), "--estimator must be one of canny, gradient"),
    ):
        done = ice("export", "task1", "--sensor", "30,90", "--light", "15,270", *options, "-o", tmp_path / "out")
        assert done.returncode == 2
        assert done.stdout == ""
        assert len(done.stderr.splitlines()) == 1
        assert message in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """A recipe's folder as the command writes it, its example the exact image."""
    picture, clean, correction = _known(0.0)
    folder = tmp_path_factory.mktemp("exported")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kept, "correction", lambda *_: correction)
        patch.setattr(folders, "recorded", lambda made: np.rint(clean).astype(np.uint8))
        made = export(picture)
        return folder, folders.write(made, "task1", folder), made


def test_a_folder_needs_nothing_of_the_project(exported):
    folder, told, _ = exported
    assert sorted(str(f.relative_to(folder)) for f in folder.rglob("*") if f.is_file()) == told["files"]
    text = (
        "import sys, json; before = set(sys.modules); sys.path.insert(0, sys.argv[1]); import numpy, recipe;"
        "found = recipe.measure(numpy.load(sys.argv[1] + '/example.npy'));"
        "print(json.dumps([found, sorted({name.partition('.')[0] for name in set(sys.modules) - before})]))"
    )
    done = subprocess.run([sys.executable, "-I", "-B", "-c", text, folder], capture_output=True, text=True, check=True)
    found, loaded = json.loads(done.stdout)
    assert found == json.loads((folder / "expected.json").read_text())
    ours = {"scenes", "imaging", "measure", "planner", "render", "validation", "scipy", "pydantic", "cv2", "mitsuba"}
    assert not ours & set(loaded)
    assert {"numpy", "recipe", told["code"]} <= set(loaded)


def test_the_front_as_a_command(exported, tmp_path):
    folder, _, _ = exported
    bad = tmp_path / "bad.npy"
    np.save(bad, np.zeros((2, 3)))
    for arguments, message in (([], "PICTURE must be one .npy file"), ([bad], "must be of the camera's size"),
                               ([tmp_path / "none.npy"], "No such file")):  # fmt: skip
        command = [sys.executable, "-I", "-B", folder / "recipe.py", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 2
        assert done.stdout == ""
        assert message in done.stderr
        assert len(done.stderr.splitlines()) == 1


def test_what_the_readme_says(exported):
    folder, told, made = exported
    text = (folder / "README.md").read_text()
    for wanted in (
        told["sha256"],
        told["version"],
        "30,90",
        "15,270",
        "256 x 240",
        "`displaced`",
        "diagonal",
        "across",
    ):
        assert wanted in text
    assert "{" not in text
    assert made.facts["estimator"] in text


def test_a_recipe_that_answers_otherwise_is_not_written(exported, tmp_path, monkeypatch):
    """Negative control: a gain that is off by a hundredth."""
    _, _, made = exported
    monkeypatch.setattr(folders, "recorded", lambda _: np.load(exported[0] / "example.npy"))
    wrong = replace(made, arrays=made.arrays | {"places.gain": made.arrays["places.gain"] * 1.01})
    with pytest.raises(RuntimeError, match="the recipe answers"):
        folders.write(wrong, "task1", tmp_path)


def test_two_recipes_in_one_program(exported, tmp_path):
    """Loaded by their paths, they do not meet: one more takes no bias off."""
    folder, _, made = exported
    other = tmp_path / "data"
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    (other / "facts.json").write_text(dumps(plain(made.facts | {"correction": None})))
    one, two = (_by_path(f"line_{k}", each / "recipe.py") for k, each in enumerate((folder, tmp_path)))
    image = np.load(folder / "example.npy")
    found, bare = (each.measure(image)["measurands"][0] for each in (one, two))
    assert bare["bias"] is None
    assert bare["value"] == pytest.approx(found["value"] + found["bias"], rel=1e-14)


def _by_path(name, file):
    spec = importlib.util.spec_from_file_location(name, file)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made
