"""What is hidden of an edge: many positions at once, and against rays cast point by point."""

import numpy as np
import pytest

import scenes
from imaging.features.projected_edges import projected_edges
from imaging.geometry.visibility import hidden_spans, longest_span, seen, visible_spans
from imaging.models.along import used_trims
from imaging.pictures import Pictures
from tests.oracle import axes


@pytest.fixture(scope="module")
def bracket():
    return scenes.load("bracket")


def stopped(solid, edge, position, fractions):
    """Whether a triangle of another face lies between the position and points of the edge (Moeller and Trumbore)."""
    start, stop = solid.vertices[list(edge.ends)]
    blocked = np.zeros(fractions.size, bool)
    others = solid.triangles[~np.isin(solid.triangle_faces, edge.faces)]
    for k, fraction in enumerate(fractions):
        ray = start + fraction * (stop - start) - position
        one, two = others[:, 1] - others[:, 0], others[:, 2] - others[:, 0]
        across = np.cross(ray, two)
        size = (one * across).sum(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = ((position - others[:, 0]) * across).sum(1) / size
            round_ = np.cross(position - others[:, 0], one)
            v, t = (ray * round_).sum(1) / size, (two * round_).sum(1) / size
        blocked[k] = ((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-6) & (t < 1 - 1e-6)).any()
    return blocked


POSES = [(55, 178), (35, 120), (70, 250), (20, 10), (60, 330), (80, 60)]


@pytest.mark.parametrize("name", ["e14", "e3", "e8", "e12"])
def test_rays_and_spans(bracket, name):
    solid = bracket.solid
    edge = solid.edge(name)
    positions = 100 * np.array([axes(pose)[0] for pose in POSES])
    fractions = (np.arange(60) + 0.5) / 60
    together = longest_span(solid, edge, positions)
    assert together.shape == (len(POSES), 2)
    free = seen(solid, edge, positions, fractions)
    for at, whole, here in zip(positions, together, free, strict=True):
        blocked = stopped(solid, edge, at, fractions)
        # margin: a share, which is 1 at most
        assert (here == ~blocked).mean() > 0.96  # but for the points beside a limit
        assert longest_span(solid, edge, at) == pytest.approx(whole, abs=1e-12)
        spans = hidden_spans(solid, edge, at)
        gaps, low = [], 0.0
        for start, stop in sorted(spans[spans[:, 0] < spans[:, 1]].tolist()):
            gaps.append((low, start))
            low = max(low, stop)
        best = max([*gaps, (low, 1.0)], key=lambda gap: gap[1] - gap[0])
        assert whole == pytest.approx(best if best[1] > best[0] else (0, 0), abs=1e-9)
        if visible_spans(solid, edge, at):
            assert max(visible_spans(solid, edge, at), key=lambda s: s[1] - s[0]) == pytest.approx(best, abs=1e-9)


def test_two_positions_leave_what_both_see(bracket):
    edge = bracket.solid.edge("e14")
    sensor, light = (100 * axes(pose)[0] for pose in ((55, 178), (35, 120)))
    fractions = (np.arange(2000) + 0.5) / 2000
    both = seen(bracket.solid, edge, sensor, fractions) & seen(bracket.solid, edge, light, fractions)
    found = longest_span(bracket.solid, edge, sensor, light)
    assert found[1] - found[0] == pytest.approx(_longest(both) / 2000, abs=2e-3)


def _longest(free):
    runs = "".join("1" if here else "0" for here in free).split("0")
    return max(map(len, runs))


def test_what_is_hidden_is_not_used(bracket):
    """Of the edge behind the upright 14 % of its image and more; of a convex body nothing."""
    pictures = Pictures.of(bracket, np.array([55.0, 178.0]), np.array([35.0, 170.0]))
    view = projected_edges(pictures, ("e14",))
    trims = used_trims(pictures, view, trimmed=False)
    # margin: what is trimmed is part of what is seen, by its kind
    assert trims[0, 0] >= view.shown[0, 0] * view.lengths[0] - 1e-9
    assert trims[0, 0] > 0.8 * view.lengths[0]  # margin: the order is said
    task1 = scenes.load("task1")
    block = Pictures.of(task1, np.array([30.0, 135.0]), np.array([15.0, 315.0]))
    assert (used_trims(block, projected_edges(block), trimmed=False) == 0).all()
