"""What is measured: required edges, derivatives against central differences, angle and shared edges by Monte Carlo."""

import numpy as np
import pytest

import planner
import scenes
from imaging.features.measurand import measurand, required_edges
from imaging.features.projected_edges import projected_edges
from imaging.geometry.projection import edge_points, jacobian, project
from imaging.geometry.visibility import visible_spans
from imaging.light.edge_sides import paper_contrast2
from imaging.models.paper import paper
from imaging.pictures import Pictures
from scenes import InvalidInput

SENSOR, LIGHT = np.array([35.0, 70.0]), np.array([20.0, 200.0])


@pytest.fixture(scope="module")
def angle(task1):
    return task1.model_copy(update={"task": scenes.Task(kind="angle", lines=("e4", "e9"))})


def test_required_edge_list_is_the_papers(task1):
    """Eq. 11 and the nine sets of section 9.1, printed as sets."""
    printed = """e2 e4 e6 e7 | e2 e4 e6 e11 | e2 e4 e7 e11 | e2 e6 e7 e9 | e2 e6 e9 e11 | e2 e7 e9 e11
                 e4 e6 e7 e9 | e4 e6 e9 e11 | e4 e7 e9 e11"""
    expected = {frozenset(part.split()) for line in printed.splitlines() for part in line.split("|")}
    assert {frozenset(task.edges) for task in required_edges(task1)} == expected
    assert len(required_edges(task1)) == 9


def test_projection_derivative(task1):
    points = np.array([[12.5, 0, 2.5], [0, 7.5, 2.5], [3, 2, 1]])
    step = 1e-5
    columns = [
        (project(points + d, SENSOR, task1.camera) - project(points - d, SENSOR, task1.camera)) / (2 * step)
        for d in step * np.eye(3)
    ]
    assert jacobian(points, SENSOR, task1.camera) == pytest.approx(np.stack(columns, -1), rel=1e-6, abs=1e-7)


def test_variance_in_the_object_by_monte_carlo(task1, rng):
    """Corners that scatter as predicted, each taken back to the top face along its ray; 1.3 x and 0 are rejected."""
    found = planner.predict(task1, SENSOR, LIGHT)
    scale, count = 1e-3, 20_000  # of the errors, so that they are small
    height = task1.solid.vertex("v3")[2]
    points = []
    for corner, name, covariance in zip(found.corners, ("v3", "v6"), found.covariances, strict=True):
        vertex, step = task1.solid.vertex(name), 1e-6 * np.eye(3)[:2]
        slope = np.stack([(project((vertex + d)[None], SENSOR, task1.camera)[0] - corner) / 1e-6 for d in step], -1)
        errors = rng.multivariate_normal(np.zeros(2), covariance * scale**2, count)
        points.append(np.column_stack([vertex[:2] + errors @ np.linalg.inv(slope).T, np.full(count, height)]))
    ratio = np.linalg.norm(points[1] - points[0], axis=1).var(ddof=1) / (scale**2 * found.variance_cm2)
    tolerance = 4 * np.sqrt(2 / (count - 1))
    assert ratio == pytest.approx(1, abs=tolerance)  # margin: 4 standard errors
    assert ratio / 1.3 != pytest.approx(1, abs=tolerance)  # margin: 30 % are beyond 4 standard errors


def measured(scene, lines, view):
    """The task's quantity from moved lines: rows (d, theta) an edge, applied to the edge's end points."""
    along = (view.ends[:, 1] - view.ends[:, 0]) / view.lengths[:, None]
    normal = np.stack([-along[:, 1], along[:, 0]], -1)
    starts = view.ends[:, 0] + lines[:, :1] * normal
    turned = np.cos(lines[:, 1:]) * along + np.sin(lines[:, 1:]) * normal
    if scene.task.kind == "angle":
        i, j = (view.names.index(name) for name in scene.task.lines)
        cosine = turned[i] @ turned[j]
        away = [along[k] @ (view.ends[k].mean(0) - shared(scene, view)) for k in (i, j)]
        return np.degrees(np.arccos(cosine * np.sign(away[0] * away[1])))
    corners = []
    for corner in scene.task.corners:
        i, j = (view.names.index(name) for name in corner.edges)
        s, _ = np.linalg.solve(np.column_stack([turned[i], -turned[j]]), starts[j] - starts[i])
        corners.append(starts[i] + s * turned[i])
    return np.linalg.norm(corners[1] - corners[0])


def shared(scene, view):
    edges = [scene.solid.edge(name) for name in scene.task.lines]
    (vertex,) = set(edges[0].ends) & set(edges[1].ends)
    return project(scene.solid.vertices[[vertex]], SENSOR, scene.camera)[0]


