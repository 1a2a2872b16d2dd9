"""Which edges of a mesh are the part's: on parts whose edges are known from how they were made."""

from itertools import pairwise

import numpy as np
import pytest
import trimesh

import scenes
from imaging.blurred import boundaries
from imaging.pictures import Pictures
from scenes.parts import cones, mesh, rims
from scenes.parts.chains import SINGLE, Chains
from scenes.parts.cones import Axial
from scenes.parts.joined import joined
from scenes.parts.recognised import cylinders
from scenes.parts.solid import assembled, block
from tests.parts import prism


def in_file(made):
    """In single precision, turned in space."""
    turn = trimesh.transformations.rotation_matrix(0.7, [1, -2, 3], [4, 5, 6])
    made.apply_transform(turn)
    made.vertices = made.vertices.astype(np.float32).astype(float)
    return mesh.solid(made), turn


def lengths(solid):
    return sorted(round(solid.length(edge), 4) for edge in solid.sharp)


def bumpy(steps=40, height=1.5):
    """A block of 40 x 30 whose upper side is z = 10 + h sin(x / 6) cos(y / 5), a surface that bends both ways."""
    x, y = np.meshgrid(np.linspace(0, 40, steps + 1), np.linspace(0, 30, steps + 1), indexing="ij")
    made = trimesh.creation.box((40, 30, 10))
    made.apply_translation((20, 15, 5))
    top = np.stack([x, y, 10 + height * np.sin(x / 6) * np.cos(y / 5)], -1)
    low = top * [1, 1, 0]
    quads = [(top, False), (low, True)]
    for line, along in ((0, True), (-1, False)):
        quads += [
            (np.stack([low[line], top[line]]), not along),
            (np.stack([low[:, line], top[:, line]]), along),
        ]
    triangles = [_cut(grid, flip) for grid, flip in quads]
    found = trimesh.Trimesh(**trimesh.triangles.to_kwargs(np.concatenate(triangles)))
    found.merge_vertices()
    found.fix_normals()
    return found


def _cut(grid, flip):
    """Triangles of a grid of points (n, m, 3)."""
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    found = np.concatenate([np.stack([a, b, c], -2), np.stack([a, c, d], -2)]).reshape(-1, 3, 3)
    return found[:, ::-1] if flip else found


@pytest.mark.parametrize("steps", [17, 40])
def test_a_surface_that_bends_both_ways_has_no_edges_inside(steps):
    """Left are the block's four upright edges and four below, and the one at x = 0, where it is straight."""
    solid, _ = in_file(bumpy(steps))
    expected = [30.0, 30.0, 30.0, 40.0, 40.0]
    upright = [10 + 1.5 * np.sin(x / 6) * np.cos(y / 5) for x in (0, 40) for y in (0, 30)]
    # margin: places of a file in single precision, or as it was divided
    assert lengths(solid) == pytest.approx(sorted(expected + upright), abs=1e-4)
    assert sum(solid.plane) == 5


def half_of_a_cone(rows=(0.0, 4.0, 7.0, 10.0), counts=(20, 23, 19, 26), aside=0.0):
    """Half a cone's trunk, radii 5 below and 3 above, cut through its axis; its facets differ from row to row.

    Less than half where it is cut ``aside`` of its axis, in a hyperbola on either side.
    """
    rings = []
    for z, count in zip(rows, counts, strict=True):
        radius = 5 - 0.2 * z
        angle = np.linspace(np.arcsin(aside / radius), np.pi - np.arcsin(aside / radius), count + 1)
        rings.append(np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count + 1, z)]))
    triangles = []
    for low, high in pairwise(rings):
        i = j = 0
        while i < len(low) - 1 or j < len(high) - 1:
            if j == len(high) - 1 or (i < len(low) - 1 and (i + 1) / len(low) <= (j + 1) / len(high)):
                triangles.append([low[i], low[i + 1], high[j]])
                i += 1
            else:
                triangles.append([low[i], high[j + 1], high[j]])
                j += 1
        triangles += [[low[0], high[0], high[-1]], [low[0], high[-1], low[-1]]]
    for ring, flip in ((rings[0], True), (rings[-1], False)):
        fan = [[ring[0], ring[k], ring[k + 1]] for k in range(1, len(ring) - 1)]
        triangles += [each[::-1] for each in fan] if flip else fan
    found = trimesh.Trimesh(**trimesh.triangles.to_kwargs(np.array(triangles)))
    found.merge_vertices()
    found.fix_normals()
    return found


