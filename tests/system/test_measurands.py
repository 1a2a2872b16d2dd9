"""Every kind of measurand, several in one picture: predicted, rendered, exposed, measured, on plates with holes."""

from functools import lru_cache

import numpy as np
import pytest
import trimesh
from scipy.spatial import Delaunay
from scipy.stats import chi2

import measure
import planner
import render
import scenes
from scenes import InvalidInput
from validation.statistics import sidak

pytestmark = pytest.mark.render
COUNT = 400
SENSOR, LIGHT = (30, 80), (35, 335)
QUICK = render.Quality(supersample=2, edge_samples=64)  # values 0.5 sigma off at most, as with 4 each way


def plate_with_holes(size, holes, sections=64):
    """A plate from the origin to ``size`` with round through holes (x, y, radius)."""
    turn = 2 * np.pi * np.arange(sections) / sections
    rims = [np.array([x, y]) + r * np.column_stack([np.cos(turn), np.sin(turn)]) for x, y, r in holes]
    corners = np.array([[0, 0], [size[0], 0], [size[0], size[1]], [0, size[1]]], float)
    flat = np.concatenate([corners, *rims])
    triangles = Delaunay(flat).simplices
    middle = flat[triangles].mean(1)
    keep = np.all([np.hypot(middle[:, 0] - x, middle[:, 1] - y) > 0.999 * r for x, y, r in holes], axis=0)
    triangles = triangles[keep]
    a, b, c = np.moveaxis(flat[triangles], 1, 0)
    ways = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    triangles = np.where((ways > 0)[:, None], triangles, triangles[:, ::-1])
    count, faces = len(flat), [triangles + len(flat), triangles[:, ::-1]]
    loops = [np.arange(4), *(4 + k * sections + np.arange(sections)[::-1] for k in range(len(holes)))]
    for loop in loops:
        onward = np.roll(loop, -1)
        faces += [np.stack([loop, onward, onward + count], 1), np.stack([loop, onward + count, loop + count], 1)]
    vertices = np.concatenate([np.column_stack([flat, np.full(count, z)]) for z in (0.0, size[2])])
    return trimesh.Trimesh(vertices, np.concatenate(faces))


def top_edges(solid, size):
    """Names of the four sides of the top by where they lie: front, right, back, left."""
    found = {}
    for side, (axis, value) in {"front": (1, 0), "right": (0, size[0]), "back": (1, size[1]), "left": (0, 0)}.items():
        for edge in solid.edges:
            ends = solid.vertices[list(edge.ends)]
            if np.allclose(ends[:, 2], size[2]) and np.allclose(ends[:, axis], value):
                found[side] = edge.name
    return found


@pytest.fixture(scope="module")
def two_holes(tmp_path_factory):
    """A plate of 12 x 8 x 1 with two holes, and every kind of measurand; the truth by name."""
    size, holes = (12.0, 8.0, 1.0), [(3.5, 4.0, 1.5), (8.2, 4.6, 1.8)]
    file = tmp_path_factory.mktemp("part") / "part.ply"
    plate_with_holes(size, holes).export(file)
    data = scenes.load("plate").model_dump(exclude={"measurands", "settings"})
    data["object"] = {"kind": "mesh", "file": str(file), "names": {"corner": (12.0, 8.0, 1.0)}}
    solid = scenes.Mesh.model_validate(data["object"]).solid
    upper = sorted((c for c in solid.circles if c.axis[2] > 0.5), key=lambda c: c.centre[0])
    first, second = ({"circle": circle.name} for circle in upper)
    sides = {name: {"edge": edge} for name, edge in top_edges(solid, size).items()}
    corner = {"vertex": "corner", "edges": [sides["back"]["edge"], sides["right"]["edge"]]}
    listed = [
        {"name": "hole to hole", "kind": "distance", "features": [first, second]},
        {"name": "to corner", "kind": "distance", "features": [second, corner]},
        {"name": "first bore", "kind": "diameter", "features": [first]},
        {"name": "second bore", "kind": "diameter", "features": [second]},
        {"name": "length", "kind": "width", "features": [sides["left"], sides["right"]]},
        {"name": "square", "kind": "angle", "features": [sides["back"], sides["right"]]},
        {"name": "from front", "kind": "offset", "features": [first, sides["front"]]},
        {"name": "place", "kind": "position", "features": [second, sides["right"], sides["back"]]},
    ]
    truth = [np.hypot(4.7, 0.6), np.hypot(3.8, 3.4), 3.0, 3.6, 12.0, 90.0, 4.0, 3.8, 3.4]
    return scenes.Scene.model_validate({**data, "measurands": listed}), np.array(truth)


