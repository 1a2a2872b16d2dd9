"""Which straight pieces are those of a curved edge: an arc in a plane, and what continues it."""

import numpy as np
import pytest

from scenes.parts.chains import Chains
from scenes.parts.curves import curved, turning
from scenes.parts.facets import _along_lines

ARC = [1.0, 1.1, 0.9, 1.0]  # lengths of pieces that turn by 6 degrees


def path(turns, lengths):
    """Vertices (n + 1, 3) of pieces of some lengths, each turned by so many degrees from the one before."""
    way = np.radians(np.cumsum(turns))
    steps = np.array(lengths)[:, None] * np.column_stack([np.cos(way), np.sin(way), 0 * way])
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, 0)])


def pieces(lengths, turns, walls, scale=1.0, off=0.0, backwards=()):
    """Which pieces of an edge between plane face 0 and each one's wall (-1: another plane) are found to be curved.

    ``turns`` are degrees from each piece to the next; ``off`` moves every other vertex aside, in parts of the scale.
    """
    vertices = path([0.0, *turns], lengths)
    vertices[1::2, 1] += off
    count = len(lengths)
    region = np.array([-1, *(-1 if wall < 0 else wall for wall in walls)])
    faces = {wall: 1 + walls.index(wall) for wall in walls if wall < 0}  # one plane for each number below 0
    chains = [
        ((i + 1, i) if i in backwards else (i, i + 1), (0, faces.get(wall, i + 1)), True)
        for i, wall in enumerate(walls)
    ]
    shape = Chains.of(vertices * scale, chains, np.tile([0.0, 0, 1], (count + 1, 1)), np.ones(count + 1))
    return curved(shape, region, np.ones(count, bool)).tolist()


@pytest.mark.parametrize("scale", [0.01, 1.0, 300.0])
@pytest.mark.parametrize(("length", "found"), [(0.6, True), (0.7, False)])
def test_a_straight_edge_is_as_long_as_all_of_its_pieces_whatever_the_unit(scale, length, found):
    """Of six pieces, 4.2 times the arc's last in all: more than four times; their bends are of single precision."""
    turns = [6.0] * 4 + [0.0] * 5
    told = pieces([*ARC, *[length] * 6], turns, [0] * 10, scale, off=4e-7)
    assert told == [True] * 4 + [found] * 6
    assert pieces([*ARC, *[length] * 6], turns, [0] * 10, scale, 4e-7, (1, 2, 4, 7)) == told


@pytest.mark.parametrize(("lengths", "found"), [([2.0, 0.1, 2.1], False), ([1.8, 0.1, 1.8], True)])
def test_a_short_piece_of_a_straight_edge_may_turn_as_much_as_its_own_length_leaves_unsure(lengths, found):
    told = pieces([*ARC, *lengths], [6.0] * 4 + [0.0] * 2, [0] * 7, off=4e-7)
    assert told == [True] * 4 + [found] * 3


@pytest.mark.parametrize(
    ("length", "turn", "found"), [(1.45, 6.0, True), (1.55, 6.0, False), (1.0, 4.3, True), (1.0, 4.1, False)]
)
def test_a_last_piece_beside_planes_is_as_long_and_turns_as_much_as_those_before(length, turn, found):
    """At most 1.5 times as long, at least 0.7 of the turn before; at either end."""
    lengths, turns, walls = [*ARC, length], [6.0, 6.0, 6.0, turn], [0, 0, 0, 0, -1]
    assert pieces(lengths, turns, walls) == [True] * 4 + [found]
    assert pieces(lengths[::-1], turns[::-1], walls[::-1]) == [found] + [True] * 4


@pytest.mark.parametrize(
    ("before", "length", "turn", "found"),
    [
        (1.04, 2.15, 4.8, True),
        (1.04, 2.25, 4.8, False),
        (1.06, 2.15, 4.8, False),
        (1.04, 2.15, 4.1, False),
        (1.005, 1.005, 3.2, True),
        (1.005, 1.015, 3.2, False),
        (1.015, 1.005, 3.2, False),
    ],
)
def test_a_curve_in_even_pieces_ends_in_one_of_twice_their_length_or_of_the_same(before, length, turn, found):
    """Twice as long where it turns by 0.7 of the turn before, as a straight edge does not; as long however it turns."""
    lengths, turns, walls = [1.2, 1.3, before, 1.0, length], [6.0, 6.0, 6.0, turn], [0, 0, 0, 0, -1]
    assert pieces(lengths, turns, walls) == [True] * 4 + [found]


@pytest.mark.parametrize(("turn", "found"), [(59.0, True), (61.0, False)])
def test_pieces_that_turn_by_60_degrees_are_none_of_a_curve(turn, found):
    assert pieces([1.0, 1.2, 1.1], [turn, turn], [0, 0, 0]) == [found] * 3


def test_an_edge_between_planes_is_straight_however_it_turns():
    assert pieces([1.0, 1.2, 1.1], [20.0, 20.0], [-1, -2, -3]) == [False] * 3


@pytest.mark.parametrize(
    ("turn", "others", "length", "found"),
    [(0.0, (), 1.0, 3), (0.0, (), 3.9, 3), (0.0, (), 4.1, 2), (1.0, (), 1.0, 2), (0.0, (2,), 1.0, 2)],
)
def test_what_continues_a_curved_edge_in_a_line_is_a_piece_of_it_up_to_where_others_end(turn, others, length, found):
    """Two pieces of a curve, then one in their line, one that turns, or one beyond a vertex where another edge ends."""
    vertices = np.concatenate([path([0.0, 10.0, turn], [1.0, 1.0, length]), np.full((1, 3), 9.0)])
    chains = [((0, 1), (0, 1), True), ((1, 2), (0, 2), True), ((2, 3), (0, 3), True)]
    chains += [((vertex, 4), (1, 3), True) for vertex in others]
    shape = Chains.of(vertices, chains, np.tile([0.0, 0, 1], (4, 1)), np.ones(4))
    curves = np.array([True, True, False] + [False] * len(others))
    assert _along_lines(shape, curves, np.ones(len(chains), bool)).sum() == found
    assert not _along_lines(shape, curves, np.arange(len(chains)) != 2)[2]  # a smooth one is none


@pytest.mark.parametrize(
    ("turn", "length", "wall", "found"),
    [
        (6.0, 1.0, 0, True),
        (0.0, 1.0, 0, False),
        (59.0, 1.0, 0, True),
        (61.0, 1.0, 0, False),
        (6.0, 3.9, 0, True),
        (6.0, 4.1, 0, False),
        (6.0, 1.0, 5, False),
        (6.0, 1.0, -1, False),
    ],
)
def test_a_piece_that_goes_on_as_smooth_ones_that_turn_is_none_of_a_straight_edge(turn, length, wall, found):
    """Two smooth pieces between a plane and facets of surface 0, and one that is sharp: not in their line, not long.

    Nor beside another surface or plane; a smooth edge between two facets of the surface says nothing.
    """
    vertices = np.concatenate([path([0.0, 6.0, turn], [1.0, 1.0, length]), [[2.0, -1, 1]]])
    chains = [((i, i + 1), (0, i + 1), True) for i in range(3)] + [((2, 4), (2, 3), True)]
    shape = Chains.of(vertices, chains, np.tile([0.0, 0, 1], (4, 1)), np.ones(4))
    region, smooth = np.array([-1, 0, 0, wall]), np.array([True, True, False, True])
    assert turning(shape, region, smooth).tolist() == [False, False, found, False]
    assert not turning(shape, region, np.arange(4) == 3).any()
