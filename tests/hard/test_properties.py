"""What must hold for every scene and pose: no NaN, no negative variance, no warning, and the invariances."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

import planner
from measure import ESTIMATORS
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from measure.features.shape import find_shape
from scenes import InvalidInput, Task
from scenes.parts.solid import Solid
from validation.hard.polygon import polygon_image
from validation.hard.scenes_for import task1, with_solid

RELATIVE = 1e-10
PRICES = ("paper", "calibrated", "bound")
few = settings(max_examples=25, derandomize=True, deadline=None)


def log(low, high):
    """Numbers spread over decades."""
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


poses = st.tuples(st.floats(0, 180), st.floats(-720, 720))
upper = st.tuples(st.floats(3, 80), st.floats(0, 360))
sizes = st.lists(log(-2, 1.5), min_size=3, max_size=3)
materials = st.fixed_dictionaries({
    "specular_fraction": st.floats(0, 1), "diffuse_reflectance": st.floats(0, 1), "refractive_index": log(-1, 2),
    "extinction": st.one_of(st.just(0.0), log(-6, 2)), "roughness": log(-3, 0.3),
})  # fmt: skip
diffuse = st.just({"refractive_index": 1.0, "extinction": 0.0})
gloss = {"specular_fraction": 0.97, "diffuse_reflectance": 0.25, "refractive_index": 1.0, "extinction": 0.0}


def predicted(scene, sensor, light, model):
    """Variance in both units, and the status."""
    found = planner.predict(scene, sensor, light, model)
    return np.array([found.variance_px2, found.variance_cm2]), found.status


@few
@given(sizes, poses, poses, materials, log(-6, 6), log(-3, 3), st.sampled_from(PRICES))
@example([1.0, 1.0, 1.0], (0.0, 0.0), (0.0, 0.0), gloss, 1e-4, 1.0, "bound")  # nothing tells where a corner is
def test_variance_is_positive_or_infinite_with_a_reason(size, sensor, light, material, exposure, sigma, model):
    """Any object, material, exposure, noise and pose, both poles and the lower hemisphere included."""
    scene = task1(object={"size": size}, material=material, camera={"exposure": exposure}, noise={"sigma": sigma})
    try:
        for role, pose in (("sensor", sensor), ("light", light)):
            scene.check_pose(role, pose)
    except InvalidInput:  # in or on the object
        return
    variances, status = predicted(scene, sensor, light, model)
    assert (variances > 0).all()
    assert np.isfinite(variances).all() or status != "ok"
    assert status in ("ok", "not_visible", "short", "low_contrast", "ill_conditioned")


@pytest.mark.parametrize("name", ["bracket", "wedge", "plate"])
@settings(max_examples=8, derandomize=True, deadline=None)
@given(poses, poses)
def test_the_same_for_the_solids_from_meshes(name, sensor, light):
    """A bracket with a hidden vertex, a wedge, a plate with holes."""
    import scenes

    scene = scenes.load(name)
    for model in ("paper", "calibrated"):
        found = planner.predict(scene, sensor, light, model)
        assert found.variance_image > 0
        assert np.isfinite(found.variance_image) or found.status != "ok"
        assert not np.isnan([found.variance_image, found.variance_object, found.value_object]).any()


def conditioned(scene, sensor, light, model):
    """The variances; the example is dropped where a rounding of the poses alone would show in them."""
    value, status = predicted(scene, sensor, light, model)
    nudge = 1 + 1e-9
    moved, _ = predicted(scene, [nudge * a for a in sensor], [nudge * a for a in light], model)
    finite = np.isfinite(value)
    assume((finite == np.isfinite(moved)).all())
    assume((np.abs(moved[finite] / value[finite] - 1) < 1e-6).all())
    return value, status


def same(scene, sensor, light, model, expected, status):
    value, found = predicted(scene, sensor, light, model)
    assert value == pytest.approx(expected, rel=RELATIVE, abs=0)
    assert found == status


settings_of = (upper, upper, st.one_of(diffuse, materials), st.sampled_from(PRICES))


def mirrored_block(scene):
    """The block reflected in the plane y = 0, faces turned outwards again."""
    old = scene.solid
    faces = tuple(face[::-1] for face in old.faces)
    return with_solid(scene, Solid(old.vertex_names, old.vertices * [1, -1, 1], faces, old.edges))


@few
@given(*settings_of, st.floats(0, 360))
def test_turning_everything_about_the_vertical(sensor, light, material, model, turn):
    scene = task1(material=material)
    expected = conditioned(scene, sensor, light, model)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    old = scene.solid
    turned = Solid(old.vertex_names, old.vertices @ [[c, s, 0], [-s, c, 0], [0, 0, 1]], old.faces, old.edges)
    poses = [(polar, azimuth + turn) for polar, azimuth in (sensor, light)]
    same(with_solid(scene, turned), *poses, model, *expected)


@few
@given(*settings_of)
def test_reflection(sensor, light, material, model):
    scene = task1(material=material)
    expected = conditioned(scene, sensor, light, model)
    same(mirrored_block(scene), *((polar, -azimuth) for polar, azimuth in (sensor, light)), model, *expected)


@few
@given(*settings_of, log(-6, 6))
def test_scaling_all_lengths(sensor, light, material, model, factor):
    """px^2 stay, cm^2 grow with the square."""
    scene = task1(material=material)
    expected, status = conditioned(scene, sensor, light, model)
    larger = task1(
        material=material,
        object={"size": [factor * side for side in scene.object.size]},
        camera={"distance": factor * scene.camera.distance},
        light={"distance": factor * scene.light.distance},
    )
    same(larger, sensor, light, model, expected * [1, factor**2], status)


@few
@given(*settings_of)
def test_relabelling_edges_and_swapping_the_vertices(sensor, light, material, model):
    scene = task1(material=material)
    expected = conditioned(scene, sensor, light, model)
    start, end = (c.model_copy(update={"edges": c.edges[::-1]}) for c in scene.task.corners)
    for task in (Task(start=start, end=end), Task(start=end, end=start)):
        same(scene.model_copy(update={"task": task}), sensor, light, model, *expected)
    old = scene.solid
    edges = tuple(replace(e, ends=e.ends[::-1], faces=e.faces[::-1]) for e in old.edges)
    same(with_solid(scene, Solid(old.vertex_names, old.vertices, old.faces, edges)), sensor, light, model, *expected)


@few
@given(*settings_of, log(-9, 9))
@example([3.0, 0.0], [3.0, 0.0], {"refractive_index": 1.0, "extinction": 0.0}, "bound", 1e8)
def test_scaling_intensity_and_noise_together(sensor, light, material, model, factor):
    scene = task1(material=material, noise={"bits": None})
    expected = conditioned(scene, sensor, light, model)
    camera, noise = {"exposure": factor * scene.camera.exposure}, {"sigma": factor * scene.noise.sigma, "bits": None}
    same(task1(material=material, camera=camera, noise=noise), sensor, light, model, *expected)


@few
@given(*settings_of, log(0, 6))
def test_more_light_never_increases_the_variance(sensor, light, material, model, factor):
    """As long as the sensor's scale has no end."""
    scene = task1(material=material, noise={"bits": None})
    before, _ = predicted(scene, sensor, light, model)
    brighter = task1(material=material, noise={"bits": None}, camera={"exposure": factor * scene.camera.exposure})
    after, _ = predicted(brighter, sensor, light, model)
    # margin: equality is reached where the noise is the light's own; RELATIVE is for rounding
    assert (after <= before * (1 + RELATIVE)).all()