@pytest.fixture(scope="module")
def clean(two_holes):
    return render.image(two_holes[0], SENSOR, LIGHT, QUICK)


@pytest.fixture(scope="module")
def measured(two_holes, clean):
    """The noise-free picture's prediction, and as many noisy pictures measured."""
    scene, _ = two_holes
    pictures = render.expose(clean, scene.noise, np.random.default_rng(5), COUNT)
    told = measure.propagate(clean, scene, SENSOR, LIGHT, "gradient").measurands
    return told, measure.measure(pictures, scene, SENSOR, LIGHT, "gradient")


def test_every_kind_is_as_predicted(two_holes, measured):
    """Variance of each value in the scene's unit and in the image; for each, 1.7 x the prediction and 0 are refused."""
    _, truth = two_holes
    told, found = measured
    assert np.isin(found.status, ["ok", "clutter"]).all()
    assert found.names[-2:] == ("place.x", "place.y")
    low, high = chi2.ppf(np.array([0.5, -0.5]) * sidak(0.01, 18) % 1, COUNT - 1) / (COUNT - 1)
    for values, covariance in ((found.value, told.covariance), (found.value_image, told.covariance_image)):
        ratio = values.var(0, ddof=1) / np.diag(covariance)
        assert ((low < ratio) & (ratio < high)).all(), ratio
        assert (ratio / 1.7 < low).all()  # margin: 70 % lie beyond the interval, for each
        assert low > 0
    sigma = np.sqrt(np.diag(told.covariance))
    # margin: a sigma of one picture: what interpolation and rays leave, and the mean of all
    assert (np.abs(found.value.mean(0) - truth) < 1.0 * sigma).all()
    assert (np.abs(found.value - truth) < 5 * sigma).all()  # margin: 5 standard deviations


def test_told_and_calibrated_variances(two_holes, measured):
    """What each image tells of itself, and what is predicted without one: within 10 % of the propagated."""
    scene, _ = two_holes
    told, found = measured
    exact = np.diag(told.covariance)
    each = np.einsum("nmm->nm", found.covariance)
    assert np.median(each, 0) / exact == pytest.approx(1, abs=0.1)
    calibrated = planner.predict(scene, SENSOR, LIGHT)
    # margin: the claim: both models agree to a tenth
    assert np.diag(calibrated.covariance_object) / exact == pytest.approx(1, abs=0.1)


def test_the_joint_covariance(measured):
    """Correlations of values that share edges and circles, by their scatter; without them they would be 0."""
    told, found = measured
    sigma = np.sqrt(np.diag(told.covariance))
    predicted = told.covariance / np.outer(sigma, sigma)
    empirical = np.corrcoef(found.value.T)
    error = (1 - predicted**2) / np.sqrt(COUNT - 1)
    assert (np.abs(empirical - predicted) < 4.5 * error + 1e-12).all()  # margin: 4.5 standard errors, of all pairs
    assert (np.abs(empirical) > 5 / np.sqrt(COUNT - 1)).sum() > len(sigma)  # some of them are correlated


def test_hole_to_hole_alone(two_holes):
    """No straight edge at all: planned, rendered, measured."""
    whole, _ = two_holes
    scene = whole.model_copy(update={"measurands": whole.measurands[:1]})
    told = planner.predict(scene, SENSOR, LIGHT)
    clean = render.image(scene, SENSOR, LIGHT, QUICK)
    pictures = render.expose(clean, scene.noise, np.random.default_rng(2), 60)
    found = measure.distance(pictures, scene, SENSOR, LIGHT)
    assert told.status == "ok"
    assert set(found.status) == {"ok"}
    assert found.value_px.mean() == pytest.approx(told.value_px, abs=0.5 * np.sqrt(told.variance_px2))
    assert 0.4 < found.value_px.var(ddof=1) / told.variance_px2 < 1.8
    assert found.corners[0] == pytest.approx(told.corners, abs=0.1)
    best = planner.plan(scene, step_deg=30, refined=False)
    assert best.prediction.variance_cm2 < told.variance_cm2


