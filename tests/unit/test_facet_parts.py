"""Boundaries of faces and what makes faces facets of a curved surface: steps of each, on made-up shapes."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.parts import facets, rims
from scenes.parts.chains import Chains


def ring(count, radius, centre=(0.0, 0.0), start=0.0):
    """Points of a circle in the plane z = 2, at uneven steps."""
    turn = start + 2 * np.pi * (np.arange(count) + 0.2 * np.sin(np.arange(count))) / count
    return np.column_stack([centre[0] + radius * np.cos(turn), centre[1] + radius * np.sin(turn), np.full(count, 2.0)])


def test_boundaries_run_counter_clockwise_around_the_face_the_outer_one_first():
    """A square plate with a triangular hole; what lies on a straight edge is left out, in any order of triangles."""
    outer = np.array([[0.0, 0], [8, 0], [8, 5], [0, 5]])
    inner = np.array([[2.0, 1], [3, 3], [5, 1]])  # clockwise
    extra = np.array([[4.0, 0]])  # on the first side
    points = np.concatenate([outer, inner, extra])
    vertices = np.column_stack([points, np.full(len(points), 3.0)])
    triangles = np.array([[0, 7, 4], [7, 6, 4], [7, 1, 6], [1, 2, 6], [6, 2, 5], [2, 3, 5], [5, 3, 4], [3, 0, 4]])
    kept = np.arange(8) != 7
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(len(triangles))
        found = rims.boundaries(triangles[order], kept, vertices, np.array([0.0, 0, 1]))
        assert [len(loop) for loop in found] == [4, 3]
        turned = [tuple(np.roll(loop, -int(np.argmin(loop)))) for loop in found]
        assert turned == [(0, 1, 2, 3), (4, 5, 6)]
    areas = [rims._area(vertices[list(loop)], np.array([0.0, 0, 1])) for loop in found]
    assert areas == pytest.approx([40.0, -3.0])
    assert rims._area(vertices[:2], np.array([0.0, 0, 1])) == 0
    below = rims.boundaries(triangles[:, ::-1], kept, vertices, np.array([0.0, 0, -1]))
    assert [len(loop) for loop in below] == [4, 3]


def test_boundaries_that_touch_in_a_corner_end_there():
    """Two triangles with one vertex in common: each is closed by itself."""
    points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [-3, 0, 0], [0, -3, 0]])
    found = rims.boundaries(np.array([[0, 1, 2], [0, 3, 4]]), np.ones(5, bool), points, np.array([0.0, 0, 1]))
    assert sorted(map(sorted, found)) == [[0, 1, 2], [0, 3, 4]]
    assert 0 in found[0]
    assert set(found[0]) == {0, 3, 4}  # the larger one first


def test_round_boundaries_of_twelve_pieces_are_circles():
    """Of fewer a polygon; a millionth of the radius off is nothing, a hundredth is too much."""
    many, few, wavy, fine = ring(12, 3.0, (1, 2)), ring(11, 3.0), ring(20, 3.0), ring(30, 2.0, (-4, 1))
    wavy[::2, 0] *= 1.01
    fine[::3, 1] += 1e-6
    vertices = np.concatenate([many, few, wavy, fine])
    starts = np.cumsum([0, 12, 11, 20, 30])
    loops = [tuple(range(a, b)) for a, b in pairwise(starts.tolist())]
    found = rims.rims([[loops[1]], [loops[2], loops[0]], [loops[3]]], vertices, np.tile([0.0, 0, 1], (3, 1)))
    assert [(each.face, each.loop) for each in found] == [(1, loops[0]), (2, loops[3])]
    assert found[0].centre == pytest.approx([1, 2, 2])
    assert [each.radius for each in found] == pytest.approx([3.0, 2.0], abs=2e-6)
    assert found[0].pieces == [*zip(range(11), range(1, 12), strict=True), (11, 0)]


@pytest.mark.parametrize(("step", "count"), [(0.0, 1), (0.0015, 1), (0.0044, 0)])
def test_two_arcs_of_nearly_one_radius_are_no_circle(step, count):
    """Half circles of 19.5 and of 1e-4 of it more, or 2e-4: vertices of one circle are as near as a file holds them."""
    loop = np.concatenate([ring(72, 19.5)[:37], ring(72, 19.5 + step)[36:], ring(72, 19.5 + step)[:1]])
    found = rims.rims([[tuple(range(len(loop)))]], loop, np.array([[0.0, 0, 1]]))
    assert len(found) == count


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (-2 / 3, 1 / 3, 2 / 3)])
def test_a_circle_through_points_of_any_plane(normal):
    """And how far the farthest and the nearest one are apart in radius."""
    normal = np.array(normal)
    one = np.cross(normal, [0.3, -0.5, 0.7])
    one /= np.linalg.norm(one)
    frame, middle = np.stack([one, np.cross(normal, one)]), np.array([3.0, -5.0, 0.5])
    flat = ring(15, 2.5)[:4, :2]
    centre, radius, off = rims.circle_through(middle + flat @ frame, normal)
    assert centre == pytest.approx(middle)
    assert (radius, off) == (pytest.approx(2.5), pytest.approx(0, abs=1e-9))
    square = np.array([[2.0, 0], [0, 1], [-2, 0], [0, -1]])
    centre, radius, off = rims.circle_through(middle + square @ frame, normal)
    assert centre == pytest.approx(middle)
    assert (radius, off) == (pytest.approx(1.5), pytest.approx(1.0))


def strip(widths, bends, convex=True, length=4.0):
    """Faces side by side along y, n + 1 of them, that bend at n parallel edges of a length."""
    turn = np.concatenate([[0.0], np.cumsum(bends)])
    normals = np.column_stack([np.zeros(turn.size), np.sin(turn), np.cos(turn)])
    steps = np.array(widths)[:, None] * np.column_stack([np.zeros(turn.size), np.cos(turn), -np.sin(turn)])
    places = np.cumsum(steps, 0)[:-1]
    vertices = np.concatenate([places, places + [length, 0, 0]])
    n = len(bends)
    convex = np.broadcast_to(convex, n)
    chains = [((i, n + i), (i, i + 1), bool(convex[i])) for i in range(n)]
    return vertices, chains, normals, length * np.array(widths, float)


def found(*parts, **more):
    return facets.facets(*strip(*parts, **more), ())


def sides(faces, along, bend=10.0, areas=(1.0,) * 9):
    """Chains between pairs of faces, in directions."""
    along, count = np.array(along, float), len(faces)
    length = np.linalg.norm(along, axis=1)
    bends, convex = np.full(count, np.radians(bend)), np.ones(count, bool)
    ends = np.arange(2 * count).reshape(-1, 2)
    return Chains(ends, np.array(faces), convex, along, length, bends, np.array(areas), 1e-6)


@pytest.mark.parametrize(("area", "is_sure"), [(4.9, False), (5.1, True)])
def test_a_triangle_beside_facets_that_is_about_as_narrow_is_no_plane_face(area, is_sure):
    """Face 0 beside facet 1; face 2 beside that triangle; at most 5 times as wide; one of four sides is a face."""
    rows = [(0, 1), (0, 2), (0, 3), (2, 4), (2, 5)]
    shape = sides(rows, [(1, 0, 0)] * 5, areas=[area, 1, area, 9, 9, 9])
    facet = np.arange(6) == 1
    assert facets._unsure(shape, facet).tolist() == [not is_sure, False, not is_sure, False, False, False]
    four = sides([*rows, (0, 5)], [(1, 0, 0)] * 6, areas=[area, 1, area, 9, 9, 9])
    assert not facets._unsure(four, facet).any()


@pytest.mark.parametrize(("turn", "is_chord"), [(28, False), (32, True), (78, True), (82, False)])
def test_a_side_of_a_last_triangle_is_a_chord_unless_bends_run_along_it_or_square_to_it(turn, is_chord):
    """Within 30 degrees of it, or 10 of the square: the facet is face 0; a side at 55 degrees says nothing."""
    ways = [(np.cos(a), np.sin(a), 0) for a in np.radians([0, turn, 125])]
    shape, facet = sides([(0, 1), (0, 2), (0, 3)], ways), np.arange(4) != 1
    smooth = np.array([False, True, True])
    assert facets._chords(shape, facet, smooth).tolist() == [is_chord, False, False]
    assert not facets._chords(shape, np.arange(4) > 0, smooth).any()


def test_four_bends_that_follow_each_other_are_a_curved_surface():
    """The outer faces are planes that it continues smoothly; three bends are a polygon's."""
    four = found([9, 1, 1.2, 0.9, 7], np.radians([20, 21, 22, 19]))
    assert four.region.tolist()[1] == four.region.tolist()[2] == four.region.tolist()[3] >= 0
    assert four.region[[0, 4]].tolist() == [-1, -1]
    assert four.smooth.tolist() == [True] * 4
    assert not four.rim.any()
    three = found([9, 1, 1.2, 7], np.radians([20, 21, 22]))
    assert three.region.tolist() == [-1] * 4
    assert not three.smooth.any()


