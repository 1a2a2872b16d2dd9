"""One scene without any symmetry: each number by a formula written out here, and what must not change when it is told
in another unit, turned, made brighter, or when its parts are listed in another order."""

import math
from itertools import product

import cv2
import numpy as np
import pytest

import measure
import planner
import render
import scenes
from imaging.geometry.blur import blur_at
from imaging.geometry.lens import recorded, undistorted
from imaging.geometry.projection import edge_points, project
from imaging.light.edge_sides import edge_contrast, side_signals
from imaging.pictures import Pictures
from planner.budgeting.budgets import budget
from render.fine import defocus
from tests.oracle import axes, torrance_sparrow

FULL = 1023  # of ten bits
SENSOR, LIGHTS = (33.0, 312.0), ((24.0, 250.0), (41.0, 355.0))
_SCENE = """
units = "{unit}"
object = {{ kind = "block", size = [{f}12.5, {f}7.5, {f}2.5] }}
material = {{ specular_fraction = 0.15, diffuse_reflectance = 0.8, refractive_index = 1.5, roughness = 0.3 }}

[camera]
width = 300
height = 220
focal_px = 900.0
distance = {f}110.0
blur_px = 0.7
exposure = 520.0
look_at = [{f}6.0, {f}3.0, {f}1.5]
roll_deg = 17.0
lens = {{ distortion = [-2.0, 1.0, 0.02, -0.015, 0.5], aperture_radius = {f}0.6, focus = {f}104.0 }}

[[lights]]
distance = {f}120.0
intensity = 0.7

[[lights]]
distance = {f}85.0
intensity = 0.4

[noise]
dark_level = 40.0
sigma = 3.0
bits = 10
gain = 0.12
prnu = 0.004
dsnu = 0.9

[jitter]
sensor_deg = 0.05
light_deg = 0.1

[uncertainty]
sensor_distance = {f}0.05
sensor_deg = {{ half_width = 0.04 }}
light_deg = 0.5
part_shift = {f}0.004
part_tilt_deg = 0.03
process_sd = {f}0.002

[[measurands]]
name = "long"
kind = "distance"
features = [{{ vertex = "v3", edges = ["e4", "e9"] }}, {{ vertex = "v6", edges = ["e7", "e11"] }}]
nominal = {f}14.59
tolerance = {{ plus = {f}0.03, minus = {f}0.01 }}

[[measurands]]
name = "across"
kind = "width"
features = [{{ edge = "e9" }}, {{ edge = "e11" }}]
tolerance = {{ plus = {f}0.005, minus = {f}0.02 }}

[[measurands]]
name = "square"
kind = "angle"
features = [{{ edge = "e9" }}, {{ edge = "e4" }}]
nominal = 90.0
tolerance = {{ plus = 0.1, minus = 0.3 }}

[[settings]]
sensor = [33.0, 312.0]
light = [[24.0, 250.0], [41.0, 355.0]]
"""


def _load(directory, unit="cm", factor=1.0):
    text = "".join(
        part if i == 0 else f"{factor * float(_number(part))!r}{part[len(_number(part)) :]}"
        for i, part in enumerate(_SCENE.replace("{f}", "\0").split("\0"))
    )
    path = directory / f"uneven_{unit}.toml"
    path.write_text(text.replace("{unit}", unit).replace("{{", "{").replace("}}", "}"))
    return scenes.load(path)


def _number(text):
    return text[: next(i for i, c in enumerate(text) if c not in "0123456789.")]


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return _load(tmp_path_factory.mktemp("uneven"))


@pytest.fixture(scope="module")
def picture(scene):
    return scenes.Picture.of(scene, SENSOR, LIGHTS)


def changed(scene, **parts):
    update = {k: getattr(scene, k).model_copy(update=v) if isinstance(v, dict) else v for k, v in parts.items()}
    return scene.model_copy(update=update)


def numbers(found):
    """Of a prediction: value, variance and bias of each measurand in object and image."""
    keys = ("value_object", "value_image", "variance_object", "variance_image", "bias_object", "bias_image")
    return np.array([[getattr(each, key) for key in keys] for each in found.measurands])


# --- by hand


