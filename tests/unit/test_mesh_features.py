"""Faces, edges and circles of meshes against the dimensions that the parts were made with."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh

from scenes import InvalidInput
from scenes.parts import mesh
from tests.parts import Hole, bracket, evenly, prism, unevenly


def through_a_file(made, folder, suffix="stl"):
    """As it comes from a file, in single precision."""
    path = folder / f"part.{suffix}"
    made.export(path)
    return mesh.read(path)


def planes(solid):
    """Directions and offsets of its plane faces that are no facets of a hole's wall."""
    walls = {face for edge in solid.edges if edge.kind == "smooth" for face in edge.faces}
    faces = [f for f in range(len(solid.faces)) if f not in walls]
    return np.column_stack([solid.normals[faces], solid.offsets[faces]])


@pytest.mark.parametrize("case", range(30))
def test_random_plates_and_brackets_with_holes(case, tmp_path):
    """Counts, places and sizes from the dimensions; rims of 12 to 120 unequal steps; to 1e-6 of the size."""
    rng = np.random.default_rng(case)
    length, width, height = size = rng.uniform([40, 25, 6], [120, 80, 20])
    step, low = (0.6 * length, 0.5 * height) if case % 2 else (length, height)
    profile = [(0, 0), (length, 0), (length, low), *([(step, low), (step, height)] if case % 2 else []), (0, height)]
    holes = []
    for left, right, top in ((0, step, height), (step, length, low)):
        if right > left:
            at = (left + right) / 2, width * rng.uniform(0.4, 0.6)
            radius = 0.25 * min(right - left, width) * rng.uniform(0.4, 1)
            holes.append(Hole(*at, radius, unevenly(rng, int(rng.integers(12, 121))), 0.0, top))
    made = prism(profile, width, holes, seed=case)
    solid = through_a_file(made, tmp_path, ("stl", "ply", "obj")[case % 3])
    exact = 1e-6 * max(size)
    assert (len(solid.sharp), len(solid.corner_names)) == (3 * len(profile), 2 * len(profile))
    assert len(planes(solid)) == len(profile) + 2
    corners = solid.vertices[[solid.vertex_names.index(name) for name in solid.corner_names]]
    expected = np.array([(x, y, z) for x, z in profile for y in (0, width)])
    assert np.abs(corners[:, None] - expected[None]).max(-1).min(1).max() < exact
    assert len(solid.circles) == 2 * len(holes)
    for hole in holes:
        for level in (hole.bottom, hole.top):
            away = [np.linalg.norm(circle.centre - [hole.x, hole.y, level]) for circle in solid.circles]
            circle = solid.circles[int(np.argmin(away))]
            assert min(away) < exact
            assert abs(circle.radius - hole.radius) < exact
            assert circle.hole
            assert np.abs(circle.axis - [0, 0, -1 if level == 0 else 1]).max() < 1e-6
            assert len(circle.edges) == len(hole.angles)
    kinds = [edge.kind for edge in solid.edges]
    assert kinds.count("rim") == 2 * kinds.count("smooth") == 2 * sum(len(hole.angles) for hole in holes)


def test_the_bracket_of_several_hundred_mesh_edges(tmp_path):
    made = bracket(96, seed=1)
    solid = through_a_file(made, tmp_path)
    assert len(made.edges_unique) > 1000
    assert [edge.name for edge in solid.sharp] == [f"e{i}" for i in range(1, 22)]
    assert [edge.name for edge in solid.sharp if not edge.convex] == ["e13"]  # at the foot of the step
    assert [round(circle.radius, 5) for circle in solid.circles] == [4, 4, 5, 5]
    assert sorted(map(len, solid.holes), reverse=True)[:4] == [2, 1, 1, 0]  # bottom, and both upper faces
    assert solid.edge("c1.1").kind == "rim"


def rounded(steps, radius=4.0):
    """A block of 60 x 40 x 12 with one long edge rounded by a quarter of a cylinder."""
    turn = np.linspace(0, np.pi / 2, steps + 1)
    arc = [(60 - radius + radius * np.cos(a), 12 - radius + radius * np.sin(a)) for a in turn]
    return prism([(0, 0), (60, 0), *arc, (0, 12)], 40.0)


@pytest.mark.parametrize("steps", [3, 8, 40])
def test_a_fillet_has_no_sharp_edges_of_its_own(steps):
    """Its facets, and where it runs into the planes beside it, are smooth; its ends are curved: 11 are left."""
    solid = mesh.solid(rounded(steps))
    assert len(solid.sharp) == 11
    kinds = [edge.kind for edge in solid.edges]
    assert (kinds.count("smooth"), kinds.count("rim")) == (steps + 1, 2 * steps)


def disc(*rim, sections=72):
    """A disc of radius 10 and height 6 whose upper rim goes through some places (radius, height)."""
    return trimesh.creation.revolve([(0, 0), (10, 0), *rim, (0, 6)], sections=sections)


