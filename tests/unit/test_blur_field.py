"""Blur and light that vary over the field: told alike by all arithmetics, rendered, predicted, measured, and fitted."""

import json
import tomllib
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.ndimage import binary_erosion, gaussian_filter1d
from scipy.optimize import least_squares
from scipy.special import ndtr

import measure
import planner
import render
import scenes
from imaging.blurred.arrangement import polygon_arrangement
from imaging.blurred.model import BlurredModel
from imaging.geometry.blur import blur_in_focus, blur_times, drift
from imaging.light.illumination import fall, illumination
from imaging.pictures import Pictures
from measure.fitting.likelihood import seen_coarsely
from measure.photo.blur_field import BlurredSides, blurred_sides, fitted_field
from planner.budgeting.sources import sources
from render.optics import blur_and_bin
from scenes import InvalidInput, Picture
from scenes.cameras.blur_field import BlurField, gaussian_um
from scenes.materials.vectors import Ops
from scenes.numbers import with_number
from scenes.photograph import Photograph
from tests.commands import ice
from tests.proofs import field_blur
from validation import fitted_scene
from validation.explore import preview

PRECISE = Ops(mp.sqrt, mp.exp, mp.log, min, max, lambda c, a, b: a if c else b)
FIELD = {"polynomial": [1.0, 0.5]}
K = 4


def camera(width=400, height=300, **more):
    return scenes.load("task1").camera.model_copy(
        update={"width": width, "height": height, "blur_px": 0.6, "blur_field": FIELD, **more}
    )


def test_a_table_is_kept_and_a_polynomial_is_one():
    """In the middle 1, at rows what they say, between them monotone, beyond the last as in it."""
    table = BlurField(table=((0.5, 1.2), (0.9, 2.0)))
    assert table.times(np.array([0.0, 0.25, 0.81, 1.0])).tolist() == pytest.approx([1, 1.2, 2, 2], rel=1e-15)
    assert (np.diff(table.times(np.linspace(0, 0.81, 101))) > 0).all()
    assert table.most == pytest.approx(2)
    h = np.linspace(0, 1, 7)
    assert BlurField(polynomial=(0.7, -0.2)).times(h**2) == pytest.approx(1 + 0.7 * h**2 - 0.2 * h**4, rel=1e-15)


@pytest.mark.parametrize(
    ("field", "off"), [({"polynomial": (1.5, -0.5)}, 1e-4), ({"table": ((0.3, 1.1), (0.8, 2.5))}, 0.02)]
)
def test_smoothed_images_are_blurred_by_both(field, off):
    """Variances add at every place, beside the kink where a table ends to 2 %; the ratios as they were are 30 % off."""
    one, h2 = BlurField(**field), np.linspace(0, 1, 101)
    both = 5.0 * one.smoothed(3.0, 4.0).times(h2)
    assert both == pytest.approx(np.hypot(3.0 * one.times(h2), 4.0), rel=off)
    assert np.abs(5.0 * one.times(h2) / both - 1).max() > 0.3
    assert one.smoothed(3.0, 0.0) is one


def test_a_coarse_view_of_a_fit_is_the_smoothed_picture():
    """Fewer pixels, smoothed by 1.5 of them: at corners and in the middle the blurs' variances add."""
    scene = scenes.load("task1")
    scene = scene.with_(camera={"blur_field": {"polynomial": [3.0]}})
    picture = Pictures.of(scene, *map(np.array, ((30.0, 135.0), (15.0, 315.0))))
    coarse = seen_coarsely(picture, 2, 1.5).scene.camera
    places = np.array([[10.0, 8.0], [coarse.width / 2, coarse.height / 2], [coarse.width - 9.0, 30.0]])
    alone = blur_in_focus(scene.camera, 2 * places + 0.5) / 2
    assert blur_in_focus(coarse, places) == pytest.approx(np.hypot(alone, 1.5), rel=2e-3)
    assert blur_in_focus(seen_coarsely(picture, 2, 0.0).scene.camera, places) == pytest.approx(alone, rel=2e-3)


