"""Parts of the search for a shape: errors at the ends of lines, and what is reported of lines and of nothing."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import scenes
from measure.features import shape
from measure.features.arranged import _nothing, line_rows
from measure.features.layout import layout_of
from measure.features.lines import end_errors
from scenes import Picture, Pose, status


def test_errors_at_both_ends(rng):
    """Of level and level + slope * length, by the rows that make them from (level, slope) of two edges."""
    lengths = np.array([40.0, 7.0])
    roots = rng.normal(size=(3, 4, 4)) * [1, 0.1, 1, 0.1]
    covariance = roots.swapaxes(-1, -2) @ roots
    found = end_errors(covariance, lengths)
    for e, length in enumerate(lengths):
        for end, place in enumerate((0.0, length)):
            row = np.zeros(4)
            row[2 * e : 2 * e + 2] = 1, place
            assert found[:, e, end] == pytest.approx(np.sqrt(row @ covariance @ row))


def test_rows_of_lines(rng):
    """Displacement at the first end and rotation, by moving the vertices that end the lines."""
    vertices, required = rng.uniform(0, 50, (5, 2)), np.array([[0, 3], [3, 1]])
    tool = SimpleNamespace(
        arrangement=SimpleNamespace(required=required),
        index=lambda which: (2 * np.asarray(which)[:, None] + [0, 1]).ravel(),
    )

    def lines(vertices):
        """Distances of a line at its first end along a fixed normal, and its angle."""
        values = []
        for first, last in required:
            along = true[last] - true[first]
            normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
            way = vertices[last] - vertices[first]
            values += [normal @ vertices[first], np.arctan2(way[1], way[0])]
        return np.array(values)

    true = vertices.copy()
    centre = SimpleNamespace(state=SimpleNamespace(vertices=vertices), covariance=np.zeros((12, 12)))
    rows = line_rows(tool, centre)
    assert rows.shape == (4, 12)
    for i in range(12):
        step = 1e-6 * (np.arange(10) == i).reshape(5, 2)
        assert rows[:, i] == pytest.approx((lines(true + step) - lines(true - step)) / 2e-6, abs=1e-8)


def test_nothing_is_reported_of_an_edge_that_is_not_seen(task1):
    """Seen from below, the required edges of the top are hidden: NaN of every number, not_visible of the images."""
    layout = layout_of(Picture.of(task1, Pose(100.0, 40.0), Pose(15, 315)))
    shape = _nothing(3, layout)
    edges, corners = len(layout.names), len(layout.corners)
    assert not layout.visible.all()
    assert shape.corners.shape == (3, corners, 2)
    assert shape.covariance.shape == (3, 2 * corners, 2 * corners)
    assert shape.normals.shape == shape.points.shape == (3, edges, 2)
    assert shape.lines.shape == (3, 2 * edges, 2 * edges)
    assert all(np.isnan(getattr(shape, name)).all() for name in ("corners", "covariance", "normals", "points", "lines"))
    assert np.isnan(shape.p_value).all()
    assert shape.status.tolist() == shape.whole.tolist() == [status.NOT_VISIBLE] * 3
    drawn = (layout.arrangement.required >= 0).all(1)
    assert (shape.edge_status[0] == status.NOT_VISIBLE).tolist() == (~layout.visible).tolist()
    assert (shape.edge_status[0] == status.LOW_CONTRAST).tolist() == (layout.visible & ~drawn).tolist()
    assert not shape.used.any()
    assert shape.edge_contrast.shape == shape.rejected.shape == (3, edges)


def test_scenes_have_no_such_edge_by_default(task1):
    layout = layout_of(Picture.of(scenes.load("task1"), Pose(30, 135), Pose(15, 315)))
    assert layout.visible.all()


def test_of_a_known_picture_a_layout_is_moved_only_where_its_edges_would_not_be_caught(task1, monkeypatch):
    """Half a px off all of them are; of a layout that is a guess it is moved there, too."""
    layout = layout_of(Picture.of(task1, Pose(30.0, 135.0), Pose(15, 315)))
    images, offsets = np.zeros((2, 24, 32)), np.zeros((2, len(layout.names), 2))
    offsets[:, 1] = [0.9, 2.0]
    monkeypatch.setattr(shape, "align", lambda some, _: np.array([[0.5, 0.0, 0.0], [6.0, 4.0, 0.0]])[: len(some)])
    every = np.ones(2, bool)
    (far, second), (near, first) = shape._expectations(images, layout, offsets, every, every.copy(), 1.5)
    assert (first.tolist(), second.tolist()) == ([0], [1])
    assert far.ends == pytest.approx(layout.ends + [6.0, 4.0])
    away = np.abs(np.einsum("eki,ei->ek", near.ends - layout.ends, layout.normals))
    assert away == pytest.approx(np.where(np.arange(len(away)) == 1, [[0.875], [1.0]], 0.0).T)
    guess = replace(layout, clutter=None)
    told = list(shape._expectations(images, guess, offsets, every, every.copy(), 1.5))
    assert [which.tolist() for _, which in told] == [[0], [1]]
    assert told[0][0].ends == pytest.approx(layout.ends + [0.5, 0.0])