@pytest.mark.parametrize(
    ("rim", "radii"),
    [
        ([(8 + 2 * np.cos(a), 4 + 2 * np.sin(a)) for a in np.linspace(0, np.pi / 2, 10)], [10]),
        ([(10, 4), (8, 6)], [8, 10]),
        ([(10, 5.6), (7, 6)], [7, 10]),
    ],
    ids=["rounded", "chamfered", "shallow"],
)
def test_a_circle_in_which_a_rounding_goes_on_smoothly_is_no_edge(rim, radii):
    """From the upper face into a rounding of nine steps nothing is seen; a chamfer of 45 degrees, a slope of 8 are."""
    solid = mesh.solid(disc(*rim))
    assert sorted(circle.radius for circle in solid.circles) == pytest.approx(radii)
    assert not solid.sharp


def test_chamfers_and_shallow_roofs_stay_sharp():
    """A chamfer of 45 degrees, two of 30, a ridge of 10: plane faces, whatever their angles."""
    roof = mesh.solid(prism([(0, 0), (60, 0), (60, 10), (30, 15), (0, 10)], 40.0))
    both = mesh.solid(prism([(0, 0), (60, 0), (60, 10), (56, 12.3), (4, 12.3), (0, 10)], 40.0))
    assert len(roof.sharp) == len(roof.edges) == 15
    assert len(both.sharp) == len(both.edges) == 18


@pytest.mark.parametrize(
    ("shape", "sharp", "circles"),
    [
        (trimesh.creation.icosphere(3), 0, 0),
        (trimesh.creation.cylinder(3, 10, sections=96), 0, 2),
        (trimesh.creation.cone(5, 8, sections=64), 0, 1),
        (trimesh.creation.cylinder(3, 10, sections=8), 24, 0),
        (trimesh.creation.annulus(2, 5, 4, sections=48), 0, 4),
        (trimesh.creation.torus(5, 1.5), 0, 0),
    ],
    ids=["sphere", "cylinder", "cone", "octagon", "ring", "torus"],
)
def test_other_curved_surfaces(shape, sharp, circles):
    solid = mesh.solid(shape)
    assert (len(solid.sharp), len(solid.circles)) == (sharp, circles)


def test_slivers_of_single_precision_are_flat():
    """Thin triangles of a tilted face, whose own normals mean nothing."""
    made = prism([(0, 0), (60, 0), (60, 12), (0, 12)], 40.0, [Hole(30, 20, 8, evenly(200), 0, 12)], seed=3)
    made.apply_transform(trimesh.transformations.rotation_matrix(0.4, [1, 2, 3], [5, 5, 5]))
    made.vertices = made.vertices.astype(np.float32).astype(float)
    solid = mesh.solid(made)
    assert len(planes(solid)) == 6
    assert [round(circle.radius, 5) for circle in solid.circles] == [8, 8]


def test_a_mesh_of_many_triangles_has_few_faces(tmp_path):
    """49,152 triangles: each of the box's faces is one, its edges are whole."""
    made = trimesh.creation.box((60, 40, 12))
    for _ in range(6):
        made = made.subdivide()
    assert len(made.faces) == 49152
    path = Path(tmp_path / "fine.stl")
    made.export(path)
    solid = mesh.read(path)
    assert (len(solid.faces), len(solid.sharp)) == (6, 12)


@pytest.mark.parametrize("angle", [30.0, 90.0, 150.0])
@pytest.mark.parametrize("off", [1e-8, 1e-7])
@pytest.mark.parametrize("places", [(2.5,), (1.0, 2.0, 2.5, 4.5)])
def test_slivers_in_a_crease_do_not_make_one_face_of_two(angle, off, places):
    """As CAD systems leave them where they write single precision: they lie in both planes, and belong to one."""
    turn = np.radians(angle)
    profile = np.array([[0, 0], [4, 0], [4 + 3 * np.cos(np.pi - turn), 3 * np.sin(turn)], [0, 3 * np.sin(turn)]])
    low, high = (np.column_stack([profile[:, 0], np.full(4, y), profile[:, 1]]) for y in (0.0, 5.0))
    beside = np.array([[4.0 + off, y, -off] for y in places])  # on the crease at x = 4, between the face below
    corners = np.concatenate([low, high, beside])
    faces = [
        (0, 1, 2),
        (0, 2, 3),
        (4, 6, 5),
        (4, 7, 6),
        (1, 5, 2),
        (5, 6, 2),
        (2, 6, 3),
        (6, 7, 3),
        (3, 7, 0),
        (7, 4, 0),
    ]
    chain = [1, *range(8, 8 + len(places)), 5]  # and the slanted one
    faces += [(0, other, one) for one, other in pairwise([*chain, 4])]
    faces += [(one, other, 5) for one, other in pairwise(chain[:-1])]  # the slivers
    body = trimesh.Trimesh(corners, faces, process=False)
    body.fix_normals()
    solid = mesh.solid(body)
    assert (len(solid.faces), len(solid.sharp)) == (6, 12)
    heights = np.einsum("tki,ti->tk", solid.triangles, solid.normals[solid.triangle_faces])
    assert np.abs(heights - solid.offsets[solid.triangle_faces][:, None]).max() < 5 * off


