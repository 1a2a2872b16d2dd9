"""STEP and STL of one part: the oracle of edges on parts whose edges are counted by hand, and both files' features."""

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
import trimesh

from scenes import Measurand
from scenes.parts import mesh, step
from scenes.parts.recognised import cylinders
from tests.cad_edges import Sharp, sharp_edges
from tests.cad_faces import distances
from tests.proofs import pairs

kernel = pytest.mark.skipif(find_spec("OCP") is None, reason="needs OpenCASCADE: pip install 'ice-vision[step]'")
SIZE = (60.0, 40.0, 12.0)


def rounded(folder):
    """A block of 60 x 40 x 12 with one long edge rounded by 4, one bevelled by 3, and a countersunk hole of 5."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    from tests.step_parts import written

    shape = BRepPrimAPI_MakeBox(*SIZE).Shape()
    for make, size, z in ((BRepFilletAPI_MakeFillet, 4.0, 12.0), (BRepFilletAPI_MakeChamfer, 3.0, 0.0)):
        maker = make(shape)
        maker.Add(size, _along_x(shape, 0.0, z))
        shape = maker.Shape()
    up = gp_Ax2(gp_Pnt(30, 22, -1), gp_Dir(0, 0, 1))
    cone = BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(30, 22, 9), gp_Dir(0, 0, 1)), 5.0, 8.0, 3.0).Shape()
    for tool in (BRepPrimAPI_MakeCylinder(up, 5.0, 20.0).Shape(), cone):
        shape = BRepAlgoAPI_Cut(shape, tool).Shape()
    return written(shape, folder / "part.step")


def _along_x(shape, y, z):
    """The edge of a block along x at y and z."""
    from OCP import TopAbs, TopExp, TopoDS
    from OCP.BRepAdaptor import BRepAdaptor_Curve

    explorer = TopExp.TopExp_Explorer(shape, TopAbs.TopAbs_ShapeEnum.TopAbs_EDGE)
    while explorer.More():
        edge = TopoDS.TopoDS.Edge(explorer.Current())
        middle = BRepAdaptor_Curve(edge)
        at = middle.Value((middle.FirstParameter() + middle.LastParameter()) / 2)
        if abs(at.X() - 30) < 1e-9 and abs(at.Y() - y) < 1e-9 and abs(at.Z() - z) < 1e-9:
            return edge
        explorer.Next()
    raise AssertionError("no such edge")


def by_hand():
    """Straight edges: one of the block's is rounded, one is two; circles: 5 below, 8 above, 5 where the cone ends."""
    x = [0.0, 60.0]
    profile = np.array([[3, 0], [40, 0], [40, 12], [4, 12], [0, 8], [0, 3]], float)  # y, z; the fillet from (4, 12)
    sides = [(0, 1), (1, 2), (2, 3), (4, 5), (5, 0)]
    lines = [[[at, *profile[i]], [at, *profile[j]]] for at in x for i, j in sides]
    lines += [[[0, *profile[i]], [60, *profile[i]]] for i in (0, 1, 2, 5)]
    return np.array(lines), np.array([[30, 22, 0, 5], [30, 22, 12, 8], [30, 22, 9, 5]], float)


@kernel
def test_the_oracle_counts_as_by_hand(tmp_path):
    """Where the fillet begins edges are smooth; the cone's edge to the bore is a circle."""
    lines, circles = by_hand()
    found = sharp_edges(rounded(tmp_path))
    for one, other in ((found.lines, lines), (lines, found.lines)):
        match = pairs.matched_lines(one, other)
        assert (match.there, match.matched, len(match.false)) == (14, 14, 0)
    assert pairs.matched(circles, found.circles).matched == len(found.circles) == 3
    assert len(found.smooth) == 2
    assert max(found.bends) == pytest.approx(np.pi / 2)


@kernel
def test_both_files_offer_what_there_is(tmp_path):
    """STEP, and its own triangles in single precision; circles where a plane ends, the fillet's cylinder."""
    file = rounded(tmp_path)
    part = step.read(file)
    trimesh.Trimesh(**trimesh.triangles.to_kwargs(part.triangles)).export(tmp_path / "part.stl")
    pair = pairs.compared(file, tmp_path / "part.stl")
    for match in (pair.step_lines, pair.lines):
        assert (match.there, match.matched, len(match.false)) == (14, 14, 0)
    for match in (pair.step_circles, pair.circles):
        assert (match.matched, len(match.false)) == (2, 0)
    assert pair.same
    assert pair.placed == ""
    assert pair.apart < 1e-5  # mm: single precision
    assert "DIFFER" not in str(pair)
    assert "FILES DIFFER, surfaces by 0.0123 mm" in str(replace(pair, apart=0.0123))
    solid = mesh.read(tmp_path / "part.stl")
    assert sum(solid.plane) == sum(part.solid.plane) == 7
    assert 4.0 in [round(each.surface.radius, 4) for each in cylinders(solid)]


@kernel
def test_how_far_places_are_off_the_part(tmp_path):
    """Off the fillet along its radius, off the bore's wall, on the plane above and inside of the block."""
    along = np.sqrt(0.5)
    fillet = [[20, 4 - r * along, 8 + r * along] for r in (4.0, 4.01, 3.5)]
    places = np.array([*fillet, [30, 22 + 4.8, 5], [50, 20, 12], [50, 20, 12.002], [10, 30, 5]])
    found = distances(rounded(tmp_path), places)
    assert found == pytest.approx([0, 0.01, 0.5, 0.2, 0, 0.002, 5], abs=1e-5)