def test_a_preview_is_as_blurred_as_its_places_are():
    """Edges in the middle and in a corner of an enlarged part: within 2 of 255 levels of Gaussians of these places.

    Blurred as in the middle, the corner's edge is off by more than 30.
    """
    some, part = camera(blur_px=1.0, blur_field={"polynomial": [4.0]}), preview.Window(100, 50, 300, 250)
    for x, y in ((200.0, 150.0), (385.0, 290.0)):
        canvas = np.zeros((500, 600), np.float32)
        canvas[:, round(2 * (x - 99.5)) :] = 255.0
        row = preview._blurred(canvas, some, part)[round(2 * (y - 49.5))]
        sigma = 2 * float(blur_in_focus(some, np.array([x, y])))
        assert np.abs(row - gaussian_filter1d(canvas[0], sigma, mode="nearest")).max() < 2 * (2 if x > 200 else 1)
    assert np.abs(row - gaussian_filter1d(canvas[0], 2.0, mode="nearest")).max() > 30


def test_a_transfer_says_the_gaussian_that_has_it():
    """exp(-2 pi^2 s^2 f^2) of each row's Gaussian is its contrast; ``blur_px`` follows, and follows anew."""
    rows, f, pitch = ((0.0, 0.6), (0.7, 0.5), (1.0, 0.2)), 80.0, 3.45
    field = {"mtf": rows, "lp_per_mm": f}
    scene = scenes.load("bracket_mm").with_(camera={"blur_field": field})
    for height, contrast in rows:
        sigma = scene.camera.blur_px * float(scene.camera.blur_field.times(height**2)) * pitch / 1000
        assert np.exp(-2 * (np.pi * sigma * f) ** 2) == pytest.approx(contrast, rel=1e-12)
    finer = scene.with_(camera={"pixel_pitch_um": pitch / 2, "sensor_size_mm": (8.4456 / 2, 7.0656 / 2)})
    assert finer.camera.blur_px == pytest.approx(2 * scene.camera.blur_px)
    sharper = with_number(scene, "camera.blur_field.mtf[0][1]", 0.7).camera
    assert sharper.blur_px == pytest.approx(gaussian_um(0.7, f) / pitch)
    assert sharper.most_blur_px == pytest.approx(scene.camera.most_blur_px)


@pytest.mark.parametrize("field", [BlurField(table=((0.4, 1.3), (0.8, 1.1), (1.0, 2.0))), BlurField(**FIELD)])
def test_one_source_for_all_arithmetics(field):
    """NumPy's values are those of 50 digits."""
    some = camera(blur_field=field)
    with mp.workdps(50):
        for x, y in ((3.5, 7.0), (200.0, 10.0), (390.0, 290.0)):
            exact = blur_times(some, mpf(x), mpf(y), PRECISE)
            assert isinstance(exact, mpf)
            assert blur_times(some, np.float64(x), np.float64(y)) == pytest.approx(float(exact), rel=1e-14)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"blur_field": {}}, "must have one of table, polynomial and mtf, got none"),
        ({"blur_field": {"table": [[1, 2]], "polynomial": [1]}}, "got table and polynomial"),
        ({"blur_field": {"table": [[0.5, 1.5], [0.4, 1.2]]}}, r"rows of rising image height, got \[0.5, 0.4\]"),
        ({"blur_field": {"table": [[0, 1.1]]}}, "must be 1 in the middle, got 1.1"),
        ({"blur_field": {"polynomial": [-1.0]}}, "between 0.1 and 20 times blur_px everywhere, got 0 to 1"),
        ({"blur_field": {"mtf": [[0, 0.5]]}}, "lp_per_mm must be given with mtf"),
        ({"blur_field": {"mtf": [[0.1, 0.5]], "lp_per_mm": 50}}, "must begin in the middle, at 0, got 0.1"),
        ({"blur_field": {"mtf": [[0, 0.5]], "lp_per_mm": 50}}, "pixel_pitch_um must be given with blur_field.mtf"),
        ({"relative_illumination": [[0, 0.9]]}, "relative_illumination must be 1 in the middle, got 0.9"),
        ({"relative_illumination": [[0.5, 0.9], [0.5, 0.8]]}, "rows of rising image height"),
    ],
)
def test_what_contradicts_itself_is_refused(task1, changes, said):
    with pytest.raises(InvalidInput, match=said):
        task1.with_(camera=changes)


def filled(polygons, width, height):
    """Part of each fine pixel that convex polygons cover, sixteen places of it."""
    found = np.zeros((height * K * 4, width * K * 4))
    for corners in polygons:
        low = np.floor((corners.min(0) + 0.5) * 4 * K).astype(int) - 1
        high = np.ceil((corners.max(0) + 0.5) * 4 * K).astype(int) + 1
        y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
        x, y = (x + 0.5) / (4 * K) - 0.5, (y + 0.5) / (4 * K) - 0.5
        sides = zip(corners, np.roll(corners, -1, 0), strict=True)
        inside = [(b - a)[0] * (y - a[1]) - (b - a)[1] * (x - a[0]) > 0 for a, b in sides]
        found[low[1] : high[1], low[0] : high[0]] += np.all(inside, 0)
    return found.reshape(height * K, 4, width * K, 4).mean((1, 3))