def test_a_bend_of_32_degrees_ends_a_curve():
    some = found([9, 1, 1, 1, 1, 1, 7], np.radians([20, 20, 20, 20, 32, 20]))
    assert (some.region >= 0).tolist() == [False, True, True, True, False, False, False]
    assert some.smooth.tolist() == [True] * 4 + [False] * 2
    assert (found([9, 1, 1, 1, 1, 1, 7], np.radians([20, 20, 20, 20, 30.9, 20])).region >= 0).sum() == 5


def test_a_face_that_is_much_wider_than_both_beyond_is_no_facet():
    """More than five times as wide as either. One that bends the other way ends it, too."""
    bends = np.radians([15.0] * 8)
    wide = found([9, 1, 1, 1, 5.1, 1, 1, 1, 9], bends)
    assert wide.region[4] == -1
    assert wide.region[3] != wide.region[5]
    assert (wide.region[[1, 2, 3, 5, 6, 7]] >= 0).all()
    assert len(set(found([9, 1, 1, 1, 4.9, 1, 1, 1, 9], bends).region[1:8])) == 1
    assert len(set(found([9, 1, 1, 1, 5.1, 1.1, 1, 1, 9], bends).region[1:8])) == 1
    other = found([9, 1, 1, 1, 1, 1, 1, 1, 9], bends, [True] * 4 + [False] * 4)
    assert other.region[4] == -1
    assert other.region[3] != other.region[5]


