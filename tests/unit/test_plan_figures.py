"""Which maps a plan is drawn with."""

from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest

import scenes
from imaging.geometry.projection import project
from scenes import Pose
from validation.report import plan_figures, scene_figure

SENSOR, LIGHT = Pose(30, 135), Pose(15, 315)


@pytest.mark.parametrize(
    ("light", "roles"),
    [(LIGHT, ["light", "sensor"]), ((LIGHT, Pose(40, 20)), ["sensor"]), ((), ["sensor"])],
    ids=["one free light", "two", "none"],
)
def test_there_is_a_map_of_the_light_where_one_is_free(monkeypatch, light, roles):
    """The sensor is always somewhere."""
    monkeypatch.setattr(plan_figures, "_chart", lambda plan, role: role)
    assert list(plan_figures._charts(SimpleNamespace(sensor=SENSOR, light=light))) == roles


def test_what_is_held_is_said():
    plan = SimpleNamespace(sensor=SENSOR, light=LIGHT)
    assert plan_figures._held(plan, "light") == f", sensor at {plan_figures.short(SENSOR)}"
    assert plan_figures._held(plan, "sensor") == f", light at {plan_figures.short(LIGHT)}"
    assert plan_figures._held(SimpleNamespace(sensor=SENSOR, light=()), "sensor") == ""


def test_what_is_required_is_drawn_from_end_to_end():
    """Each line ends where the camera shows a corner of the part, the circle's pieces too, each one once."""
    scene, figure = scenes.load("plate"), plt.figure()
    axis, sensor = figure.add_subplot(), Pose(20, 60)
    try:
        plan_figures._rim(axis, scene, np.array(list(sensor)), scene.solid.circles[0])
        drawn = [line.get_xydata() for line in axis.lines]
        assert axis.lines[0].get_label() == scene.solid.circles[0].name
    finally:
        plt.close(figure)
    corners = project(scene.solid.vertices, np.array(list(sensor), float), scene.camera)
    ends = np.array([[line[0], line[-1]] for line in drawn])
    away = np.linalg.norm(ends[:, :, None] - corners, axis=-1)
    assert away.min(-1).max() < 1e-9
    assert np.bincount(away.argmin(-1).ravel()).tolist().count(2) == len(drawn)


def test_what_is_near_is_drawn_over_what_is_far():
    """The bracket's faces that are turned to the sensor, from the farthest on, by their middles."""
    scene, sensor, figure = scenes.load("bracket"), Pose(40, 30), plt.figure()
    axis = figure.add_subplot()
    try:
        scene_figure._faces(axis, scene_figure._View(scene, sensor))
        drawn = [path.vertices[:3] for path in axis.collections[0].get_paths()]
    finally:
        plt.close(figure)
    polar, azimuth = np.radians(list(sensor))
    way = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    eye = np.array(scene.camera.look_at) + scene.camera.distance * way
    middles = scene.solid.triangles.mean(1)
    places = project(scene.solid.triangles.reshape(-1, 3), np.array(list(sensor), float), scene.camera)
    which = [np.abs(places.reshape(-1, 3, 2) - each).sum((1, 2)).argmin() for each in drawn]
    turned = (scene.solid.normals[scene.solid.triangle_faces] * (eye - middles)).sum(1) > 0
    assert sorted(which) == np.flatnonzero(turned).tolist()
    assert (np.diff(np.linalg.norm(eye - middles[which], axis=1)) <= 1e-9).all()


@pytest.mark.parametrize(("spans", "longest"), [([(0.0, 0.5), (0.8, 1.0)], 0), ([(0.0, 0.1), (0.4, 0.9)], 1)])
def test_a_name_stands_at_the_longest_part_of_an_edge_that_is_seen(spans, longest, monkeypatch):
    scene, figure = scenes.load("task1"), plt.figure()
    view = scene_figure._View(scene, Pose(30, 135))
    monkeypatch.setattr(scene_figure, "visible_spans", lambda *given: spans)
    try:
        scene_figure._edge(figure.add_subplot(), view, scene.solid.edges[3])
    finally:
        plt.close(figure)
    start, stop = view.image(scene.solid.vertices[list(scene.solid.edges[3].ends)])
    along = (view.names[0].places - start) @ (stop - start) / ((stop - start) @ (stop - start))
    low, high = spans[longest]
    assert low - 0.01 <= along.min() < along.max() <= high + 0.01


def test_a_circles_name_stands_on_any_of_its_four_sides():
    """Above it first, then right, left and below."""
    scene, figure = scenes.load("plate"), plt.figure()
    view = scene_figure._View(scene, Pose(20, 60))
    try:
        scene_figure._circle(figure.add_subplot(), view, scene.solid.circles[0])
    finally:
        plt.close(figure)
    (above, right, left, below), rim = view.names[0].places, view.names[0].places
    assert above[1] == rim[:, 1].min() < rim[:, 1].max() == below[1]
    assert left[0] == rim[:, 0].min() < rim[:, 0].max() == right[0]


@pytest.mark.parametrize(("sensor", "shape"), [((30, 135), "as seen"), ((90, 0), "least")])
def test_a_figure_of_the_part_has_the_shape_of_what_is_seen(sensor, shape, monkeypatch):
    """Of the width of a column, and an inch of words; a flat view keeps a least height."""
    scene, sizes = scenes.load("task1"), []
    monkeypatch.setattr(scene_figure, "save", lambda figure, path: sizes.append(figure.get_size_inches()))
    scene_figure.draw(scene, Pose(*sensor), None)
    seen = project(scene.solid.vertices, np.array(sensor, float), scene.camera)
    across, down = np.ptp(seen, axis=0)
    height = 0.85 * sizes[0][0] * down / across
    assert (height > 2.5) == (shape == "as seen")
    assert sizes[0][1] == pytest.approx(max(height, 2.5) + 1)