def test_coplanar_pieces_are_one_face_in_whatever_order_they_meet():
    """Pieces of all sizes, joined by the edges of random trees: each of these joins two sets, and none is lost."""
    for seed in range(30):
        rng = np.random.default_rng(seed)
        count = 40
        sizes, at = rng.uniform(0.1, 3, count), rng.uniform(-9, 9, (count, 1, 2))
        flat = at + sizes[:, None, None] * np.array([[0.0, 0], [1, 0], [0, 1]])
        corners = np.concatenate([flat, np.ones((count, 3, 1))], -1).reshape(-1, 3)
        pieces = trimesh.Trimesh(corners, np.arange(3 * count).reshape(-1, 3), process=False)
        tree = np.array([(k, rng.integers(k)) for k in range(1, count)])
        assert len(mesh._in_plane(pieces, np.arange(count), rng.permutation(tree))) == count - 1


def test_a_fin_of_no_thickness_has_two_sides():
    """On a box's top, as files of several bodies have them, its sides divided in other ways. They lie in one plane and
    look away from each other: one face of both would look nowhere.
    """
    corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (4, 0), (4, 2), (0, 2))]
    corners += [(1, 1, 1), (3, 1, 1), (1, 1, 2), (3, 1, 2), (2, 1, 1)]  # the last one for the back side alone
    faces = [(0, 2, 1), (0, 3, 2), (0, 1, 5), (0, 5, 4), (1, 2, 6), (1, 6, 5), (2, 3, 7), (2, 7, 6)]
    faces += [(3, 0, 4), (3, 4, 7), (4, 5, 9), (4, 9, 8), (5, 6, 9), (6, 7, 8), (6, 8, 12), (6, 12, 9), (7, 4, 8)]
    faces += [(8, 9, 11), (8, 11, 10), (12, 8, 10), (12, 10, 11), (9, 12, 11)]
    solid = mesh.solid(trimesh.Trimesh(corners, faces, process=False))
    assert len(solid.faces) == 8
    assert np.isfinite(solid.normals).all()
    sides = solid.normals[np.abs(solid.offsets) == 1][:, 1]
    assert sorted(sides[sides != 0].tolist()) == [-1.0, 1.0]


@pytest.mark.parametrize(("off", "good"), [(0.09, True), (0.11, False)])
def test_a_vertex_is_named_by_a_place_within_a_thousandth_of_the_largest_extent(off, good):
    """Of a plate of 100 x 20 x 2, whose nearest vertex is meant."""
    plate = mesh.solid(trimesh.creation.box((100, 20, 2)))
    names = {"here": (50.0, 10.0 + off, 1.0), "there": (-50.0, 10.0, 1.0 - off)}
    if not good:
        with pytest.raises(
            InvalidInput, match=r"object.names.here must be the position of a vertex, got \[50.0, 10.11"
        ):
            mesh.renamed(plate, names)
        return
    found = mesh.renamed(plate, names)
    assert found.vertex("here").tolist() == [50, 10, 1]
    assert found.vertex("there").tolist() == [-50, 10, 1]
    assert sum(name.startswith("v") for name in found.vertex_names) == 6
    with pytest.raises(InvalidInput, match=r"object.names must be names of their own, got v1, there"):
        mesh.renamed(plate, {"v1": (50.0, 10.0, 1.0), "there": (-50.0, 10.0, 1.0)})


def test_corners_are_where_two_sharp_edges_meet_or_more():
    """Of half a rod: two at each end of both straight edges along it, and no vertex of its half circles."""
    angle = np.radians(np.linspace(0, 180, 25))
    rod = mesh.solid(prism([(0, 0), *np.column_stack([5 * np.cos(angle), 5 * np.sin(angle)]).tolist()], 12.0))
    corners = {name: rod.vertex(name).round(9).tolist() for name in rod.vertex_names if name.startswith("v")}
    assert corners == {"v1": [-5, 0, 0], "v2": [-5, 12, 0], "v3": [5, 0, 0], "v4": [5, 12, 0]}
    assert sorted(name for name in rod.vertex_names if name not in corners) == sorted(f"p{i}" for i in range(1, 47))
    assert [sorted(rod.vertex_names[i] for i in edge.ends) for edge in rod.sharp] == [
        ["v1", "v2"], ["v1", "v3"], ["v2", "v4"], ["v3", "v4"]
    ]  # fmt: skip


@pytest.mark.parametrize("scale", [1.0, 2.0, 25.4])
def test_a_mesh_in_another_unit_is_as_many_times_as_large(scale, tmp_path):
    path = tmp_path / "box.stl"
    trimesh.creation.box((1, 2, 3)).export(path)
    assert np.ptp(mesh.read(path, scale).vertices, axis=0) == pytest.approx(scale * np.array([1, 2, 3]), rel=1e-6)