def test_a_straight_edge_of_a_curved_surface_is_one_whatever_divides_it():
    """Two along the cone, of sqrt(10^2 + 2^2), and those of the flat side below and above; no others."""
    solid, turn = in_file(half_of_a_cone())
    # margin: places of a file in single precision, or as it was divided
    assert lengths(solid) == pytest.approx([6, 10, np.hypot(10, 2), np.hypot(10, 2)], abs=1e-4)
    corners = np.array([[x, 0, z] for x, z in ((-5, 0), (5, 0), (-3, 10), (3, 10))])
    there = trimesh.transformations.transform_points(corners, turn)
    found = solid.vertices[[solid.vertex_names.index(name) for name in solid.corner_names]]
    assert len(found) == 4
    assert np.linalg.norm(found[:, None] - there, axis=-1).min(0).max() < 1e-5
    inner = [edge for edge in solid.edges if edge.kind == "rim"]
    assert len(inner) == 20 + 26  # both half circles


@pytest.mark.parametrize(("aside", "straight"), [(0.0, 2), (0.3, 0), (2.0, 0)])
def test_one_chord_for_a_curve_on_a_cone_is_no_straight_edge(aside, straight):
    """Through the axis a plane cuts a cone in straight lines, aside of it in curves; below and above are lines."""
    solid, _ = in_file(half_of_a_cone((0.0, 10.0), (20, 26), aside))
    ends = [2 * np.sqrt(radius**2 - aside**2) for radius in (3, 5)]
    # margin: places of a file in single precision
    assert lengths(solid) == pytest.approx(sorted([*ends, *[np.hypot(10, 2)] * straight]), abs=1e-4)


@pytest.mark.parametrize("slope", [0.0, -0.02, 0.3, 2.0])
def test_a_cone_or_cylinder_through_places_in_single_precision(rng, slope):
    """50 places on two thirds of a turn; the middles of chords are off it. Too few tell none."""
    turn, along = rng.uniform(0, 4, 50), rng.uniform(-1, 1, 50)
    frame = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    outward = np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1)
    points = (7 + slope * along)[:, None] * outward + along[:, None] * [0, 0, 1.0]
    normals = (outward - [0, 0, slope]) / np.hypot(1, slope)
    points, normals = (points @ frame.T + [20.0, -5, 3]).astype(np.float32).astype(float), normals @ frame.T
    found = Axial.through(points, normals)
    unsure = 2 * SINGLE * np.abs(points).max()
    assert np.abs(found.off(points)).max() < unsure / 2
    assert abs(found.axis @ frame[:, 2]) == pytest.approx(1, abs=1e-9)
    assert abs(np.tan(found.angle)) == pytest.approx(abs(slope), abs=1e-5)  # margin: of single precision
    here = found.axis @ ([20, -5, 3] - found.point)
    assert found.apart / np.cos(found.angle) + np.tan(found.angle) * here == pytest.approx(7, abs=1e-5)
    apart = np.arange(50) != np.argsort(turn)[::-1]
    chords = (points + points[np.argsort(turn)[::-1]])[apart] / 2
    assert (found.off(chords) < unsure / 2).all()
    assert np.median(found.off(chords)) < -0.1
    assert Axial.through(points[:7], normals[:7]) is None


