"""Triangles as files have them: what is done to close a surface, and where it is said to be open."""

import re

import numpy as np
import pytest
import trimesh

from scenes.errors import InvalidInput
from scenes.parts import mend, mesh
from scenes.parts.mend import mended

SIZE = np.array([3.0, 4.0, 6.0])


def box(corner=(0, 0, 0), size=SIZE):
    made = trimesh.creation.box(size)
    made.apply_translation(np.array(corner) + np.array(size) / 2)
    return made


def of(*parts, faces=None):
    """One mesh of the parts' triangles, nothing merged."""
    joined = trimesh.util.concatenate(parts)
    return trimesh.Trimesh(joined.vertices, joined.faces if faces is None else faces, process=False)


def two_sided(found):
    """Every edge of two triangles that pass it one way and the other."""
    return found.is_watertight and found.is_winding_consistent


def test_a_closed_surface_stays_as_it_is():
    before = box()
    found, said = mended(before.copy())
    assert said == ()
    assert found.faces.tolist() == before.faces.tolist()
    assert found.volume == pytest.approx(72.0)


@pytest.mark.parametrize("again", [1, 2])
def test_triangles_that_are_there_several_times(again):
    part = box()
    found, said = mended(of(part, faces=np.concatenate([part.faces, *[part.faces[[2, 7]]] * again])))
    assert said == (f"doubled triangles left out: {2 * again}",)
    assert two_sided(found)
    assert found.volume == pytest.approx(72.0)


def test_triangles_of_two_corners():
    part = box()
    found, said = mended(of(part, faces=np.concatenate([part.faces, [[1, 1, 5], [2, 6, 2], [3, 4, 4]]])))
    assert said == ("triangles of two corners left out: 3",)
    assert len(found.faces) == 12


def test_bodies_that_touch_in_a_face_are_one():
    """Two blocks of unequal length side by side: nothing is left of the wall between them."""
    one, two = box(), box((-5, 0, 0), (5, 4, 6))
    two.vertices = [3, 0, 0] + two.vertices * [-1, 1, 1]  # its wall has the same triangles
    two.invert()
    found, said = mended(of(one, two))
    assert said == ("pairs of triangles where bodies touch left out: 2",)
    assert two_sided(found)
    assert found.volume == pytest.approx((3 + 5) * 4 * 6)
    solid = mesh.solid(of(one, two))
    assert (len(solid.faces), len(solid.sharp), len(solid.vertices)) == (6, 12, 8)
    assert solid.mended == said


@pytest.mark.parametrize("turned", [0, 1])
def test_bodies_that_touch_in_an_edge_have_it_both(turned):
    """Two blocks corner to corner, whichever comes first: a chain of one face from each body nowhere."""
    parts = [box(), box((3, 4, 0), (2, 5, 6))]
    found, said = mended(of(*parts[:: -1 if turned else 1]))
    assert said == ("edges in which surfaces touch parted: 1",)
    assert two_sided(found)
    assert found.volume == pytest.approx(72 + 60)
    assert sorted(piece.volume for piece in found.split()) == pytest.approx([60, 72])
    solid = mesh.solid(of(*parts))
    assert (len(solid.faces), len(solid.sharp)) == (12, 24)
    assert all(edge.convex for edge in solid.sharp)


def test_a_body_that_touches_itself_in_an_edge():
    """Two slots that meet in a line from both sides leave a web of no thickness: material is on its two sides."""
    cells = [(0, 0), (1, 1), (0, 2), (1, 0), (1, 2)]  # of a 2 x 3 grid all but (0, 1); then one less
    parts = [box((2 * i, 3 * j, 0), (2, 3, 4)) for i, j in (*cells[:3], (2, 0), (2, 2), (2, 1), (1, 2))]
    found, said = mended(of(*parts))
    assert any(line.startswith("edges in which surfaces touch parted") for line in said)
    assert two_sided(found)
    assert found.volume == pytest.approx(7 * 24)
    for face, other in found.face_adjacency:  # no pair of triangles has the air between them alone
        assert len({*found.faces[face]} & {*found.faces[other]}) == 2