def test_a_displaced_part_is_followed(two_holes, clean):
    """The camera looks 2 px beside: lines and circles are found again, and perspective changes lengths by some 1e-3."""
    scene, _ = two_holes
    found = measure.measure(np.roll(clean, (1, 2), (0, 1)), scene, SENSOR, LIGHT, "gradient")
    here = measure.measure(clean, scene, SENSOR, LIGHT, "gradient")
    assert found.status.tolist() == here.status.tolist()
    assert found.value == pytest.approx(here.value, rel=4e-3)  # margin: some 1e-3, by perspective


def test_the_ellipses_own_centre_is_another_one(two_holes):
    """A hole's centre as found, and that of the ellipse fitted to its rim in the image: 0.05 px and more apart."""
    scene, _ = two_holes
    steep = (60, 330)
    circle = scene.solid.circle(scene.quantities[0].features[0].circle)
    from imaging.geometry.projection import project

    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)[:, None]
    rim = circle.centre + circle.radius * (np.cos(angle) * [1.0, 0, 0] + np.sin(angle) * [0, 1.0, 0])
    ellipse = measure.fit_ellipse(project(rim, np.array(steep, float), scene.camera)).centre
    clean = render.image(scene, steep, (10, 0), QUICK)
    found = measure.distance(clean, scene, steep, (10, 0))
    true = project(circle.centre[None], np.array(steep, float), scene.camera)[0]
    assert np.linalg.norm(ellipse - true) > 0.05  # margin: more than twice what the right centre may be off
    assert np.linalg.norm(found.corners[0] - true) < 0.02


def test_a_hidden_feature_leaves_the_others(two_holes):
    """A border through the picture's edge: what needs it has no value, the rest has."""
    scene, _ = two_holes
    near = scene.model_copy(
        update={"camera": scene.camera.model_copy(update={"look_at": (1.0, 4.0, 1.0), "focal_px": 1500.0})}
    )
    found = measure.measure(render.image(near, (20, 80), LIGHT, QUICK), near, (20, 80), LIGHT, "gradient")
    status = dict(zip(found.names, found.status.tolist(), strict=True))
    assert status["length"] not in ("ok", "clutter")
    assert np.isnan(found.value[found.names.index("length")])
    assert status["first bore"] in ("ok", "clutter")
    assert np.isfinite(found.covariance[found.names.index("first bore"), found.names.index("first bore")])


def test_distance_refuses_what_is_none(two_holes):
    scene, _ = two_holes
    other = scene.model_copy(update={"measurands": scene.measurands[2:]})
    with pytest.raises(
        InvalidInput, match=r"the first measurand must be a distance for measure\.distance, got diameter"
    ):
        measure.distance(np.zeros((240, 256)), other, SENSOR, LIGHT)


@lru_cache(maxsize=1)
def block_with_requirements():
    task1 = scenes.load("task1")
    listed = [
        {
            "name": "diagonal",
            "kind": "distance",
            "features": [{"vertex": "v3", "edges": ["e4", "e9"]}, {"vertex": "v6", "edges": ["e7", "e11"]}],
        },
        {"name": "depth", "kind": "width", "features": [{"edge": "e4"}, {"edge": "e7"}]},
        {"name": "corner", "kind": "angle", "features": [{"edge": "e4"}, {"edge": "e9"}]},
    ]
    data = task1.model_dump(exclude={"task", "settings", "same_scale"})
    return scenes.Scene.model_validate({**data, "measurands": listed})


@pytest.mark.parametrize("estimator", ["arrangement", "strip", "gradient"])
def test_estimators_of_the_whole_picture(estimator):
    """A block's edges by other estimators, whose corners and lines are one solution: as each of them tells itself."""
    scene = block_with_requirements()
    clean = render.image(scene, (30, 135), (15, 315))
    pictures = render.expose(clean, scene.noise, np.random.default_rng(8), 200)
    found = measure.measure(pictures, scene, (30, 135), (15, 315), estimator)
    told = measure.propagate(clean, scene, (30, 135), (15, 315), estimator).measurands
    assert (found.status == "ok").all()
    low, high = chi2.ppf(np.array([0.5, -0.5]) * sidak(0.01, 3) % 1, 199) / 199
    ratio = found.value.var(0, ddof=1) / np.diag(told.covariance)
    assert ((low < ratio) & (ratio < high)).all()
    assert np.einsum("nmm->nm", found.covariance).mean(0) / np.diag(told.covariance) == pytest.approx(1, abs=0.08)
    assert (
        np.abs(found.value.mean(0) - [np.hypot(12.5, 7.5), 7.5, 90]) < 0.7 * np.sqrt(np.diag(told.covariance))
    ).all()