@pytest.mark.parametrize(("slope", "turn", "is_chord"), [(18.1, 0.05, True), (18.1, 0.002, False), (1e9, 0.05, False)])
def test_a_chord_of_a_cone_nearly_flat_is_told_from_a_narrow_piece_of_it(slope, turn, is_chord):
    """A plane 20 from the axis cuts a slope of 3 degrees 0.0014 below its chord, if that is 2 wide; a plane has none.

    The piece is 9 long and as wide, which tells the cone ill, and where the chord's middle should be well.
    """
    angle = np.array([-1.0, -0.5, 0.5, 1.0] * 2 + [0.0]) * turn
    radius = np.array([20 / np.cos(angle[:4]), np.full(4, 11.0)]).ravel().tolist() + [11.0]
    outward = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    corners = outward * np.array(radius)[:, None] + [0, 0, 1.0] * (9 - np.array(radius)[:, None] / slope)
    normals = (outward / slope + [0, 0, 1.0]) / np.hypot(1, 1 / slope)
    single = SINGLE * np.abs(corners).max()
    corners = corners.astype(np.float32).astype(float)
    told = cones._beside(corners, normals, corners[[[0, 3]]], single)
    assert (told is not None and bool(told[0])) == is_chord


def test_chords_are_told_by_the_facets_next_to_them_where_a_surface_goes_on_as_another():
    """Ten facets of a cylinder that goes on smoothly, as files tell it, in facets that lie on none."""
    turn, count = np.linspace(0, 1, 11), 10
    ring = np.stack([5 * np.cos(turn), 5 * np.sin(turn), 0 * turn], -1)
    vertices = np.concatenate([ring, ring + [0, 0, 3.0], [[9, 9, 0], [8, 9.7, 1.7]]])
    middle = (turn[1:] + turn[:-1]) / 2
    normals = np.stack([np.cos(middle), np.sin(middle), 0 * middle], -1)
    normals = np.concatenate(
        [normals, [[np.cos(1.25), np.sin(1.25), 0], [0, 0, -1.0]]]
    )  # what goes on, and the plane below
    rulings = [((i + 1, i + 12), (i, i + 1), True) for i in range(count)]
    borders = [((i, i + 1), (i, 11), True) for i in range(count)]
    beyond = [((22, 23), (10, 11), True)]
    chains = rulings + borders + beyond
    shape = Chains.of(vertices, chains, normals, np.full(12, 1.5))
    smooth = np.arange(len(chains)) < count
    region = np.array([0] * 11 + [-1])
    found = cones.chords(vertices, shape, normals, region, smooth, ~smooth)
    assert found.tolist() == [False] * count + [True] * count + [False]


@pytest.mark.parametrize(("sides", "is_chord"), [(4, True), (5, False)])
def test_facets_on_both_sides_of_one_that_is_too_wide_tell_its_chord(sides, is_chord):
    """Two of a cone, one three times as wide and two more; a plane of five sides would be none of its facets."""
    turn = np.array([0.0, 0.1, 0.2, 0.5, 0.6, 0.7])
    outward = np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1)
    vertices = np.concatenate([5 * outward, 6 * outward + [0, 0, 3.0]])
    middle = (turn[1:] + turn[:-1]) / 2
    normals = np.stack([3 * np.cos(middle), 3 * np.sin(middle), 0 * middle - 1], -1) / np.sqrt(10)
    normals = np.concatenate([normals, [[0.0, 0, -1], [1, 0, 0]]])
    rulings = [((i + 1, i + 7), (i, i + 1), True) for i in range(4)]
    borders = [((i, i + 1), (i, 5), True) for i in range(5)]
    others = [((8, 9), (2, 6), True)] * (sides - 3)
    shape = Chains.of(vertices, rulings + borders + others, normals, np.full(7, 1.5))
    number = np.arange(len(shape.ends))
    found = cones.chords(
        vertices, shape, normals, np.array([0, 0, -1, 1, 1, -1, -1]), number < 4, (number >= 4) & (number < 9)
    )
    assert found[6] == is_chord