def in_opencv(scene):
    """Turn, place, matrix and coefficients of the camera for OpenCV: x right, y down, z ahead."""
    camera, (out, right, down) = scene.camera, axes(SENSOR)
    turn = math.radians(camera.roll_deg)
    rows = [math.cos(turn) * right + math.sin(turn) * down, math.cos(turn) * down - math.sin(turn) * right, -out]
    eye = np.array(camera.look_at) + camera.distance * out
    f = camera.focal_px
    matrix = np.array([[f, 0, (camera.width - 1) / 2], [0, f, (camera.height - 1) / 2], [0, 0, 1.0]])
    return np.array(rows), -np.array(rows) @ eye, matrix, np.array(camera.lens.distortion), eye


def test_points_are_where_opencv_projects_them(scene):
    rows, place, matrix, coefficients, _ = in_opencv(scene)
    points = scene.solid.vertices
    theirs = cv2.projectPoints(points, cv2.Rodrigues(rows)[0], place, matrix, coefficients)[0][:, 0]
    ours = project(points, np.array(SENSOR), scene.camera)
    assert ours == pytest.approx(theirs, abs=1e-8)
    assert np.ptp(theirs, axis=0)[0] > 60  # margin: the scene is large in the picture, in its own numbers
    back = undistorted(theirs, scene.camera)
    pinhole = cv2.projectPoints(points, cv2.Rodrigues(rows)[0], place, matrix, None)[0][:, 0]
    assert back == pytest.approx(pinhole, abs=1e-8)
    assert np.abs(recorded(pinhole, scene.camera) - pinhole).max() > 0.5  # margin: the lens bends, in its own numbers


def by_hand(scene, points, normal):
    """Grey levels above darkness of points of a face that is seen: both lights by the paper's formula."""
    eye, total = in_opencv(scene)[4], 0.0
    gloss, to_eye = torrance_sparrow(scene.material), in_opencv(scene)[4] - points
    to_eye = to_eye / np.linalg.norm(to_eye, axis=1, keepdims=True)
    assert eye is not None
    for light, pose in zip(scene.lights, LIGHTS, strict=True):
        way = np.array(scene.camera.look_at) + light.distance * axes(pose)[0] - points
        far = np.linalg.norm(way, axis=1)
        strength = scene.camera.exposure * light.intensity * (light.distance / far) ** 2
        total = total + strength * gloss(normal, way / far[:, None], to_eye)
    return total


def seen_faces(scene):
    """Normals of the faces that the sensor sees, by number."""
    solid, eye = scene.solid, in_opencv(scene)[4]
    return [f for f, face in enumerate(solid.faces) if (eye - solid.vertices[face[0]]) @ solid.normals[f] > 0]


def test_levels_beside_each_edge_are_those_of_the_formula(scene, picture):
    """Both sides, both lights, with gloss and fall-off; and what noise and the sensor make of them."""
    fractions = np.array([0.05, 0.4, 0.9])
    names = tuple(edge.name for edge in scene.solid.edges)
    found = side_signals(Pictures.of(picture), names, edge_points(scene.solid, names, fractions))
    seen, checked = seen_faces(scene), 0
    for i, edge in enumerate(scene.solid.edges):
        ends = scene.solid.vertices[list(edge.ends)]
        points = ends[0] + fractions[:, None] * (ends[1] - ends[0])
        wanted = np.array([
            by_hand(scene, points, scene.solid.normals[f]) if f in seen else np.zeros(3) for f in edge.faces
        ])  # fmt: skip
        assert found[i] == pytest.approx(wanted, rel=1e-9, abs=1e-9)
        contrast = edge_contrast(Pictures.of(picture), (edge.name,), fractions)
        assert (contrast.squared[0] == pytest.approx((wanted[0] - wanted[1]) ** 2, rel=1e-9)) or wanted.max() > 800
        variance = (9.0 + 1 / 12 + 0.12 * wanted).mean(0)
        assert np.broadcast_to(contrast.noise_variance, (1, 3))[0] == pytest.approx(variance, rel=1e-9)
        checked += len(set(edge.faces) & set(seen))
    assert checked == 12  # three faces of four edges