def fine_edge(some, place, degrees, size=40):
    """A straight edge through a place in fine pixels, its first pixel, and the unit normal, towards the light."""
    normal = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    first = np.floor(place).astype(int) - size // 2
    y, x = np.mgrid[: size * K * 4, : size * K * 4]
    points = (np.stack([x, y], -1) + 0.5) / (4 * K) - 0.5 + first
    lit = ((points - place) @ normal > 0).astype(float)
    return lit.reshape(size * K, 4, size * K, 4).mean((1, 3)), first, normal


def found_edge(some, place, degrees):
    """Offset along the normal, px, and blur over what it is there, of an edge in the image that is rendered of it."""
    fine, first, normal = fine_edge(some, place, degrees)
    image = blur_and_bin(fine, some, K, tuple((K * first).tolist()))
    y, x = np.mgrid[: len(image), : len(image)]
    away = np.stack([x, y], -1) + first - place
    near = (np.abs(away @ normal) < 6) & (np.linalg.norm(away, axis=-1) < 10)
    nodes = (np.arange(8) + 0.5) / 8 - 0.5
    across = (away @ normal)[near] + np.add.outer(nodes * normal[0], nodes * normal[1]).reshape(-1, 1)
    blur = blur_in_focus(some, place + (away @ [-normal[1], normal[0]])[near][:, None] * [-normal[1], normal[0]])

    def left(values):
        return ndtr((across - values[0]) / (values[1] * blur)).mean(0) - image[near]

    return least_squares(left, [0.0, 1.0]).x


PLACES = [
    (x, y, 17.0 + 40 * i) for i, (x, y) in enumerate((x, y) for y in (40.3, 150, 260.6) for x in (50.7, 200, 349.2))
]


def test_edges_are_rendered_where_they_are_and_blurred_as_there():
    """At nine places of the field to 1e-3 px, of blurs to half a percent; without the drift some are 3e-3 px off."""
    some, dropped = camera(), []
    for x, y, degrees in PLACES:
        place = np.array([x, y])
        offset, factor = found_edge(some, place, degrees)
        assert abs(offset) < 1e-3, (x, y)
        assert factor == pytest.approx(1, abs=5e-3), (x, y)
        normal = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
        dropped.append(abs(drift(some, place) @ normal))
    assert max(dropped) > 3e-3


def test_a_field_that_is_even_is_one_blur():
    """Beyond the middle 1.7 times the blur: every prediction, and each estimator, is that of 1.7 times ``blur_px``."""
    scene = scenes.load("task1")
    pose = scene.settings[0].sensor, scene.settings[0].light
    uneven = scene.with_(camera={"blur_field": {"table": [[0.0005, 1.7]]}})
    even = scene.with_(camera={"blur_px": 1.7 * scene.camera.blur_px})
    for model in ("calibrated", "bound"):
        one, two = (planner.predict(each, *pose, model=model) for each in (uneven, even))
        assert (one.variance_px2, one.bias_px) == pytest.approx((two.variance_px2, two.bias_px), rel=1e-9), model
    image = render.image(even, *pose)
    assert np.abs(render.image(uneven, *pose) - image).max() < 1e-4
    for name in ("gradient", "isophote", "canny", "strip", "arrangement"):
        one, two = (measure.propagate(image, each, *pose, name) for each in (uneven, even))
        assert (one.value_px, one.variance_px2) == pytest.approx((two.value_px, two.variance_px2), rel=1e-9), name


def test_the_image_of_a_polygon_whose_blur_varies_is_right_beside_all_of_it():
    """Against the rendered image of its fine pixels, also far along rows, where one blur alone leaves 2 %."""
    some = camera(200, 150, blur_field={"polynomial": [1.5]})
    corners = np.array([[31.3, 32.2], [161.6, 43.9], [150.4, 110.7], [20.8, 99.1]])
    image = blur_and_bin(filled([corners], 200, 150), some, K, (0, 0))
    y, x = (part.ravel() for part in np.mgrid[15:130, 8:190])
    plain = polygon_arrangement(corners, 0.9)
    away = {}
    for each in (some, None):
        model = BlurredModel(plain.__class__(**{**vars(plain), "camera": each}), x, y, np.arange(0))
        drawn = model.design(model.start())
        left = image[y, x] - drawn.T @ np.linalg.lstsq(drawn.T, image[y, x], rcond=None)[0]
        away[each is None] = np.abs(left).max()
    assert away[False] < 3e-3 < 0.02 < away[True]


