"""Kinds that a user adds from outside go through the commands as the project's own do (``tests/outside``)."""

import json
import sys

import cv2
import numpy as np
import pytest

import measure
import planner
import render
import scenes
from imaging.geometry.lens import lens_jacobian, recorded, undistorted
from imaging.geometry.projection import project, project_ideal
from render.phenomena import EFFECTS
from scenes import InvalidInput, plugins
from scenes.cameras import LENSES
from scenes.influences import INFLUENCES
from scenes.lights import LIGHTS
from scenes.materials import MATERIALS
from scenes.measurands.kinds import MEASURANDS
from scenes.registry import Registry
from tests.commands import ice
from tests.oracle import block_image

KINDS = {
    "spotlight": LIGHTS, "median": measure.ESTIMATORS, "vignetting": EFFECTS, "eccentricity": MEASURANDS,
    "satin": MATERIALS, "fisheye": LENSES, "fixture_expansion": INFLUENCES,
}  # fmt: skip
SENSOR, LIGHT = (30, 135), (15, 315)
PLAIN = "attached_shadow", "fall_off", "lens_blur"


@pytest.fixture(scope="module", autouse=True)
def outside():
    """The modules' kinds are known in this file's tests alone, whatever is run between two of them."""
    for name in KINDS:
        sys.modules.pop(f"tests.outside.{name}", None)
        plugins.load(f"tests.outside.{name}")
    yield
    for name, registry in KINDS.items():
        registry.remove(name)
    plugins._loaded.clear()


@pytest.fixture(scope="module")
def lit(task1):
    """Task 1 under a spotlight whose border runs beside the part, so that its faces get less towards their ends."""
    spot = {"kind": "spotlight", "distance": task1.light.distance, "cutoff_deg": 20.0, "beam_deg": 2.0}
    return task1.with_(light=spot)


def test_a_spotlight_is_predicted_rendered_and_measured_alike(lit):
    """It fades along the part's faces: variance and bias are others than a point's, and the renderer's are as told."""
    clean = render.image(lit, SENSOR, LIGHT, effects=PLAIN)
    point = planner.predict(lit.with_(light={"kind": "point", "distance": lit.light.distance}), SENSOR, LIGHT)
    found, told = measure.propagate(clean, lit, SENSOR, LIGHT), planner.predict(lit, SENSOR, LIGHT)
    # margin: the order is said, by more than chance
    assert told.variance_px2 > 1.3 * point.variance_px2
    assert found.variance_px2 == pytest.approx(told.variance_px2, rel=0.05)
    off = measure.distance(clean, lit, SENSOR, LIGHT).value_px - told.value_px
    # margin: the order is said
    assert abs(told.bias_px) > 10 * abs(point.bias_px)
    assert off == pytest.approx(told.bias_px, abs=2e-3)  # margin: 0.0006 is the renderer's own, 0.013 the bias


def test_a_spotlight_is_checked_as_every_light_is(task1):
    with pytest.raises(InvalidInput, match=r"light\.cutoff_deg must be less than 90, got 200"):
        task1.with_(light={"kind": "spotlight", "distance": 100.0, "cutoff_deg": 200.0})


def test_a_median_s_variance_is_what_noisy_images_show(task1):
    clean, noise = block_image(task1, SENSOR, LIGHT), task1.noise
    images = render.expose(clean, noise, np.random.default_rng(3), 400)
    found = measure.distance(images, task1, SENSOR, LIGHT, "median")
    assert (found.status == "ok").all()
    ratio = found.value_px.var(ddof=1) / found.variance_px2.mean()
    assert abs(ratio - 1) < 4 * np.sqrt(2 / 399)  # margin: 4 standard errors
    assert found.value_px.mean() == pytest.approx(planner.predict(task1, SENSOR, LIGHT).value_px, abs=0.02)
    least = measure.distance(images, task1, SENSOR, LIGHT, "gradient")
    assert not np.array_equal(found.value_px, least.value_px)


@pytest.fixture(scope="module")
def bracket():
    """The bracket before a camera of a fifth of the pixels each way, with the one requirement."""
    wanted = {"name": "aligned", "kind": "eccentricity", "tolerance": 0.1}
    features = [{"circle": "c2"}, {"circle": "c4"}, {"edge": "e10"}]
    camera = {"width": 490, "height": 410, "focal_px": 1450.0}
    whole = scenes.load("bracket_mm").with_(measurands=[{**wanted, "features": features}])
    return whole.model_copy(update={"camera": whole.camera.model_copy(update=camera)})