def test_an_end_is_smooth_that_bends_little_more_than_the_curve():
    """A quarter more than the largest bend beside it."""
    for factor, is_smooth in ((1.2, True), (1.3, False)):
        some = found([9, 1, 1, 1, 1, 7], np.radians([10 * factor, 10, 10, 10, 10]))
        assert some.smooth.tolist() == [is_smooth] + [True] * 4


@pytest.mark.parametrize(("factor", "is_smooth"), [(1.58, True), (1.62, False)])
def test_where_bends_are_slight_an_end_may_bend_by_more_than_half_as_much_again(factor, is_smooth):
    """1.6 times: the steps of a curve may be unequal."""
    some = found([9, 1, 1, 1, 1, 7], np.radians([7 * factor, 7, 7, 7, 7]))
    assert some.smooth.tolist() == [is_smooth] + [True] * 4


@pytest.mark.parametrize(("bend", "is_smooth"), [(0.98, True), (1.02, False)])
def test_planes_that_bend_by_less_than_a_degree_are_joined_smoothly(bend, is_smooth):
    some = found([9, 7, 8], np.radians([bend, 40.0]))
    assert some.smooth.tolist() == [is_smooth, False]
    assert some.region.tolist() == [-1] * 3


@pytest.mark.parametrize(
    ("bend", "last", "width", "is_facet"),
    [
        (10.0, 7.1, 1.0, True), (10.0, 6.9, 1.0, False), (10.0, 10.0, 1.45, True), (10.0, 10.0, 1.55, False),
        (10.0, 8.7, 1.45, True), (10.0, 8.4, 1.45, False), (4.5, 2.9, 1.0, True), (4.5, 3.1, 1.0, False),
    ],
)  # fmt: skip
def test_a_last_facet_is_as_wide_and_bends_as_much_as_those_before(bend, last, width, is_facet):
    """At most 1.5 times as wide, at least 0.7 of the curvature (bend over both widths) or 3 degrees; at either end."""
    for way in (1, -1):
        some = found([9, 1, 1, 1, 1, width][::way], np.radians([bend] * 4 + [last])[::way])
        assert some.smooth.all()
        assert (some.region[::way] >= 0).tolist() == [False] + [True] * 4 + [is_facet]


