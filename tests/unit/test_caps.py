"""What a file leaves open is closed, said, not measured by, and not looked at by plans."""

import numpy as np
import pytest
import trimesh

import planner
import scenes
from imaging.geometry.projection import direction
from scenes.errors import InvalidInput
from scenes.parts import mesh
from scenes.parts.caps import caps
from validation.cli.common import scene_of, warn_of_open


def without(part, gone):
    """A mesh without some of its triangles, bool (T,)."""
    return trimesh.Trimesh(part.vertices, part.faces[~gone], process=False)


def below(part):
    """Which triangles look down."""
    return part.face_normals[:, 2] < -0.9


def block():
    return trimesh.creation.box((4, 3, 1)).subdivide()


@pytest.mark.parametrize("missing", [1, 2, 3])
def test_a_hole_in_a_plane_is_filled_and_the_part_is_as_before(missing):
    """Triangles of one side that hang together; of its edges, too, none is lost."""
    whole = block()
    side = np.flatnonzero(whole.face_normals[:, 1] > 0.9)
    first = whole.face_adjacency[np.isin(whole.face_adjacency, side).all(1)]
    gone = np.isin(np.arange(len(whole.faces)), np.unique(first)[:missing])
    found, before = mesh.solid(without(whole, gone)), mesh.solid(whole)
    assert found.caps == ()
    assert len(found.mended) == 1
    assert found.mended[0].startswith("holes closed: ")
    assert [edge.name for edge in found.sharp] == [edge.name for edge in before.sharp]
    assert np.allclose(found.areas.sum(), before.areas.sum(), rtol=1e-12)


def test_edges_beside_a_cap_measure_nothing():
    found = mesh.solid(without(block(), below(block())))
    (cap,) = found.caps
    assert found.areas[cap] == pytest.approx(12.0)
    assert found.normals[cap] == pytest.approx([0, 0, -1])
    assert len(found.sharp) == 8
    assert {edge.kind for edge in found.edges if cap in edge.faces} == {"rim"}
    assert not found.arcs
    assert found.mended[1] == (
        "open places closed by faces of which nothing is known: 1, at (0, 0, -0.5); edges beside them measure nothing"
    )


def test_the_open_end_of_a_tube_gets_a_ring():
    tube = trimesh.creation.annulus(5, 9, 20, sections=64)
    found = mesh.solid(without(tube, below(tube)))
    (cap,) = found.caps
    assert found.areas[cap] == pytest.approx(np.pi * (81 - 25) * np.sin(np.pi / 32) / (np.pi / 32), rel=1e-9)
    assert len(found.holes[cap]) == 1
    assert sorted(circle.radius for circle in found.circles) == pytest.approx([5, 9], abs=1e-6)  # of the other end
    assert all(circle.centre[2] > 9 for circle in found.circles)


def test_a_circle_with_a_piece_beside_a_cap_is_none():
    rod = trimesh.creation.cylinder(5, 20, sections=64)
    wall = np.flatnonzero(np.abs(rod.face_normals[:, 2]) < 0.1)
    gone = np.isin(np.arange(len(rod.faces)), wall[np.argsort(np.arctan2(*rod.triangles_center[wall, :2].T))[:6]])
    found = mesh.solid(without(rod, gone))
    assert found.caps
    assert not found.circles
    found = mesh.solid(without(rod, np.isin(np.arange(len(rod.faces)), wall[:2])))  # one facet
    assert not found.caps
    assert [circle.radius for circle in found.circles] == pytest.approx([5, 5], abs=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_a_surface_with_holes_anywhere_is_closed(seed):
    """Of a ball and of a bracket triangles here and there are gone: the volume is that of the whole within theirs."""
    rng = np.random.default_rng(seed)
    for whole in (trimesh.creation.icosphere(2), trimesh.creation.annulus(5, 9, 20, sections=32)):
        gone = rng.random(len(whole.faces)) < 0.05
        found = mesh.solid(without(whole, gone))
        first, second, third = found.triangles.swapaxes(0, 1)
        volume = np.einsum("ti,ti->", first, np.cross(second, third)) / 6
        assert volume == pytest.approx(whole.volume, rel=0.02)
        assert any(line.startswith("holes closed: ") for line in found.mended)


def test_a_boundary_that_lies_in_no_plane_is_closed_against_its_direction():
    vertices = np.array([[0.0, 0, 0], [2, 0, 1], [2, 2, 0], [0, 2, 1]])
    (cap,) = caps(vertices, np.array([[0, 1], [1, 2], [2, 3], [3, 0]]))
    halves = {(a, b) for each in cap.tolist() for a, b in zip(each, each[1:] + each[:1], strict=True)}
    assert {half for half in halves if half[::-1] not in halves} == {(0, 1), (1, 2), (2, 3), (3, 0)}


def test_what_is_a_sheet_alone_is_no_body():
    with pytest.raises(InvalidInput, match="of some thickness"):
        mesh.solid(without(block(), ~below(block())))


@pytest.fixture
def tray(tmp_path):
    """A scene of a block without its bottom."""
    without(block(), below(block())).export(tmp_path / "tray.stl")
    text = scenes.find("task1").read_text()
    body, rest = text.index("[object]"), text.index("[material]")
    task, locator = text.index("[task]"), text.index("[locator]")
    mesh_object = '[object]\nkind = "mesh"\nfile = "tray.stl"\n'
    path = tmp_path / "tray.toml"
    path.write_text(text[:body] + mesh_object + text[rest:task] + text[locator : text.index("[[settings]]")])
    return path


def test_no_plan_looks_at_what_is_open(tray):
    """A sensor sees the bottom of a convex part where it stands below its plane."""
    scene = scenes.load(str(tray))
    poses = np.array([[polar, azimuth] for polar in range(0, 181, 15) for azimuth in (0, 40, 200)], float)
    height = scene.camera.distance * direction(poses)[:, 2]
    assert planner.Constraints().sensors(scene, poses).tolist() == (height >= -0.5).tolist()


def test_it_is_warned_of(tray, capsys):
    scene_of(str(tray))
    assert capsys.readouterr().err.startswith("Warning: object.file has open places closed by faces of which nothing")
    scene_of("task1")
    assert not capsys.readouterr().err
    warn_of_open(scenes.load(str(tray)), scenes.load("task1"), scenes.load(str(tray)))
    assert capsys.readouterr().err.count("Warning: ") == 2