def test_pieces_are_joined_between_the_same_surfaces_alone():
    """Along x: two pieces of one region, then one of another, then one that turns away."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0], [4, 0, 0], [5, 0.01, 0]])
    chains = [((0, 1), (0, 1), True), ((2, 1), (0, 2), True), ((2, 3), (0, 3), True), ((3, 4), (0, 3), True)]
    normals = np.array([[0, 0, 1.0], [0, -1, 0.01], [0, -1, 0.2], [0, -1, 0.3]])
    region = np.array([-1, 5, 5, 6])
    found = joined(vertices, chains, normals, region, np.array([True] * 4))
    assert [(sorted(ends), faces) for ends, faces, _ in found] == [([0, 2], (0, 2)), ([2, 3], (0, 3)), ([3, 4], (0, 3))]
    some = joined(vertices, chains, normals, region, np.array([True, False, True, True]))
    assert [sorted(ends) for ends, *_ in some] == [[0, 1], [2, 3], [3, 4]]
    flat = np.array([[0, 0, 1.0], [0, -1, 0], [0, -1, 0], [0, -0.8, 0.6]])
    facets = joined(vertices, chains, flat, np.array([-1, 5, 6, 7]), np.array([True] * 4))
    assert [sorted(ends) for ends, *_ in facets] == [[0, 2], [2, 3], [3, 4]]  # in one plane, whatever they are of
    plane = joined(vertices, chains, flat, np.full(4, -1), np.array([True] * 4))
    assert [sorted(ends) for ends, *_ in plane] == [[0, 2], [2, 3], [3, 4]]


@pytest.mark.parametrize(("aside", "second", "count"), [(3.4e-6, True, 1), (3.8e-6, True, 2), (0.0, False, 2)])
def test_pieces_are_one_where_single_precision_tells_no_turn_and_both_bend_alike(aside, second, count):
    """The shorter's end off the longer's line by 2 x 3e-7 of the largest coordinate, 3; both bend outwards."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [3, aside, 0]])
    chains = [((0, 1), (0, 1), True), ((2, 1), (1, 0), second)]
    normals = np.array([[0, 0, 1.0], [0, -1, 0]])
    assert len(joined(vertices, chains, normals, np.full(2, -1), np.array([True] * 2))) == count


def test_pieces_that_lie_upon_each_other_are_not_joined_with_what_goes_on():
    """As where walls without thickness meet: it is not said which of the two goes on; what lies beyond is joined."""
    vertices = np.array([[0.0, 0, 0], [2, 0, 0], [5, 0, 0], [6, 0, 0], [8, 0, 0]])
    pieces = (0, 2), (1, 2), (2, 3), (3, 4)
    chains = [(ends, (0, 1), True) for ends in pieces]
    normals = np.array([[0.0, 0, 1], [0, -1, 0]])
    found = joined(vertices, chains, normals, np.full(2, -1), np.array([True] * 4))
    assert sorted(tuple(sorted(chain[0])) for chain in found) == [(0, 2), (1, 2), (2, 4)]


def arc(centre, radius, start, stop, steps):
    angle = np.radians(np.linspace(start, stop, steps + 1))
    return [(centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a)) for a in angle]


def test_a_polygon_beside_curves_that_are_divided_finely_is_one():
    """The same corner of three bends of 30 degrees is round by itself, and planes where another one has 40 steps."""
    coarse, fine = arc((56, 8), 4, 0, 90, 3), arc((4, 8), 4, 90, 180, 40)
    alone = mesh.solid(prism([(0, 0), (60, 0), *coarse, (0, 12)], 40.0))
    beside = mesh.solid(prism([(0, 0), (60, 0), *coarse, *fine], 40.0))
    assert len(alone.sharp) == 11  # of a block's twelve edges one is rounded
    upright, ends = 2 + 4, 2 * (4 + 3)  # edges along the prism, and sides of both its ends
    assert len(beside.sharp) == upright + ends
    assert sum(beside.plane) == 2 + 4 + 3