def test_the_picture_by_the_planner_is_that_of_the_formula(scene):
    """Away from edges each pixel by the ray through it, the lens undone by OpenCV; a grey level of a few hundred."""
    sharp = changed(scene, camera={"lens": scenes.Lens(distortion=scene.camera.lens.distortion)})
    image = planner.image(sharp, SENSOR, LIGHTS)
    assert image.shape == (220, 300)
    rows, _, matrix, coefficients, eye = in_opencv(scene)
    solid, checked = scene.solid, 0
    corners = project(solid.vertices, np.array(SENSOR), sharp.camera)
    y, x = np.mgrid[2:218:5, 2:298:7]
    pixels = np.stack([x.ravel(), y.ravel()], 1).astype(float)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-13)
    rays = cv2.undistortPoints(pixels[:, None], matrix, coefficients, None, None, None, criteria)[:, 0]
    ways = np.column_stack([rays, np.ones(len(rays))]) @ rows
    left = np.ones(len(pixels), bool)
    for f in seen_faces(scene):
        outline = corners[list(solid.faces[f])].astype(np.float32)[:, None]
        inside = np.array([cv2.pointPolygonTest(outline, tuple(p), True) for p in pixels])
        left &= inside < -9
        some = inside > 6
        points = eye + ways[some] * ((solid.vertices[solid.faces[f][0]] - eye) @ solid.normals[f]
                                     / (ways[some] @ solid.normals[f]))[:, None]  # fmt: skip
        wanted = scene.noise.dark_level + by_hand(scene, points, solid.normals[f])
        assert image[y.ravel()[some], x.ravel()[some]] == pytest.approx(wanted, rel=2e-3, abs=0.05)
        checked += some.sum()
    assert image[y.ravel()[left], x.ravel()[left]] == pytest.approx(40.0, abs=1e-4)
    assert checked > 60


def test_defocus_is_that_of_each_edge_s_depth(scene):
    """A uniform disc of the marginal ray's radius has a quarter of its square as variance in each direction."""
    lens, camera = scene.camera.lens, scene.camera
    for depth in (101.0, 110.0, 118.0):
        radius = lens.aperture_radius * abs(depth - lens.focus) / depth * camera.focal_px / lens.focus
        found = float(blur_at(camera, np.array(depth), np.zeros(2)))
        assert found == pytest.approx(math.hypot(0.7, radius / 2), rel=1e-12)


def test_a_render_reaches_as_far_as_the_corner_that_is_least_in_focus(scene, picture):
    """Its circle of confusion, by the marginal ray; corners lie at both sides of the plane in focus, or beyond it."""
    lens = scene.camera.lens
    out, _, _ = axes(SENSOR)
    depths = scene.camera.distance - (scene.solid.vertices - np.array(scene.camera.look_at)) @ out
    radii = lens.aperture_radius * np.abs(depths - lens.focus) / depths * scene.camera.focal_px / lens.focus
    assert defocus(picture) == pytest.approx(radii.max(), rel=1e-9)
    assert radii.max() > 1.2 * radii.min()