def test_an_open_edge_that_is_a_small_gap_is_closed():
    """The lid's corners are 0.1 micrometres off, as of a file in text with few digits."""
    part = box()
    lid = np.flatnonzero((part.triangles[:, :, 2] > 5.9).all(1))
    rest = np.setdiff1d(np.arange(12), lid)
    shifted = part.vertices + [1e-5, -1e-5, 0]
    found, said = mended(
        trimesh.Trimesh(
            np.concatenate([part.vertices, shifted]),
            np.concatenate([part.faces[rest], part.faces[lid] + 8]),
            process=False,
        )
    )
    assert said == ("vertices of open edges joined: 4",)
    assert two_sided(found)
    far = trimesh.Trimesh(
        np.concatenate([part.vertices, part.vertices + [1e-2, 1e-2, 1e-2]]),
        np.concatenate([part.faces[rest], part.faces[lid] + 8]),
        process=False,
    )
    found, said = mended(far)  # no gap: both borders are closed, each by itself
    assert said[0].startswith("holes closed: 2, of open edges: 8, at ")
    assert two_sided(found)


@pytest.mark.parametrize("times", [1, 2])
def test_corners_on_an_edge_divide_its_triangle(times):
    """A lid of smaller triangles than the walls below it: halves and quarters of its four edges."""
    part = box()
    lid = (part.triangles[:, :, 2] > 5.9).all(1)
    fine = trimesh.Trimesh(part.vertices, part.faces[lid], process=False)
    for _ in range(times):
        fine = fine.subdivide()
    joined = of(trimesh.Trimesh(part.vertices, part.faces[~lid], process=False), fine)
    joined.vertices += [1e-7, 0, 0] * (np.arange(len(joined.vertices)) % 2)[:, None]  # digits of a file in text
    found, said = mended(joined.copy())
    joints = 4 * (2**times - 1)
    assert said[-1] == f"corners on open edges, whose triangles were divided there: {joints}"
    assert two_sided(found)
    assert found.volume == pytest.approx(72.0, abs=1e-5)
    solid = mesh.solid(joined)
    assert (len(solid.faces), len(solid.sharp), len(solid.corner_names)) == (6, 12, 8)
    assert not (np.diff(found.triangles[:, [0, 1, 2, 0]], axis=1) == 0).all(-1).any()


def lifted(height):
    """A box whose lid's two triangles beside one edge meet in a corner ``height`` outside of it."""
    part = box()
    lid = np.flatnonzero((part.triangles[:, :, 2] > 5.9).all(1))
    side = next(k for k in lid if np.ptp(part.triangles[k], axis=0)[1] > 3.9)
    corners = part.faces[side]
    k = next(k for k in range(3) if abs(np.diff(part.vertices[corners[[k, k - 2]]], axis=0)[0, 0]) < 1e-9)
    start, stop, apex = corners[k], corners[k - 2], corners[k - 1]
    out = np.sign(part.vertices[start][0] - 1.5) * np.array([height, 0, 0])
    faces = [*np.delete(part.faces, side, 0).tolist(), [start, 8, apex], [8, stop, apex]]
    middle = part.vertices[[start, stop]].mean(0) + out
    return trimesh.Trimesh(np.vstack([part.vertices, middle]), faces, process=False)


def test_a_slit_is_filled():
    """Three edges between which 0.001 of 6 mm is open; what is 0.1 wide is no slit, but a hole."""
    found, said = mended(lifted(1e-3))
    assert said == ("slits filled, 0.0005 wide at most: 1",)
    assert two_sided(found)
    assert found.volume == pytest.approx(72.0, abs=2e-3)
    assert found.area == pytest.approx(2 * (3 * 4 + 3 * 6 + 4 * 6) + 2 * 0.002, rel=1e-9)
    assert not found.face_attributes["cap"].any()
    found, said = mended(lifted(0.1))
    assert said[0].startswith("holes closed: 1, of open edges: 3, at ")
    assert np.bincount(found.face_attributes["cap"]).tolist() == [13, 1]


def test_triangles_that_look_the_other_way_are_turned():
    part = box()
    faces = part.faces.copy()
    faces[[1, 3, 5, 8]] = faces[[1, 3, 5, 8], ::-1]
    found, said = mended(of(part, faces=faces))
    assert said == ("triangles that looked the other way turned: 4",)
    assert two_sided(found)
    assert found.volume == pytest.approx(72.0)