SHAPE = (120, 120)


def corners_of(turn, x, y):
    """A convex quadrilateral of sides 40 to 60 px, px."""
    c, s = np.cos(turn), np.sin(turn)
    plain = np.array([[-27.0, -21.0], [28.0, -18.0], [24.0, 22.0], [-25.0, 19.0]])
    return plain @ [[c, s], [-s, c]] + [60.0 + x, 60.0 + y]


def flip(image, corners):
    return image[..., ::-1], corners * [-1, 1] + [SHAPE[1] - 1, 0]


def turn_by_90(image, corners):
    return np.rot90(image, axes=(-2, -1)), corners[:, ::-1] * [1, -1] + [0, SHAPE[1] - 1]


def shift(image, corners):
    return np.roll(image, (2, -3), (-2, -1)), corners + [-3, 2]


@pytest.mark.parametrize("move", [flip, turn_by_90, shift])
@pytest.mark.parametrize("estimator", ESTIMATORS)
@settings(max_examples=3, derandomize=True, deadline=None)
@given(st.floats(0.05, 1.5), st.floats(-3, 3), st.floats(-3, 3), st.integers(0, 2**32))
def test_measurement_follows_the_image(estimator, move, turn, x, y, seed):
    """Flips, quarter turns and whole-pixel shifts of a noisy image move the corners likewise.

    To 1e-9 px; arrangement, whose integrals are exact to 1e-6 of a step, to 5e-8.
    """
    corners = corners_of(turn, x, y)
    noise = np.random.default_rng(seed).standard_normal(SHAPE)
    image = polygon_image(corners, SHAPE, 0.7, 100.0, 20.0) + noise
    found = measured(image, corners, estimator)
    image, there = move(image, corners)
    moved = measured(image, there, estimator)
    assert found.status == moved.status
    assume(found.status[0] in ("ok", "clutter"))
    _, expected = move(image, found.corners[0])
    assert moved.corners[0] == pytest.approx(expected, abs=5e-8 if estimator == "arrangement" else 1e-9)


def measured(image, corners, estimator):
    optics = Optics(SHAPE, blur_px=0.7, noise_variance=1.0)
    return find_shape(np.ascontiguousarray(image)[None], polygon_layout(corners, optics), estimator)
