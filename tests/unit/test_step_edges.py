"""Straight edges of a STEP file's part: which facets' edges are theirs, and which faces are of one surface."""

import numpy as np
import pytest

from scenes.parts.step import StepEdge, StepPart
from scenes.parts.surfaces import Cylinder, Plane

CORNERS = np.array([[[0.0, 0, 0], [20, 0, 0], [0, 20, 0]]])
AXIS = np.array([0.6, 0, 0.8])
BORE = Cylinder((1.0, 2, 3), AXIS, 4.0, (0, 5), True)


def part(surfaces=(), edges=()):
    return StepPart(("",) * len(surfaces), tuple(surfaces), tuple(edges), CORNERS, np.zeros(1, int))


@pytest.mark.parametrize(
    ("other", "is_one"),
    [
        (Cylinder(BORE.point + 7 * AXIS, -AXIS, 4.0, (0, 2), True), True),
        (Cylinder(BORE.point + 7 * AXIS, AXIS, 4.0, (0, 2), False), False),
        (Cylinder(BORE.point, AXIS, 4.0001, (0, 5), True), False),
        (Cylinder(BORE.point + [0, 1e-4, 0], AXIS, 4.0, (0, 5), True), False),
        (Cylinder(BORE.point, AXIS + [0, 1e-5, 0], 4.0, (0, 5), True), False),
    ],
    ids=["along", "outer", "wider", "aside", "tilted"],
)
def test_faces_of_one_cylinder_are_of_one_surface_wherever_they_are(other, is_one):
    found = part([Plane((0, 0, 0), (0, 0, 1)), BORE, other])._coaxial(2e-5)
    assert {frozenset(pair) for pair in found} == ({frozenset((1, 2))} if is_one else set())


def test_a_straight_piece_begins_and_ends_on_straight_edges():
    """Two edges in a line with nothing between; a facet of a spline may lie in the line of one, beyond its end."""

    def edge(first, last, straight=True, bend=1.0):
        ends = np.array([[first, 0.0, 0], [last, 0, 0]])
        return StepEdge("line" if straight else "other", (0, 1), ends, None, None, (), bend, straight)

    some = part(edges=[edge(0, 5), edge(5, 8), edge(8, 12, straight=False), edge(12, 15, bend=0.001)])
    ends = [[0, 5], [0, 8], [2, 7], [0, 8.0001], [-1, 5], [8, 12], [12, 15]]
    chains = np.array([[[first, 0.0, 0], [last, 0, 0]] for first, last in ends])
    assert some._between_ends(chains, 1e-5).tolist() == [True] * 3 + [False] * 4