def test_a_measurand_s_value_and_variance_are_what_noisy_images_show(bracket):
    told = planner.predict(bracket, (20, 0), (20, 225)).measurands[0]
    assert (told.kind, told.unit) == ("eccentricity", "mm")
    assert told.value_object == pytest.approx(18.0 - 48.0)  # of the holes, along the part's length
    clean = render.image(bracket, (20, 0), (20, 225), effects=(*PLAIN, "cast_shadow"))
    known = measure.propagate(clean, bracket, (20, 0), (20, 225)).measurands
    images = render.expose(clean, bracket.noise, np.random.default_rng(5), 100)
    found = measure.measure(images, bracket, (20, 0), (20, 225)).value[:, 0]
    ratio = np.var(found, ddof=1) / known.covariance[0, 0]
    assert abs(ratio - 1) < 4 * np.sqrt(2 / 99)  # margin: 4 standard errors


def test_vignetting_dims_the_picture_s_corners_and_can_be_left_out(task1):
    without, seen = (render.image(task1, SENSOR, LIGHT, effects=each) for each in (PLAIN, (*PLAIN, "vignetting")))
    y, x = np.unravel_index(without.argmax(), without.shape)
    (height, width), focal = without.shape, task1.camera.focal_px
    tangent2 = ((x - (width - 1) / 2) ** 2 + (y - (height - 1) / 2) ** 2) / focal**2
    dark = task1.noise.dark_level
    assert seen[y, x] - dark == pytest.approx((without[y, x] - dark) * np.cos(np.arctan(np.sqrt(tangent2))) ** 4)
    # margin: the order is said
    assert seen[y, x] < without[y, x]
    (decision,) = (each for each in render.effects(task1) if each.effect.name == "vignetting")
    assert decision.influence.variance > 0


GLEAM = (40, 135), (40, 315)  # the top face mirrors the light to the sensor


@pytest.fixture(scope="module")
def satin(task1):
    return task1.with_(material={"kind": "satin", "reflectance": 0.4, "mirrored": 0.05, "exponent": 30})


def test_a_material_s_lobe_is_rendered_as_it_is_predicted(satin):
    """Level by level inside the top face, most of which is the lobe's; and the edges are found where they are."""
    clean = render.image(satin, *GLEAM, effects=(*PLAIN, "specular_lobe"))
    matt = render.image(satin.with_(material={"kind": "satin", "reflectance": 0.4, "mirrored": 0.0}), *GLEAM)
    expected = planner.image(satin, *GLEAM)
    inside = (expected - matt) > 0.5 * (expected - matt).max()
    assert inside.sum() > 500
    assert (clean - matt)[inside] == pytest.approx((expected - matt)[inside], rel=0.01)  # margin: 1e-3 is measured
    told, found = planner.predict(satin, *GLEAM), measure.propagate(clean, satin, *GLEAM)
    # margin: the renderer's own noise, half a per cent
    assert found.variance_px2 == pytest.approx(told.variance_px2, rel=0.02)
    assert measure.distance(clean, satin, *GLEAM).value_px == pytest.approx(told.value_px + told.bias_px, abs=3e-3)


def test_effects_know_a_material_s_lobe(satin):
    (lobe,) = (each for each in render.effects(satin) if each.effect.name == "specular_lobe")
    assert lobe.influence.variance > 0.1
    dull = satin.with_(material={"kind": "satin", "mirrored": 0.0})
    (lobe,) = (each for each in render.effects(dull) if each.effect.name == "specular_lobe")
    assert lobe.reason == "mirrored is 0"


@pytest.fixture(scope="module")
def bent(task1):
    return task1.with_(camera={**task1.camera.model_dump(), "lens": {"kind": "fisheye"}})


def test_a_fisheye_records_points_where_opencv_s_does(bent):
    camera, points = bent.camera, bent.solid.vertices
    middle = (camera.width - 1) / 2, (camera.height - 1) / 2
    matrix = np.array([[camera.focal_px, 0, middle[0]], [0, camera.focal_px, middle[1]], [0, 0, 1]])
    ideal = project_ideal(points, np.array(SENSOR), camera)
    rays = np.column_stack([(ideal - middle) / camera.focal_px, np.ones(len(points))])
    expected = cv2.fisheye.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), matrix, np.zeros(4))[0][:, 0]
    found = project(points, np.array(SENSOR), camera)
    assert found == pytest.approx(expected, abs=1e-9)
    assert np.abs(found - ideal).max() > 0.1  # px: the distortion is seen
    step = 1e-6 * np.eye(2)[:, None]
    slope = (recorded(ideal + step, camera) - recorded(ideal - step, camera)) / 2e-6
    assert lens_jacobian(ideal, camera) == pytest.approx(np.moveaxis(slope, 0, -1), abs=1e-6)
    assert undistorted(found, camera) == pytest.approx(ideal, abs=1e-8)


def test_through_a_fisheye_is_measured_what_a_pinhole_would_show(bent, task1):
    clean = render.image(bent, SENSOR, LIGHT, effects=(*PLAIN, "lens_distortion"))
    told, found = planner.predict(bent, SENSOR, LIGHT), measure.propagate(clean, bent, SENSOR, LIGHT)
    assert told.value_px == pytest.approx(planner.predict(task1, SENSOR, LIGHT).value_px)
    assert found.variance_px2 == pytest.approx(told.variance_px2, rel=0.05)
    assert measure.distance(clean, bent, SENSOR, LIGHT).value_px == pytest.approx(told.value_px, abs=6e-3)
    assert abs(measure.distance(clean, task1, SENSOR, LIGHT).value_px - told.value_px) > 0.03  # as if it were none