def test_light_falls_off_as_said_in_levels_and_renders():
    """An image over that of an even lens is the lens' factor, and so is the predicted signal's; slopes are its own."""
    scene = scenes.load("task1")
    dim = scene.with_(camera={"relative_illumination": [[0.5, 0.8], [1.0, 0.5]], "natural_vignetting": True})
    pose = scene.settings[0].sensor, scene.settings[0].light
    before, after = (render.image(each, *pose) - scene.noise.dark_level for each in (scene, dim))
    y, x = np.mgrid[: before.shape[0], : before.shape[1]]
    factor = illumination(dim.camera, x, y)
    lit = binary_erosion(before > 100, iterations=6)
    assert after[lit] == pytest.approx((before * factor)[lit], rel=2e-4)
    assert factor[lit].min() < 0.9
    place, step = np.array([40.0, 60.0]), 1e-3
    slope = [np.log(illumination(dim.camera, *(place + d)) / illumination(dim.camera, *(place - d))) / (2 * step)
             for d in step * np.eye(2)]  # fmt: skip
    assert fall(dim.camera, place) == pytest.approx(slope, rel=1e-4)
    one, two = (planner.predict(each, *pose) for each in (scene, dim))
    assert two.variance_px2 > 1.05 * one.variance_px2
    told = measure.propagate(render.image(dim, *pose), dim, *pose, "gradient")
    plain = measure.propagate(render.image(scene, *pose), scene, *pose, "gradient")
    moved = (told.value_px - two.value_px) - (plain.value_px - one.value_px)
    assert moved == pytest.approx(two.bias_px - one.bias_px, abs=0.1 * np.sqrt(two.variance_px2))
    assert abs(two.bias_px - one.bias_px) > 0.2 * np.sqrt(two.variance_px2)  # of which it is no small part


def test_cos4_is_natural_vignetting(task1):
    """cos^4 of the angle from the axis."""
    some = task1.with_(camera={"natural_vignetting": True}).camera
    x, y = some.width - 1, some.height - 1
    away = np.hypot(x / 2, y / 2) / some.focal_px
    assert illumination(some, x, y) == pytest.approx(np.cos(np.arctan(away)) ** 4, rel=1e-12)
    with pytest.raises(InvalidInput, match="natural_vignetting must be left out of a telecentric camera"):
        scenes.load("telecentric_plate").with_(camera={"natural_vignetting": True})


def test_each_edge_is_as_uncertain_as_its_own_blur_makes_it(rng):
    """Where a corner of the field is blurred, the told variance is that of many images, and not that of the middle."""
    scene = field_blur.scene().with_(camera={"width": 640, "height": 480})
    picture = field_blur.picture_at(scene, (210.0, 150.0), np.random.default_rng(3))
    clean = render.image(picture)
    images = render.expose(clean, scene.noise, rng, 150)
    found = measure.measure(images, picture, estimator="gradient")
    told, blind = (measure.propagate(clean, each, estimator="gradient").measurands
                   for each in (picture, field_blur.unaware(picture)))  # fmt: skip
    predicted = [each.variance_object for each in planner.predict(picture).measurands]
    ignoring = [each.variance_object for each in planner.predict(field_blur.unaware(picture)).measurands]
    m = found.names.index("bore")
    seen = found.value[:, m].var(ddof=1)
    spread = 4 * np.sqrt(2 / 149)  # margin: 4 standard errors
    assert seen / told.covariance[m, m] == pytest.approx(1, abs=spread)
    assert seen / predicted[m] == pytest.approx(1, abs=spread + 0.1)
    assert seen / ignoring[m] > 1 + 2 * spread
    off = (np.array([told.value[m], blind.value[m]]) - 4.0) / np.sqrt(told.covariance[m, m])
    assert abs(off[0]) < 0.5
    assert abs(off[1]) > 2