def bends(*parts):
    return np.radians(np.concatenate(parts))


@pytest.mark.parametrize(("width", "is_round"), [(1.2, True), (1.3, False)])
def test_a_coarse_surface_is_a_polygon_beside_finer_ones(width, is_round):
    """Five times as high over its chords as they: 20 degrees on so wide faces beside 5 degrees on faces of 1."""
    some = found([9, 1, 1, 1, 1, 90, *[width] * 4, 90], bends([5.0] * 5, [20.0] * 5))
    assert (some.region[1:5] >= 0).all()
    assert (some.region[6:10] >= 0).tolist() == [is_round] * 4
    assert some.smooth.tolist() == [True] * 5 + [is_round] * 5
    alone = found([90, *[width] * 4, 90], bends([20.0] * 5))
    assert (alone.region[1:5] >= 0).all()


@pytest.mark.parametrize(("bend", "is_round"), [(19.0, True), (21.0, False)])
def test_two_bends_that_are_much_higher_than_their_surface_are_edges(bend, is_round):
    """Ten times as high over their chords as three quarters of the others, and of more than 12 degrees."""
    some = found([9, *[1.0] * 17, 9], bends([2.0] * 8, [bend] * 2, [2.0] * 8))
    assert some.smooth.tolist() == [True] * 8 + [is_round] * 2 + [True] * 8
    assert (len(set(some.region[1:18].tolist())) == 1) is is_round


@pytest.mark.parametrize("short", [1e-3, 0.1])
def test_a_border_in_two_pieces_is_as_long_as_both(short):
    """20 degrees between faces of 1, whose borders are a piece of 4 and a short one, beside 5 degrees on the same."""
    vertices, chains, normals, areas = strip([9, 1, 1, 1, 1, 90, *[1.0] * 4, 90], bends([5.0] * 5, [20.0] * 5))
    vertices = np.concatenate([vertices, vertices[10:] + [short, 0, 0]])
    chains += [((10 + i, 20 + i), *chains[i][1:]) for i in range(5, 10)]
    some = facets.facets(vertices, chains, normals, areas, ())
    assert (some.region >= 0).tolist() == [False, *[True] * 4, False, *[True] * 4, False]
    border = Chains.of(vertices, chains, normals, areas).border
    assert border == pytest.approx([4.0] * 5 + [4 + short] * 10)


@pytest.mark.parametrize(("bend", "is_round"), [(10.8, True), (11.2, False)])
def test_one_bend_that_stands_out_by_ten_times_is_an_edge(bend, is_round):
    """However little it is: 1.1 degrees before and behind."""
    some = found([9, *[1.0] * 15, 9], bends([1.1] * 8, [bend], [1.1] * 7))
    assert some.smooth.tolist() == [True] * 8 + [is_round] + [True] * 7