def test_a_fixture_s_expansion_is_in_the_budget_as_the_part_s_shift(task1):
    """100 cm of steel of which the temperature is known to 2 K lift the part by 12e-6 x 100 x 2."""
    steel = {"kind": "fixture_expansion", "sd": 2.0, "height": 100.0, "expansion_per_K": 12e-6}
    lift = planner.budget(task1.with_(uncertainty={"part_shift": 12e-6 * 100 * 2}), SENSOR, LIGHT).measurands[0]
    found = planner.budget(task1.with_(uncertainty={"influences": [steel]}), SENSOR, LIGHT).measurands[0]
    by_name = {row.source: row for row in found.contributions}
    expected = {row.source: row for row in lift.contributions}["part_shift.z"]
    # margin: what central differences of two steps leave
    assert by_name["fixture_expansion"].contribution == pytest.approx(expected.contribution, rel=1e-6)
    assert by_name["fixture_expansion"].contribution > 0
    # margin: what central differences of two steps leave
    assert by_name["fixture_expansion"].sensitivity == pytest.approx(12e-4 * expected.sensitivity, rel=1e-6)
    with pytest.raises(InvalidInput, match=r"uncertainty\.influences must be of different kinds, got fixture_exp"):
        task1.with_(uncertainty={"influences": [steel, steel]})


def test_one_face_may_be_of_a_material_of_one_s_own(task1):
    top = {"kind": "satin", "name": "plate", "where": "top", "mirrored": 0.05}
    scene = task1.with_(materials=[top])
    assert [each.kind for each in scene.surfaces.used] == ["torrance_sparrow", "satin"]
    assert scene.materials[0].material == scene.surfaces.materials[1]
    assert scenes.Scene.model_validate(scene.model_dump()).materials == scene.materials
    with pytest.raises(InvalidInput, match=r"materials\[0\].exponent must be at least 1, got 0"):
        task1.with_(materials=[{**top, "exponent": 0}])


@pytest.mark.parametrize(
    "command",
    [
        ("predict", "own.toml", "--sensor", "30,135", "--light", "15,315"),
        ("effects", "own.toml"),
        ("plan", "own.toml", "--step", "90", "--sensor", "30,135", "--no-check"),
        ("budget", "own.toml"),
        ("validate", "own.toml", "--renders", "20", "--workers", "1"),
    ],
    ids=lambda command: command[0],
)
def test_commands_take_them(command, tmp_path):
    text = (scenes.load.__globals__["BUNDLED"] / "task1.toml").read_text()
    before, _, rest = text.partition("[light]")
    own = "[light]\nkind = 'spotlight'\ncutoff_deg = 12.0\nbeam_deg = 0.5" + rest
    own += "\n[[materials]]\nname = 'gloss'\nkind = 'satin'\nwhere = 'top'\nmirrored = 0.01\n"
    (tmp_path / "own.toml").write_text(before + own)
    modules = "--plugin", "tests.outside.spotlight", "--plugin", "tests.outside.satin"
    done = ice(*modules, *command, "--json", cwd=tmp_path)
    assert done.returncode in (0, 1), done.stderr
    assert json.loads(done.stdout)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("no_such_module_here", "No module named"),
        ("a b", "must be a module's name"),
        ("own_kind", "light.kind must have a name of its own, got 'ring'"),
        ("broken", "division by zero"),
    ],
)
def test_a_module_that_cannot_be_loaded_is_one_line(name, says, tmp_path):
    (tmp_path / "broken.py").write_text("1 / 0\n")
    (tmp_path / "own_kind.py").write_text("from scenes.lights import LIGHTS, Disc\nLIGHTS.add('ring')(Disc)\n")
    done = ice("--plugin", name, "scenes", cwd=tmp_path)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert says in done.stderr


def test_a_scene_file_loads_no_code(tmp_path):
    """A kind that nobody has loaded is refused, by a name that a module of the folder has, too."""
    (tmp_path / "flood.py").write_text("raise SystemExit('loaded')\n")
    text = (scenes.load.__globals__["BUNDLED"] / "task1.toml").read_text()
    (tmp_path / "own.toml").write_text(text.replace("[light]", "[light]\nkind = 'flood'"))
    done = ice("show", "own.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert "light.kind must be one of " in done.stderr


def test_a_name_stands_for_one_kind():
    kinds = Registry("thing")
    kinds.add("a")(1)
    kinds.add("a")(1)
    with pytest.raises(InvalidInput, match="thing must have a name of its own, got 'a'"):
        kinds.add("a")(2)
    with pytest.raises(InvalidInput, match="thing must be one of a, got 'b'"):
        kinds["b"]
    kinds.remove("a")
    assert not len(kinds)