@kernel
def test_the_surfaces_of_a_mesh_that_stands_elsewhere_are_the_same(tmp_path):
    file = rounded(tmp_path)
    triangles = np.roll(step.read(file).triangles, 1, 2) + [5.0, 0, 3]
    trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles)).export(tmp_path / "moved.stl")
    pair = pairs.compared(file, tmp_path / "moved.stl")
    assert "(elsewhere)" in str(pair)
    assert pair.apart < 1e-5  # mm: single precision


@kernel
def test_the_angles_between_faces_and_curves_that_are_straight(tmp_path):
    """45 degrees at a chamfer of 3 on 3, none where the fillet begins."""
    part = step.read(rounded(tmp_path))
    bends = np.degrees([edge.bend for edge in part.edges])
    straight = np.array([edge.straight for edge in part.edges])
    assert sum(straight) == 16
    assert sorted(np.round(bends[straight], 6)) == pytest.approx([0, 0, 45, 45] + [90] * 12, abs=1e-6)
    assert {edge.kind for edge in part.edges if not edge.straight} == {"circle"}


def test_features_are_matched_one_to_one_to_a_micrometre():
    there = np.array([[0.0, 0, 0, 5], [10, 0, 0, 5], [20, 0, 0, 5]])
    offered = np.array([[10.0, 0.0009, 0, 5], [20, 0, 0.0011, 5], [0, 0, 0, 5.0009]])
    found = pairs.matched(there, offered)
    assert (found.there, found.matched) == (3, 2)
    assert found.missed.tolist() == [there[2].tolist()]
    assert found.false.tolist() == [offered[1].tolist()]
    assert str(found) == "2 of 3, 1 false"
    ends = np.array([[[0.0, 0, 0], [4, -4, 4]], [[1, 1, 1], [1, 1, 5]]])
    assert pairs.matched_lines(ends, ends[::-1, ::-1]).matched == 2
    assert pairs.matched_lines(ends, ends + [[[0, 0, 0]], [[0.002, 0, 0]]]).matched == 1
    assert pairs.matched_lines(ends, np.zeros((0, 2, 3))).missed is not None


def sharp(lines, nearly=np.zeros((0, 2, 3)), curves=np.zeros((0, 9, 3))):
    """Edges of a part."""
    return Sharp(lines, nearly, curves, np.zeros((0, 4)), np.zeros((0, 2, 3)), ())


def test_what_lies_on_a_straight_edge_is_none_that_there_is_not():
    """An edge, half of it, and it with a bit of the circle of radius 100 that continues it; a spline that is straight.

    Beside the edge by 0.002, and the circle's first chord, are none that there are.
    """
    turn = np.linspace(0, 0.1, 65)
    circle = np.stack([10 + 100 * np.sin(turn), 100 - 100 * np.cos(turn), 0 * turn], -1)
    spline = np.array([[[0.0, 5, 0], [1, 5, 0]]])
    there = sharp(np.array([[[0.0, 0, 0], [10, 0, 0]]]), spline, circle[None])
    ends = np.array([[0, 10, 0], [0, 5, 0], [0, 10.4, 0], [0, 10, 0.002], [10, 11, 0]], float)
    lines = np.stack([np.stack([ends[:, k], ends[:, 2], 0 * ends[:, 0]], -1) for k in (0, 1)], 1)
    lines = np.concatenate([lines, spline, circle[None, [0, 1]]])
    found = pairs.compared_lines(there, np.eye(3), np.zeros(3), lines)
    assert (found.there, found.matched, len(found.part), len(found.false)) == (1, 1, 2, 3)
    assert found.part[:, 0] == pytest.approx([2.5, 5.2])
    assert str(found) == "1 of 1, 3 false, 2 in part"


@pytest.mark.parametrize("turned", [False, True])
def test_a_mesh_that_stands_elsewhere_is_found(rng, turned):
    """Turned by right angles and moved until its corners are those of the edges; of another part few are."""
    corners = rng.uniform(0, 10, (40, 3)) * [1, 2, 3]
    turn = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]) if turned else np.eye(3)
    shift = np.array([5.0, -2, 1]) if turned else np.zeros(3)
    there = sharp(corners.reshape(-1, 2, 3))
    found = pairs.moved(there, corners @ turn.T + shift)
    assert found[0] == pytest.approx(turn)
    assert found[1] == pytest.approx(shift)
    assert found[2] == 1
    assert pairs.moved(there, rng.uniform(0, 10, (40, 3)))[2] < 0.5


def test_measurands_by_the_names_of_the_other_file():
    """The same block twice, its corners in another order: names go by places; one that is not there is none."""
    solid = mesh.solid(trimesh.creation.box((2, 3, 4)))
    other = mesh.renamed(solid, {"far": (1.0, 1.5, 2.0)})
    called = pairs.names(solid, other)
    corner = solid.vertex_names[int(np.argmax(solid.vertices.sum(1)))]
    assert called[corner] == "far"
    assert all(called[edge.name] == edge.name for edge in solid.sharp)
    edges = [edge.name for edge in solid.sharp if edge.name][:2]
    asked = Measurand(name="a", kind="width", features=[{"edge": e} for e in edges], tolerance=0.1)
    told = pairs.told_by(asked, called | {edges[0]: "e99"})
    assert [feature.edge for feature in told.features] == ["e99", edges[1]]
    assert pairs.told_by(asked, {edges[0]: "e99"}) is None