def test_pieces_of_a_circles_edge_and_the_bends_of_its_wall():
    """Where two of its walls meet in an edge; what belongs to both is no rim."""
    loop = (0, 1, 2)
    rim = rims.Rim(0, loop, np.zeros(3), 1.0)
    chains = [((1, 0), (0, 1), True), ((1, 2), (2, 0), True), ((2, 0), (0, 3), True), ((1, 4), (1, 2), True),
              ((2, 5), (3, 2), True), ((0, 6), (1, 3), True), ((4, 5), (2, 4), True)]  # fmt: skip
    around, edging = facets._of_rims(chains, [rim], [[0, 1, 2]])
    assert edging.tolist() == [True] * 3 + [False] * 4
    assert around.tolist() == [False] * 3 + [True] * 3 + [False]
    nothing = facets._of_rims(chains, [], [])
    assert not nothing[0].any()
    assert not nothing[1].any()


def test_what_a_bend_is_sure_of_is_less_by_what_single_precision_moves_a_sliver():
    """The longest edge of each of both faces over its area, at most 10 degrees; height over chords by the smaller."""
    vertices = np.array([[0.0, 0, 0], [200, 0, 0], [0, 1, 0], [200, 1, 0]])
    chains = [((0, 1), (0, 1), True), ((2, 3), (1, 2), True), ((0, 2), (2, 3), False)]
    normals = np.array([[0, 0, 1.0], [0, 0.2, 1], [0, 0.5, 1], [0.3, 0, 1]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    areas = np.array([50.0, 0.4, 80.0, 1e-5])
    shape = Chains.of(vertices, chains, normals, areas)
    bend = np.arccos(np.clip([normals[a] @ normals[b] for a, b in ((0, 1), (1, 2), (2, 3))], -1, 1))
    assert shape.bend == pytest.approx(bend)
    one = 3e-7 * 200
    moved = [one * (200 / 50 + 200 / 0.4), one * (200 / 0.4 + 200 / 80), np.radians(10.0)]
    assert shape.certain == pytest.approx(bend - moved)
    assert shape.height == pytest.approx(bend * [0.4 / 200, 0.4 / 200, 1e-5] / 8)
    assert (shape.unsure, shape.length.tolist()) == (pytest.approx(2 * one), [200.0, 200.0, 1.0])


@pytest.mark.parametrize(
    ("bend", "smooth", "of_surface", "loose"),
    [
        (30.9, 2, False, True),
        (31.1, 2, False, False),
        (61.9, 2, True, True),
        (62.1, 2, True, False),
        (20.0, 1, False, False),
    ],
)
def test_an_edge_that_ends_within_a_surface_is_none_and_neither_is_what_it_follows(bend, smooth, of_surface, loose):
    """Where at least two smooth pieces meet it; not one that bends by more than 31 degrees, 62 between facets."""
    within = [(1, 10), (1, 11)][:smooth]  # at one end of the first edge
    edges = [(0, 1), (0, 2), (2, 3), (2, 4)]  # a way of two, which ends where two others meet
    ends = np.array([*edges, *within, (0, 12), (0, 13)])
    shape = SimpleNamespace(
        ends=ends,
        bend=np.radians([bend, 25.0, 40.0, 40.0] + [5.0] * (len(ends) - 4)),
        faces=np.array([[0, 1]] + [[1, 2]] * (len(ends) - 1)),
    )
    kept = facets._dangling(shape, np.arange(len(ends)) < 4, np.array([of_surface] * 2 + [False]))
    assert kept.tolist() == [loose, loose] + [False] * (len(ends) - 2)


def test_small_triangles_beside_a_curved_surface_are_parts_of_it():
    """Faces 1 and 2 fill what is left beside facet 0; 3 is a plane, 4 another surface's."""
    shape = sides([(0, 1), (1, 2), (2, 3), (3, 4)], np.eye(3)[[0, 0, 0, 0]])
    filled = facets._filled(shape, np.array([7, -1, -1, -1, 8]), np.array([True, True, False, False]))
    assert filled.tolist() == [7, 7, 7, -1, 8]