def test_predicted_variances_are_those_of_points(scene, picture):
    """Edge points up to 2 scales apart, their covariance matrix, least squares, and the measurands' differences."""
    flat = changed(scene, camera={"lens": scenes.Lens()})
    pictures = Pictures.of(flat, SENSOR, LIGHTS)
    view = planner.projected_edges(pictures)
    scale = flat.locator.scale_px
    width2 = scale**2 + 0.7**2 + 1 / 12
    cubic = (4 * np.exp(-0.125 / width2) - np.exp(-0.5 / width2)) / 3  # its slope at a place of the profile
    kappa = 3 / 8 * (width2 / scale**2) ** 3 / cubic**2
    scatter, lines = np.zeros((2 * len(view.names),) * 2), []
    for i, name in enumerate(view.names):
        start, stop = view.ends[i]
        length = np.linalg.norm(stop - start)
        along = (stop - start) / length
        low, high = view.framed[i, 0], length - view.framed[i, 1]
        s = np.linspace(low, high, max(9, math.ceil((high - low) / (2 * scale)) + 1))
        ends = flat.solid.vertices[list(flat.solid.edge(name).ends)]
        fine = np.linspace(0, 1, 4001)
        at = project(ends[0] + fine[:, None] * (ends[1] - ends[0]), np.array(SENSOR), flat.camera)
        fraction = np.interp(s, (at - start) @ along, fine)
        points = ends[0] + fraction[:, None] * (ends[1] - ends[0])
        seen = seen_faces(flat)
        faces = flat.solid.edge(name).faces
        sides = [by_hand(flat, points, flat.solid.normals[f]) if f in seen else np.zeros(len(s)) for f in faces]
        noise = 9 + 1 / 12 + 0.12 * (sides[0] + sides[1]) / 2
        sigma = np.sqrt(kappa * noise) / np.abs(sides[0] - sides[1])
        covariance = np.outer(sigma, sigma) * np.exp(-((s[:, None] - s) ** 2) / (4 * scale**2))
        design, counted = np.column_stack([np.ones(len(s)), s]), np.ones(len(s))
        counted[[0, -1]] = 0.5
        weights = np.linalg.inv(design.T @ (counted[:, None] * design)) @ (counted[:, None] * design).T
        scatter[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = weights @ covariance @ weights.T
        lines.append((start, along, np.array([-along[1], along[0]])))

    def measured(errors):
        moved = []
        for (start, along, normal), (offset, tilt) in zip(lines, errors.reshape(-1, 2), strict=True):
            moved.append((start + offset * normal, along + tilt * normal))
        by = dict(zip(view.names, moved, strict=True))
        corners = [_meet(by["e4"], by["e9"]), _meet(by["e7"], by["e11"])]
        turn = [math.atan2(by[name][1][1], by[name][1][0]) for name in ("e9", "e4")]
        return np.array([np.linalg.norm(corners[1] - corners[0]), math.degrees(abs(turn[0] - turn[1]))])

    step, zero = 1e-5, np.zeros(scatter.shape[0])
    slope = np.array([(measured(zero + e) - measured(zero - e)) / (2 * step) for e in step * np.eye(zero.size)])
    wanted = np.einsum("ia,ij,ja->a", slope, scatter, slope)
    told = planner.predict(flat, SENSOR, LIGHTS).measurands
    assert [told[0].variance_image, told[2].variance_image] == pytest.approx(wanted, rel=0.02)
    assert told[0].value_image == pytest.approx(measured(zero)[0], rel=1e-9)
    assert told[2].value_image in (pytest.approx(measured(zero)[1]), pytest.approx(180 - measured(zero)[1]),
                                   pytest.approx(360 - measured(zero)[1]))  # fmt: skip


def _meet(one, two):
    (p, d), (q, e) = one, two
    t = np.linalg.solve(np.column_stack([d, -e]), q - p)[0]
    return p + t * d


def test_values_in_the_object_are_those_of_its_corners(scene, picture):
    """The block's own lengths, whatever the picture; nominal values and ratios with the zones' halves."""
    told = planner.predict(picture).measurands
    ends = [scene.solid.vertex(name) for name in ("v3", "v6")]
    assert told[0].value_object == pytest.approx(np.linalg.norm(ends[1] - ends[0]), rel=1e-9)
    assert [each.nominal for each in told] == pytest.approx([14.59, told[1].value_object, 90.0])
    assert told[2].value_object == pytest.approx(90.0, abs=1e-9)
    half = (0.02, 0.0125, 0.2)
    for each, zone in zip(told, half, strict=True):
        assert each.ratio == pytest.approx(math.sqrt(each.variance_object) / zone)


def test_the_first_measurand_s_numbers_are_under_its_names(scene, picture):
    """Shortcuts of predictions, measurements and propagated noise; image and object are not alike here."""
    for model in ("paper", "calibrated", "bound"):
        found = planner.predict(picture, model=model)
        first = found.measurands[0]
        for name in ("value_image", "value_object", "variance_image", "variance_object"):
            assert getattr(found, name) == getattr(first, name)
        assert found.bias_image == pytest.approx(first.bias_image, nan_ok=True)
        assert (found.value_px, found.variance_px2) == (first.value_image, first.variance_image)
        assert found.variance_cm2 == pytest.approx(first.variance_object)
        near = 0.1 if model == "bound" else 1e-9  # which is joint, its covariances are line by line
        diagonal = np.diag(found.covariance), np.diag(found.covariance_object)
        # margin: which is joint: 3.4 % off at most
        assert diagonal[0] == pytest.approx([each.variance_image for each in found.measurands], rel=near)
        # margin: which is joint: 4.4 % off at most
        assert diagonal[1] == pytest.approx([each.variance_object for each in found.measurands], rel=near)
        ratios = {each.name: each.ratio for each in found.measurands}
        assert (found.limiting, found.worst_ratio) == (max(ratios, key=ratios.get), max(ratios.values()))
    plain = changed(scene, camera={"lens": scenes.Lens()})
    image = planner.image(plain, SENSOR, LIGHTS)
    spread = measure.propagate(image, plain, SENSOR, LIGHTS, "gradient")
    told = spread.measurands
    assert spread.variance_px2 == pytest.approx(told.covariance_image[0, 0])
    assert spread.variance_px2 == pytest.approx(planner.predict(plain, SENSOR, LIGHTS).variance_px2, rel=0.1)
    assert (spread.value_px, spread.bias_px) == (told.value_image[0], told.bias_image[0])
    assert told.value[0] == pytest.approx(math.hypot(12.5, 7.5), abs=0.01)
    found, each = (f(image, plain, SENSOR, LIGHTS, "gradient") for f in (measure.distance, measure.measure))
    assert float(found.value_px) == pytest.approx(float(each.value_image[0]), rel=1e-12)
    assert float(found.variance_px2) == pytest.approx(float(each.covariance_image[0, 0]), rel=1e-6)
    assert np.linalg.norm(found.corners[1] - found.corners[0]) == pytest.approx(float(found.value_px), rel=1e-9)


def test_a_fixed_pattern_matters_as_much_as_noise_of_its_size(scene):
    """Four standard deviations of the distance under noise of dsnu alone; twice as much of twice the pattern."""
    near = []
    for dsnu in (1.0, 2.0):
        uneven = changed(scene, noise={"prnu": 0.0, "dsnu": dsnu})
        (found,) = (e for e in render.effects(uneven) if e.effect.name == "fixed_pattern")
        noisy = changed(scene, noise={"sigma": dsnu, "bits": None, "gain": 0.0, "prnu": 0.0, "dsnu": 0.0})
        near.append(found.influence.bias_px)
        assert near[-1] == pytest.approx(4 * planner.predict(noisy, SENSOR, LIGHTS).variance_px2 ** 0.5, rel=0.02)
    assert near[1] == pytest.approx(2 * near[0], rel=1e-3)


# --- what must not change


@pytest.mark.parametrize(("unit", "factor"), [("mm", 10.0), ("m", 0.01)])
def test_another_unit_changes_lengths_and_nothing_else(scene, tmp_path, unit, factor):
    """Predictions by each model, budget, jitter, maps and plan; angles stay, variances go with the square."""
    other = _load(tmp_path, unit, factor)
    lengths = np.array([[factor, 1, factor**2, 1, factor, 1], [factor, 1, factor**2, 1, factor, 1], [1] * 6])
    for model in ("paper", "calibrated", "bound"):
        one, two = (planner.predict(s, SENSOR, LIGHTS, model) for s in (scene, other))
        assert numbers(two) == pytest.approx(lengths * numbers(one), rel=1e-7, abs=1e-12, nan_ok=True)
        assert [m.ratio for m in two.measurands] == pytest.approx([m.ratio for m in one.measurands], rel=1e-7)
        assert [m.unit for m in two.measurands] == [unit, unit, "degrees"]
    one, two = (budget(s, SENSOR, LIGHTS) for s in (scene, other))
    scale = np.array([factor, factor, 1])
    for attribute in ("U", "u", "value", "repeatability", "accuracy"):
        assert [getattr(b, attribute) for b in two] == pytest.approx(
            scale * [getattr(b, attribute) for b in one], rel=2e-4
        )
    for a, b in zip(one, two, strict=True):
        assert {c.source: c.share for c in a.contributions} == pytest.approx(
            {c.source: c.share for c in b.contributions}, abs=2e-4
        )
        assert b.k == pytest.approx(a.k)
    one, two = (planner.pose_scatter(s, np.array([SENSOR])) for s in (scene, other))
    assert two.covariance == pytest.approx(one.covariance, rel=1e-4, abs=1e-12)
    assert two.covariance_object == pytest.approx(one.covariance_object * np.outer(scale, scale), rel=1e-4, abs=1e-9)
    one, two = (render.effects(s) for s in (scene, other))
    for a, b in zip(one, two, strict=True):
        assert (a.effect.name, a.on) == (b.effect.name, b.on)
        assert tuple(b.influence) == pytest.approx(tuple(a.influence), rel=1e-5, abs=1e-12)


def test_a_sensor_turned_by_a_right_angle_has_columns_for_rows(scene):
    """Roll 90 degrees more, width and height exchanged, the lens' tangential terms turned: the picture is turned."""
    k1, k2, p1, p2, k3 = scene.camera.lens.distortion
    turned = changed(scene, camera={
        "width": 220, "height": 300, "roll_deg": 107.0,
        "lens": scene.camera.lens.model_copy(update={"distortion": (k1, k2, -p2, p1, k3)}),
    })  # fmt: skip
    for model in ("paper", "calibrated", "bound"):
        one, two = (planner.predict(s, SENSOR, LIGHTS, model) for s in (scene, turned))
        limit = 2e-3 if model == "bound" else 1e-6
        assert numbers(two)[:, :4] == pytest.approx(numbers(one)[:, :4], rel=limit)
        assert numbers(two)[:, 4:] == pytest.approx(numbers(one)[:, 4:], rel=1e-3, abs=1e-9, nan_ok=True)
    plain = [changed(s, camera={"lens": scenes.Lens(distortion=s.camera.lens.distortion)}) for s in (scene, turned)]
    one, two = (planner.image(s, SENSOR, LIGHTS) for s in plain)
    assert np.rot90(one) == pytest.approx(two, abs=1e-4)
    values = []
    for s, image in zip(plain, (one, two), strict=True):
        found = measure.measure(image, s, SENSOR, LIGHTS, "gradient")
        spread = measure.propagate(image, s, SENSOR, LIGHTS, "gradient").measurands
        values.append([*np.ravel(found.value), *np.ravel(found.value_image), *np.diag(spread.covariance)])
    assert np.isfinite(values).all()
    assert values[1] == pytest.approx(values[0], rel=1e-5)


@pytest.fixture(scope="module")
def doubled(scene):
    """The scene and one of twice the grey levels, darkness and noise of every kind, and two noisy pictures of each."""
    plain = changed(scene, camera={"lens": scenes.Lens()}, noise={"bits": None, "prnu": 0.0, "dsnu": 0.0})
    double = changed(plain, camera={"exposure": 1040.0}, noise={"sigma": 6.0, "gain": 0.24, "dark_level": 80.0})
    one, two = (planner.image(s, SENSOR, LIGHTS) for s in (plain, double))
    assert two == pytest.approx(2 * one, rel=1e-9)
    noisy = [render.expose(i, s.noise, np.random.default_rng(5), 2) for i, s in ((one, plain), (two, double))]
    assert noisy[1] == pytest.approx(2 * noisy[0], rel=1e-6)
    return (plain, noisy[0]), (double, noisy[1])


@pytest.mark.parametrize("estimator", ["gradient", "isophote", "strip", "arrangement"])
def test_twice_the_light_and_the_noise_is_the_same_measurement(doubled, estimator):
    found = [measure.measure(i, s, SENSOR, LIGHTS, estimator) for s, i in doubled]
    assert np.isfinite(found[0].value).all()
    assert found[1].value == pytest.approx(found[0].value, rel=1e-5)
    assert found[1].sigma == pytest.approx(found[0].sigma, rel=1e-4)


def test_twice_the_light_and_the_noise_is_the_same_prediction(doubled):
    told = [numbers(planner.predict(s, SENSOR, LIGHTS)) for s, _ in doubled]
    assert told[1] == pytest.approx(told[0], rel=1e-9)


def test_the_order_of_lights_does_not_matter(scene):
    """Two unlike lights, their poses with them: pictures, predictions, budgets, maps of the one and the other."""
    other = scene.lit_by(*scene.lights[::-1])
    back = LIGHTS[::-1]
    for model in ("paper", "calibrated", "bound"):
        one, two = planner.predict(scene, SENSOR, LIGHTS, model), planner.predict(other, SENSOR, back, model)
        assert numbers(two) == pytest.approx(numbers(one), rel=1e-6, abs=1e-12, nan_ok=True)
    one, two = budget(scene, SENSOR, LIGHTS), budget(other, SENSOR, back)
    assert [b.U for b in two] == pytest.approx([b.U for b in one], rel=1e-6)
    plain = [changed(s, camera={"lens": scenes.Lens()}) for s in (scene, other)]
    one, two = planner.image(plain[0], SENSOR, LIGHTS), planner.image(plain[1], SENSOR, back)
    assert two == pytest.approx(one, rel=1e-9)
    around = np.array([[p, a] for p in (10.0, 40.0) for a in (0.0, 130.0, 260.0)])
    first = planner.variances(scene, SENSOR, (around, np.array(LIGHTS[1])))
    second = planner.variances(other, SENSOR, (np.array(LIGHTS[1]), around))
    assert second == pytest.approx(first, rel=1e-9)
    assert np.ptp(first[np.isfinite(first)]) > 0
    swapped = planner.variances(other, SENSOR, (around, np.array(LIGHTS[1])))
    assert not np.allclose(swapped, first)


def test_the_order_of_measurands_does_not_matter(scene):
    """Predictions, joint covariances, budgets, measured and propagated values go with their measurands."""
    order = [2, 0, 1]
    other = scene.model_copy(update={"measurands": tuple(scene.measurands[k] for k in order)})
    plain = [changed(s, camera={"lens": scenes.Lens()}) for s in (scene, other)]
    one, two = (planner.predict(s, SENSOR, LIGHTS) for s in plain)
    assert numbers(two) == pytest.approx(numbers(one)[order], rel=1e-9)
    assert two.covariance_object == pytest.approx(one.covariance_object[np.ix_(order, order)], rel=1e-9, abs=1e-15)
    assert two.worst_ratio == pytest.approx(one.worst_ratio)
    image = planner.image(plain[0], SENSOR, LIGHTS)
    noisy = render.expose(image, scene.noise, np.random.default_rng(5), 2)
    one, two = (measure.measure(noisy, s, SENSOR, LIGHTS, "gradient") for s in plain)
    assert two.value == pytest.approx(one.value[:, order], rel=1e-9)
    assert two.value_image == pytest.approx(one.value_image[:, order], rel=1e-9)
    ordered = one.covariance[:, order][:, :, order]
    assert two.covariance == pytest.approx(ordered, rel=1e-6, abs=1e-15)
    one, two = (measure.propagate(image, s, SENSOR, LIGHTS, "gradient").measurands for s in plain)
    assert two.covariance == pytest.approx(one.covariance[np.ix_(order, order)], rel=1e-6, abs=1e-15)
    assert two.bias == pytest.approx(np.array(one.bias)[order], rel=1e-6, abs=1e-9)
    one, two = (budget(s, SENSOR, LIGHTS) for s in (scene, other))
    assert [b.U for b in two] == pytest.approx([one.measurands[k].U for k in order], rel=1e-9)


def test_many_poses_at_once_are_those_one_by_one(scene):
    """Unequal numbers of sensors and lights, of one and the other light."""
    sensors = np.array([[20.0, 310.0], [33.0, 312.0], [45.0, 250.0]])
    lights = np.array([[24.0, 250.0], [35.0, 100.0]]), np.array([41.0, 355.0])
    for model in ("paper", "calibrated"):
        table = planner.variances(scene, sensors[:, None], (lights[0][None], lights[1]), model)
        assert table.shape == (3, 2)
        for i, j in product(range(3), range(2)):
            each = planner.variances(scene, sensors[i], (lights[0][j], lights[1]), model)
            assert table[i, j] == pytest.approx(float(each), rel=1e-9)


def test_measured_scatter_is_what_is_told(scene):
    """300 pictures of the model's: each measurand's variance in object and image, and their covariances.

    By the limits of a correlation and a chi-square; twice as much is rejected.
    """
    plain = changed(scene, camera={"lens": scenes.Lens()}, noise={"prnu": 0.0, "dsnu": 0.0})
    clean = planner.image(plain, SENSOR, LIGHTS)
    where = measure.region_of_interest(scenes.Picture.of(plain, SENSOR, LIGHTS))
    found = measure.measure(
        render.expose(clean, plain.noise, np.random.default_rng(2), 300, where), plain, SENSOR, LIGHTS, "gradient"
    )
    told = planner.predict(plain, SENSOR, LIGHTS)
    for values, covariance in (
        (found.value, told.covariance_object),
        (found.value_image, np.diag([each.variance_image for each in told.measurands])),
    ):
        assert np.isfinite(values).all()
        ratio = values.var(0, ddof=1) / np.diag(covariance)
        # margin: chance: 4 standard errors of 300 images and 5 %
        assert (np.abs(ratio - 1) < 4 * math.sqrt(2 / 299) + 0.05).all()
        # margin: chance: a variance twice as large is 3.5 standard errors and 5 % beyond
        assert not (np.abs(ratio / 2 - 1) < 4 * math.sqrt(2 / 299) + 0.05).any()
    rho = told.covariance_object / np.sqrt(np.outer(*[np.diag(told.covariance_object)] * 2))
    assert np.abs(np.corrcoef(found.value.T) - rho).max() < 4 / math.sqrt(299) + 0.05
    small = 0.05 * np.diag(told.covariance_object).min()
    assert found.covariance.mean(0) == pytest.approx(told.covariance_object, rel=0.15, abs=small)
