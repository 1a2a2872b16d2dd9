"""Where an edge is measured: places, trims, crowding, and coordinates in its frame, by plane geometry."""

from dataclasses import replace

import numpy as np
import pytest

from imaging.geometry.segments import distance_to_segment
from measure.features.calipers import Caliper, edge_calipers, trim
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from scenes import status

OPTICS = Optics((120, 130), 0.7, 1.0, 1.0, 3.0)
CORNERS = np.array([[22.3, 18.6], [108.1, 25.2], [101.7, 99.4], [17.2, 92.9]])


@pytest.mark.parametrize("clear", [3.0, 5.0])
@pytest.mark.parametrize("margin", [0.0, 23.0])
def test_places_along_an_edge(clear, margin):
    """As far from both neighbours as asked, from there at most a pixel apart, so few as that takes; off the border."""
    layout = polygon_layout(CORNERS, OPTICS)
    for e, caliper in enumerate(edge_calipers(layout, clear, margin)):
        start, stop = layout.ends[e]
        along = (stop - start) / np.linalg.norm(stop - start)
        ends = []
        for way, beside in ((along, layout.ends[e - 1]), (-along, layout.ends[(e + 1) % 4])):
            other = (beside[0] - beside[1]) if way is along else (beside[1] - beside[0])
            angle = np.arccos(way @ other / np.linalg.norm(other))
            ends.append(clear / np.sin(angle) if angle < np.pi / 2 else clear)
        first, last = ends[0], np.linalg.norm(stop - start) - ends[1]
        count = int(np.ceil(last - first)) + 1
        t = first + (last - first) * np.arange(count) / (count - 1)
        places = start + t[:, None] * along
        room = ((places >= margin) & (places <= [129 - margin, 119 - margin])).all(1)
        assert caliper.length == pytest.approx(np.linalg.norm(stop - start))
        assert caliper.direction == pytest.approx(along)
        assert caliper.positions == pytest.approx(t[room])
        assert caliper.status == (status.OK if room.sum() >= 3 else status.NOT_VISIBLE)


@pytest.mark.parametrize(("apart", "state"), [(4.1, "ok"), (3.9, "clutter")])
def test_crowded(apart, state):
    """By an edge that shares no corner with it and comes nearer than asked; unless the planner knows better."""
    layout = polygon_layout(CORNERS, OPTICS)
    normal = edge_calipers(layout, 4.0, 0.0)[0].normal
    middle = layout.ends[0].mean(0) + apart * normal
    segment = np.stack([middle, middle + 20 * normal])[None]
    crowded = replace(layout, apart=(segment, *layout.apart[1:]))
    assert edge_calipers(crowded, 4.0, 0.0)[0].status == state
    assert edge_calipers(crowded, 3.0, 0.0, 4.0)[0].status == state
    assert edge_calipers(crowded, 4.0, 0.0, 3.0)[0].status == "ok"
    for told in (True, False):
        sure = replace(crowded, clutter=np.array([told, False, False, False]))
        assert edge_calipers(sure, 4.0, 0.0)[0].status == ("clutter" if told else "ok")
        assert edge_calipers(sure, 4.0, 0.0, 4.0)[0].status == state


@pytest.mark.parametrize(("more", "state"), [(0.05, "ok"), (-0.05, "short")])
def test_short_edges(more, state):
    """Less than 2 px left between the trims is nothing."""
    side = 2 * 4.0 + 2.0 + more
    square = 40.0 + side * np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    assert {caliper.status for caliper in edge_calipers(polygon_layout(square, OPTICS), 4.0, 0.0)} == {state}


def test_not_visible():
    layout = polygon_layout(CORNERS, OPTICS)
    hidden = replace(layout, visible=np.array([True, False, True, True]))
    found = edge_calipers(hidden, 4.0, 0.0)
    assert [caliper.status for caliper in found] == ["ok", "not_visible", "ok", "ok"]
    assert found[1].positions.size == 0
    part = replace(layout, shown=np.array([[0.25, 0.75], *layout.shown[1:]]))
    seen = edge_calipers(part, 4.0, 0.0)[0]
    assert seen.positions[[0, -1]] == pytest.approx([0.25 * seen.length + 4, 0.75 * seen.length - 4])