def test_planes_that_a_fillet_continues_are_planes_and_the_fillet_a_cylinder():
    """A quarter of a cylinder of 4 mm between two planes, hollow where the corner is an inner one."""
    outer = prism([(0, 0), (60, 0), *arc((56, 8), 4, 0, 90, 12), (0, 12)], 40.0)
    solid, _ = in_file(outer)
    assert sum(solid.plane) == 6
    (found,) = cylinders(solid)
    assert found.surface.radius == pytest.approx(4, abs=1e-5)
    assert (found.surface.hollow, round(found.turn_deg), len(found.faces)) == (False, 90, 12)
    assert found.residual < 1e-5


def test_a_chord_cuts_no_circle_off():
    """All the vertices of a D lie on its circle; those of a circle in unequal steps are one."""
    angle = np.linspace(0, 2 * np.pi, 61)[:-1]
    circle = np.column_stack([3 * np.cos(angle), 3 * np.sin(angle), 0 * angle])
    whole, normal = tuple(range(60)), np.array([[0.0, 0, 1]])
    assert len(rims.rims([[whole]], circle, normal)) == 1
    assert len(rims.rims([[whole[:3] + whole[7:]]], circle, normal)) == 1  # 30 degrees among steps of 6
    assert rims.rims([[whole[:45]]], circle, normal) == []
    assert rims.rims([[whole[:50]]], circle, normal) == []


def test_boundaries_that_pass_through_one_vertex_are_two():
    """A round hole that touches the side of a square face, as left where a bore is as wide as its pocket."""
    angle = np.linspace(0, 2 * np.pi, 25)[:-1]
    hole = np.column_stack([2 + 2 * np.cos(angle), 3 + 2 * np.sin(angle)])  # touches x = 0 in (0, 3), its vertex 12
    outer = np.array([[0.0, 0], [8, 0], [8, 6], [0, 6]])
    after = {0: [1], 1: [2], 2: [3], 3: [16], 16: [0]}
    rows = 4 + np.arange(24)
    for here, onward in zip(rows, np.roll(rows, 1), strict=True):
        after.setdefault(int(here), []).append(int(onward))
    points = np.concatenate([outer, hole])
    assert points[16] == pytest.approx([0, 3])
    for order in (1, -1):
        ways = {here: onward[::order] for here, onward in after.items()}
        found = sorted(rims.simple_loops(ways), key=len)
        assert [sorted(loop) for loop in found] == [[0, 1, 2, 3, 16], sorted(rows.tolist())]


def test_regions_of_several_solids_stay_apart():
    rod = mesh.solid(trimesh.creation.cylinder(2.0, 5.0, sections=24))
    both = assembled(rod, rod, block((1, 1, 1)))
    assert both.plane.tolist() == [*rod.plane, *rod.plane, *[True] * 6]
    assert len(set(both.regions[~both.plane])) == 2


def test_bends_of_a_round_wall_are_boundaries_where_one_side_is_hidden():
    """Of the bracket's bore, 96 pieces, those are left at which it turns away from the sensor; coarse ones are all."""
    scene = scenes.load("bracket_mm")
    solid = scene.solid
    smooth = np.array([edge.kind == "smooth" for edge in solid.edges])
    assert [edge.name in solid.slight for edge in solid.edges] == smooth.tolist()
    assert not mesh.solid(trimesh.creation.cylinder(3, 10, sections=48)).slight  # 7.5 degrees
    pictures = Pictures.of(scene, np.array([[40.0, 30.0]]), np.array([[30.0, 100.0]]))
    names = (solid.sharp[0].name,)
    places = boundaries.Places(names, np.array([[[0.1, 0.9]]]), np.zeros((1, 1, 2, 2, 2)), np.zeros((1, 1, 2, 2, 2)))
    _, _, other = boundaries._pairs(pictures, places, 1e5)
    away = pictures.sensor_at[0] - solid.vertices[[edge.ends[0] for edge in solid.edges]]
    faces = np.array([edge.faces for edge in solid.edges])
    seen = np.einsum("efi,ei->ef", solid.normals[faces], away) > 0
    wanted = np.flatnonzero(np.where(smooth, seen.sum(1) == 1, seen.any(1)))
    assert sorted(other.tolist()) == wanted.tolist()
    assert 0 < sum(smooth[wanted]) < 10  # two bores turn away twice each