def test_shells_inside_out_are_turned_and_cavities_stay():
    """Of a hollow block, a block inside out beside it and one in its cavity, too, which has been turned."""
    outer, cavity, beside, core = (
        box(),
        box((0.5, 0.5, 0.5), (2, 3, 5)),
        box((9, 0, 0), (1, 2, 3)),
        box((1, 1, 1), (1, 1, 1)),
    )
    cavity.invert()
    beside.invert()
    found, said = mended(of(outer, cavity, beside, core))
    assert said == ("inverted shells turned: 1",)
    assert found.volume == pytest.approx(72 - 30 + 6 + 1)
    core.invert()
    found, said = mended(of(outer, cavity, beside, core))
    assert said == ("inverted shells turned: 1",)


def test_a_shell_inside_out_in_two_bodies_is_none_of_their_cavities():
    """Around it are two that look outwards: it is turned; around one more in it are three, and that stays a cavity."""
    block, inner, core, hollow = box(), *(box((at, at, at), (2.7 - 2 * at,) * 3) for at in (0.3, 0.5, 0.7))
    core.invert()
    found, said = mended(of(block, inner, core))
    assert said == ("inverted shells turned: 1",)
    assert found.volume == pytest.approx(72 + inner.volume + abs(core.volume))
    hollow.invert()
    core.invert()
    found, said = mended(of(block, inner, core, hollow))
    assert said == ()
    assert found.volume == pytest.approx(72 + inner.volume + core.volume - abs(hollow.volume))


def test_a_sheet_of_no_thickness_is_left_out():
    sheet = np.array([[8.0, 0, 0], [9, 0, 0], [9, 1, 0], [8, 1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]]) + 8
    one = box()
    found, said = mended(
        trimesh.Trimesh(np.concatenate([one.vertices, sheet]), np.concatenate([one.faces, faces]), process=False)
    )
    assert said == ("pairs of triangles where bodies touch left out: 2",)
    pyramid = np.concatenate([sheet[:3], [[8.5, 0.5, 1e-7]]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]) + 8
    found, said = mended(
        trimesh.Trimesh(np.concatenate([one.vertices, pyramid]), np.concatenate([one.faces, faces]), process=False)
    )
    assert said == ("shells of no thickness left out: 1",)
    assert len(found.faces) == 12


def test_where_it_is_open_is_said(monkeypatch):
    """How many edges, and the middles of the three longest."""
    part, places = box(), "open edges: 4, at (0, 2, 6), (3, 2, 6), (1.5, 0, 6)"
    faces = part.faces[np.flatnonzero(~(part.triangles[:, :, 2] > 5.9).all(1))]
    assert mended(of(part, faces=faces))[1] == (f"holes closed: 1, of {places}",)
    monkeypatch.setattr(mend, "_MOST_OPEN", 3)
    with pytest.raises(InvalidInput, match=re.escape(f"closed surface, got {places}")):
        mended(of(part, faces=faces))


def test_a_surface_that_encloses_nothing_is_no_body():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    with pytest.raises(InvalidInput, match="of some thickness"):
        mended(trimesh.Trimesh(square, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], process=False))


def test_triangles_know_which_of_the_file_they_are_pieces_of():
    """Doubled ones first, then two blocks that touch in an edge: the pieces lie in their triangles' planes."""
    parts = of(box(), box((3, 4, 0), (2, 5, 6)))
    before = of(parts, faces=np.concatenate([[[1, 1, 2]], parts.faces[[4]], parts.faces]))
    places = before.triangles.copy()
    found, said = mended(before)
    assert len(said) == 3
    of_file = places[found.face_attributes["source"]]
    normal = np.cross(of_file[:, 1] - of_file[:, 0], of_file[:, 2] - of_file[:, 0])
    assert (np.einsum("ti,ti->t", normal, np.asarray(found.face_normals)) > 0).all()
    off = np.einsum("ti,tki->tk", normal, found.triangles - of_file[:, :1])
    assert np.abs(off).max() < 1e-9
    middle = found.triangles.mean(1)
    low, high = of_file.min(1), of_file.max(1)
    assert ((middle >= low - 1e-9) & (middle <= high + 1e-9)).all()


def test_a_mesh_in_a_plane_is_refused_in_one_line(tmp_path):
    """An OBJ file whose places have two coordinates."""
    (tmp_path / "flat.obj").write_text("v 0 0\nv 1 0\nv 0 1\nv 1 1\nf 1 2 3\nf 2 4 3\n")
    with pytest.raises(InvalidInput, match=r"must have places of three coordinates, got .*flat\.obj with 2 of each"):
        mesh.read(tmp_path / "flat.obj")