@pytest.mark.parametrize(("degrees", "factor"), [(30, 2.0), (90, 1.0), (120, 1.0), (150, 1.0), (-30, 2.0)])
def test_trim(degrees, factor):
    """clear / sin(angle) for an edge that turns towards this one, the largest of several."""
    along, angle = np.array([0.6, 0.8]), np.arctan2(0.8, 0.6) + np.radians(degrees)
    beside = 20.0 * np.array([[np.cos(angle), np.sin(angle)]])
    assert trim(along, beside, 3.0) == pytest.approx(3.0 * factor)
    assert trim(along, np.concatenate([beside, [[0.0, 9.0]]]), 3.0) == pytest.approx(max(3.0 * factor, 3.0 / 0.6))
    assert trim(along, np.empty((0, 2)), 3.0) == 3.0


@pytest.mark.parametrize("degrees", [0.0, 2.0, 40.0, 89.0, 91.0, 180.0])
@pytest.mark.parametrize("size", [1e-3, 1.0, 4.0, 30.0])
def test_trim_beside_a_neighbour_that_ends(degrees, size):
    """The edge is as far from the neighbour, a piece of a line, as is asked, and nearer just before; never less than
    that is left out. One that lies upon the edge in the image hides so much of it as it is long."""
    angle, clear = np.radians(degrees), 3.0
    end = size * np.array([np.cos(angle), np.sin(angle)])
    found = trim(np.array([200.0, 0.0]), end[None], clear)

    def away(place):
        return distance_to_segment(np.array([[place, 0.0]]), np.zeros(2), end)[0]

    assert found >= clear  # margin: as near as it may be
    assert away(found) >= clear - 1e-9  # margin: the same
    if degrees < 90:
        assert away(found - 1e-3) < clear  # margin: a thousandth of a px nearer is too near
    if degrees == 0:
        assert found == pytest.approx(size + clear)


def test_frame(rng):
    """Points and their coordinates, back and forth; the normal is a quarter turn from the direction."""
    caliper = Caliper("a", np.array([3.0, 4.0]), np.array([0.8, 0.6]), 10.0, np.arange(5.0), "ok", OPTICS, np.zeros(2))
    assert caliper.normal.tolist() == [-0.6, 0.8]
    along, across = rng.normal(size=(2, 6))
    points = caliper.at(along, across)
    assert points == pytest.approx([3, 4] + along[:, None] * [0.8, 0.6] + across[:, None] * [-0.6, 0.8])
    assert np.array(caliper.coordinates(points)) == pytest.approx(np.array([along, across]))
    assert caliper.blur(along) == 0.7
    blurred = replace(caliper, defocus=np.array([1.0, -3.0]))
    assert blurred.blur(np.array([0.0, 5.0, 10.0])) == pytest.approx(np.sqrt(0.49 + np.array([1.0, 1.0, 9.0]) / 4))


def test_of_an_edge_that_is_not_seen_nothing_is_said():
    """No length and no places, but sound arrays: its blur may be asked for, and its points; so of one of no length."""
    layout = polygon_layout(CORNERS, OPTICS)
    ends = layout.ends.copy()
    ends[2] = ends[2, :1]
    layout = replace(
        layout, ends=ends, visible=np.array([True, False, True, True]), defocus=np.arange(8.0).reshape(4, 2)
    )
    for edge in (1, 2):
        nothing = edge_calipers(layout, 4.0, 0.0)[edge]
        assert (nothing.name, nothing.status, nothing.length) == (layout.names[edge], status.NOT_VISIBLE, 0.0)
        assert [each.tolist() for each in (nothing.origin, nothing.direction, nothing.positions, nothing.defocus)] == [
            [0.0, 0.0], [1.0, 0.0], [], [0.0, 0.0]
        ]  # fmt: skip
        assert nothing.optics is OPTICS
        assert nothing.blur(nothing.positions) == OPTICS.blur_px
        assert nothing.at(nothing.positions, np.zeros(1)).shape == (0, 2)
    assert edge_calipers(layout, 4.0, 0.0)[3].defocus.tolist() == [6.0, 7.0]