def test_a_field_s_number_is_an_input(task1):
    scene = task1.with_(camera={"blur_field": {"polynomial": [{"value": 1.0, "sd": 0.1}]}})
    (one,) = (each for each in sources(scene) if "blur_field" in each.name)
    assert (one.name, one.value, one.told.u, one.kind) == ("camera.blur_field.polynomial[0]", 1.0, 0.1, "brightness")
    assert Pictures.of(Picture.of(with_number(scene, one.name, 1.5), (30, 90))).scene.camera.most_blur_px == 1.5


def square(middle, half, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    around = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    return np.array(middle) + around @ np.array([[c, s], [-s, c]])


@lru_cache
def squares():
    """A photograph without noise of slanted squares all over a field, and their corners."""
    some = camera(320, 240)
    polygons = [square((40 + 79 * i, 40 + 79 * j), 27, 6 + 7 * ((i + 2 * j) % 4)) for i in range(4) for j in range(3)]
    return some, 40 + 150 * blur_and_bin(filled(polygons, 320, 240), some, K, (0, 0)), polygons


def test_a_field_is_found_from_slanted_edges(rng):
    """Within 4 standard uncertainties, which are below 2 %; of half of them the middle's blur alone would be 10 off."""
    some, clean, polygons = squares()
    photo = Photograph(clean + 1.5 * rng.standard_normal(clean.shape))
    found = fitted_field(blurred_sides(photo, polygons), clean.shape)
    true = [0.6, *(some.blur_field.times(np.array([h for h, _ in found.field.table]) ** 2))]
    got = np.array([found.blur_px, *(times for _, times in found.field.table)])
    assert (np.abs(got - true) < 4 * found.sd + 2e-3).all()
    assert (found.sd < 0.02 * got).all()
    assert found.p_value > 1e-4
    assert (got[1:] - 1 > 5 * found.sd[1:]).all()  # negative control: an even blur is refused


def test_a_fitted_scene_says_its_blur_once(tmp_path):
    """Of a transfer only how it varies is left, beside the ``blur_px`` that was fitted."""
    file = tmp_path / "own.toml"
    told = Path(scenes.find("task1")).read_text().replace("blur_px = 0.6\n", "pixel_pitch_um = 5.0\n")
    field = "\n[camera.blur_field]\nmtf = [[0.0, 0.5], [1.0, 0.25]]\nlp_per_mm = 60\n"
    file.write_text(told + field)
    scene = scenes.load(str(file))
    fitted = scene.tried(camera=scene.camera.tried(blur_px=0.7))
    found = fitted_scene.write(SimpleNamespace(scene=fitted, status="ok"), str(file), tmp_path / "fitted.toml")
    assert found.camera.blur_px == 0.7
    assert found.camera.most_blur_px == pytest.approx(0.7 * np.sqrt(2))


def test_sides_that_do_not_tell_a_field_are_refused():
    ends = np.array([[[5.0, 5.0], [40.0, 9.0]]] * 8)
    with pytest.raises(InvalidInput, match="at least 6 sides that tell their blur, got 0"):
        fitted_field(BlurredSides(np.zeros((0, 2, 2)), np.zeros(0), np.zeros(0)), (240, 320))
    with pytest.raises(InvalidInput, match="sides from its middle outwards, got some at"):
        fitted_field(BlurredSides(ends, np.ones(8), np.full(8, 0.01)), (240, 320))


def test_the_command_writes_a_scene_s_keys(tmp_path, rng):
    some, clean, _ = squares()
    file, keys = tmp_path / "page.png", tmp_path / "field.toml"
    cv2.imwrite(str(file), np.rint(clean + 1.5 * rng.standard_normal(clean.shape)).astype(np.uint8))
    asked = ("measure", file, "--all", "--kind", "quadrilateral", "--gamma", "none", "--blur-field", keys)
    told = json.loads(ice(*asked, "--json").stdout)["blur_field"]
    assert told["blur_px"] == pytest.approx(some.blur_px, rel=0.05)
    assert len(told["sides"]) >= 40
    keys_said = tomllib.loads(keys.read_text())["camera"]
    scene = scenes.load("task1").with_(camera=keys_said)
    assert scene.camera.blur_px == pytest.approx(told["blur_px"], abs=1e-5)
    assert [each.key for each in scene.uncertain] == [
        "camera.blur_px", *(f"camera.blur_field.table[{i}][1]" for i in range(3)),
    ]  # fmt: skip
    refused = ice("measure", file, "--kind", "circle", "--blur-field", keys)
    assert refused.returncode == 2
    assert "--kind must hold quadrilateral or tag with --blur-field, got circle" in refused.stderr