@pytest.mark.parametrize("name", ["task1", "wedge", "angle"])
def test_derivatives_by_the_lines(name, angle):
    """Every line's displacement and rotation against central differences; the wedge's corners share an edge."""
    scene = angle if name == "angle" else scenes.load(name)
    known = measurand(Pictures.of(scene, SENSOR))
    step = np.array([1e-4, 1e-6])
    for e in range(len(known.view.names)):
        for k, ours in enumerate((known.offset, known.tilt)):
            move = np.zeros((len(known.view.names), 2))
            move[e, k] = step[k]
            numeric = (measured(scene, move, known.view) - measured(scene, -move, known.view)) / (2 * step[k])
            assert ours[e] == pytest.approx(numeric, rel=1e-6, abs=1e-6 * np.abs(known.tilt).max())


@pytest.mark.parametrize("name", ["task1", "wedge", "angle"])
def test_paper_price_by_monte_carlo(name, angle, rng):
    """The variance of fits to points with the paper's errors; 1.3 x the prediction and 0 are rejected."""
    scene = angle if name == "angle" else scenes.load(name)
    evaluated = paper(Pictures.of(scene, SENSOR, LIGHT))
    view = evaluated.measurands.view
    fractions = np.linspace(0, 1, 100)
    points = edge_points(scene.solid, view.names, fractions)
    image = project(points.reshape(-1, 3), SENSOR, scene.camera).reshape(len(view.names), 100, 2)
    squared = paper_contrast2(Pictures.of(scene, SENSOR, LIGHT), view.names, fractions)
    sigma = np.sqrt(8.697) * scene.noise.sigma / np.sqrt(squared)
    along = (view.ends[:, 1] - view.ends[:, 0]) / view.lengths[:, None]
    count = 4000
    errors = sigma * rng.standard_normal((count, *sigma.shape))
    u = np.einsum("eni,ei->en", image - view.ends[:, :1], along)
    weight = 1 / sigma**2
    mean = (weight * u).sum(-1) / weight.sum(-1)
    slope = (weight * (u - mean[:, None]) * errors).sum(-1) / (weight * (u - mean[:, None]) ** 2).sum(-1)
    offset = (weight * errors).sum(-1) / weight.sum(-1) - slope * mean
    values = np.array(
        [measured(scene, np.stack(line, -1), view) for line in zip(offset, np.arctan(slope), strict=True)]
    )
    ratio = values.var(ddof=1) / evaluated.variance
    tolerance = 4 * np.sqrt(2 / (count - 1))
    assert ratio == pytest.approx(1, abs=tolerance)  # margin: 4 standard errors
    assert ratio / 1.3 != pytest.approx(1, abs=tolerance)  # margin: 30 % are beyond 4 standard errors


def test_prediction_of_an_angle(angle):
    prediction = planner.predict(angle, SENSOR, LIGHT)
    assert prediction.kind == "angle"
    assert prediction.value_object == pytest.approx(90)
    assert prediction.status == "ok"
    with pytest.raises(InvalidInput, match=r"task.kind must be distance for variance_px2, got 'angle'"):
        _ = prediction.variance_px2


def test_bad_tasks(task1):
    with pytest.raises(ValueError, match=r"task.lines must be given, got nothing"):
        scenes.Task(kind="angle")
    with pytest.raises(ValueError, match=r"task.start must be given, got nothing"):
        scenes.Task()
    for task, line in (
        (scenes.Task(kind="angle", lines=("e4", "e44")), "task.lines must be edges"),
        (scenes.Task(start=task1.task.start, end=scenes.Centre(circle="c1")), "task.end.circle must be one of"),
    ):
        with pytest.raises(ValueError, match=line):
            scenes.Scene.model_validate({**task1.model_dump(), "task": task.model_dump(exclude_none=True)})


def test_outline_of_a_hidden_edge_keeps_what_is_seen():
    bracket = scenes.load("bracket")
    sensor = np.array([55.0, 178.0])  # behind the upright
    view = projected_edges(Pictures.of(bracket, sensor), ("e14",))
    (shown,), (trim,) = view.shown, view.trims
    assert view.visible[0]
    # the part that is hidden in space, 0.859, as perspective shows it: by the depths of the edge's ends
    edge, at = bracket.solid.edge("e14"), bracket.position("sensor", scenes.Pose(*sensor))
    ((free, end),) = visible_spans(bracket.solid, edge, at)
    near, far = (at - bracket.solid.vertices[list(edge.ends)]) @ (at - np.array(bracket.camera.look_at))
    assert shown[0] == pytest.approx(free * far / ((1 - free) * near + free * far), rel=1e-9)
    assert (shown[1], end) == (1, 1)
    assert 0.8 < shown[0] < 0.9  # margin: a part is hidden, and not much of it
    assert trim[0] > shown[0] * view.lengths[0]  # margin: the order is said


def test_exact_poses_spread_nothing_whatever_is_measured(angle, task1):
    for scene in (angle, scenes.load("plate"), task1):
        found = planner.pose_scatter(scene, np.array([[30.0, 135.0], [50.0, 20.0]]))
        assert not found.covariance.any()
        assert not found.bias.any()
