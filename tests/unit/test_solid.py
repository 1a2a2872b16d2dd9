"""Solids from mesh files, and which parts of their edges a position sees."""

import pickle
import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh

import planner
import scenes
from imaging.geometry.projection import direction
from imaging.geometry.visibility import seen, turned, visible_spans
from measure.features.layout import layout_of
from scenes import InvalidInput
from scenes.load import BUNDLED
from scenes.parts import mesh

BLOCK = scenes.block((12.5, 7.5, 2.5))


def as_mesh_scene(task1, path):
    """Task1 with its block read from a file: the same vertices and edges by other names."""
    names = {name: tuple(BLOCK.vertex(name)) for name in ("v3", "v6")}
    body = scenes.Mesh(kind="mesh", file=path, names={f"p{n}": at for n, at in names.items()})
    ends = {frozenset(map(tuple, BLOCK.vertices[list(edge.ends)].round(6).tolist())): edge.name for edge in BLOCK.edges}
    read = body.solid
    same = {ends[frozenset(map(tuple, read.vertices[list(e.ends)].round(6).tolist()))]: e.name for e in read.edges}

    def corner(old):
        return scenes.Corner(vertex=f"p{old.vertex}", edges=tuple(same[name] for name in old.edges))

    task = scenes.Task(start=corner(task1.task.start), end=corner(task1.task.end))
    return task1.model_copy(update={"object": body, "task": task})


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj"])
def test_the_block_from_a_file_gives_the_boxs_numbers(task1, tmp_path, suffix):
    path = tmp_path / f"block.{suffix}"
    BLOCK.mesh().export(path)
    read = as_mesh_scene(task1, path)
    for setting in task1.settings:
        for model in ("paper", "calibrated", "bound"):
            ours, theirs = (planner.predict(s, setting.sensor, setting.light, model) for s in (read, task1))
            assert ours.variance_px2 == pytest.approx(theirs.variance_px2, rel=1e-9)
            assert ours.variance_cm2 == pytest.approx(theirs.variance_cm2, rel=1e-9)
            assert ours.status == theirs.status


def test_faces_edges_and_names_of_a_box():
    box = mesh.solid(trimesh.creation.box((2, 2, 2)).subdivide().subdivide())
    assert (len(box.vertices), len(box.faces), len(box.edges), box.is_convex) == (8, 6, 12, True)
    assert all(len(face) == 4 for face in box.faces)
    assert box.mesh().volume == pytest.approx(8)
    assert box.vertex("v1").tolist() == [-1, -1, -1]


def test_bundled_bodies():
    wedge, bracket, plate = (scenes.load(name).solid for name in ("wedge", "bracket", "plate"))
    assert (len(wedge.faces), len(wedge.edges), wedge.is_convex) == (5, 9, True)
    assert (len(bracket.faces), len(bracket.edges), bracket.is_convex) == (8, 18, False)
    assert [edge.name for edge in bracket.edges if not edge.convex] == ["e10"]
    assert [(c.name, c.hole, len(c.edges)) for c in plate.circles] == [("c1", True, 64), ("c2", True, 64)]
    assert plate.circle("c2").centre == pytest.approx([5, 4, 1], abs=1e-6)
    assert plate.circle("c2").radius == pytest.approx(2, abs=1e-6)


def test_height_above_is_that_of_the_convex_hull():
    bracket = scenes.load("bracket").solid
    assert bracket.height_above(np.array([5.0, 2.0, 3.0])) < 0  # under the brace, outside the metal
    assert bracket.height_above(np.array([5.0, 2.0, 9.0])) > 0
    assert BLOCK.height_above(np.array([1.0, 1.0, 4.5])) == 2


@pytest.mark.parametrize(
    ("content", "line"),
    [(b"solid x\nendsolid x\n", "must "), (b"no mesh at all", "must "), (None, "must be a readable mesh")],
)
def test_bad_mesh_file(tmp_path, content, line):
    path = tmp_path / "bad.stl"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InvalidInput, match=line):
        mesh.read(path)


@pytest.mark.parametrize("header", [bytes(80), b"solid of an exporter".ljust(80)], ids=["empty", "solid"])
def test_a_file_that_is_cut_off_says_so(tmp_path, header):
    """A binary file of 12 triangles that ends within the eighth, whatever its header is; as a whole it is read."""
    path, block = tmp_path / "part.stl", trimesh.creation.box((1, 1, 1)).export(file_type="stl")
    path.write_bytes(header + block[80:])
    assert len(mesh.read(path).faces) == 6
    path.write_bytes(header + block[80 : 84 + 7 * 50 + 20])
    with pytest.raises(InvalidInput, match=r"must be a whole file, got .*, cut off after 7 of 12 triangles"):
        mesh.read(path)


def test_scene_names_the_key_of_a_bad_mesh(tmp_path):
    text = (scenes.load.__globals__["BUNDLED"] / "wedge.toml").read_text()
    path = tmp_path / "s.toml"
    path.write_text(text)  # the mesh is not beside it
    with pytest.raises(InvalidInput, match=re.escape("object.file must be a readable mesh")):
        scenes.load(path)


def bracket_in(folder, height=6.0):
    """The bracket's scene with a mesh file of its own, the upright's height changed."""
    lines = (BUNDLED / "bracket.obj").read_text().replace(" 6.00000000\n", f" {height:g}\n")
    (folder / "bracket.obj").write_text(lines)
    text = (BUNDLED / "bracket.toml").read_text()
    (folder / "bracket.toml").write_text(text)
    return scenes.load(folder / "bracket.toml")


def test_a_scene_keeps_the_mesh_that_it_was_made_with(tmp_path):
    """The file may go, and the scene may travel to where it never was."""
    scene = bracket_in(tmp_path)
    expected = scene.solid.vertices
    (tmp_path / "bracket.obj").unlink()
    for same in (scene, scene.model_copy(update={"settings": ()}), pickle.loads(pickle.dumps(scene))):
        assert (same.solid.vertices == expected).all()
        assert (same.bodies.vertices == expected).all()


def test_a_file_that_changed_is_another_solid(tmp_path):
    """In the same place, under the same name, within the same process: what hides and shades is the new one."""
    before, after = bracket_in(tmp_path), bracket_in(tmp_path, 7.0)
    assert [scene.bodies.vertices[:, 2].max() for scene in (before, after)] == [6.0, 7.0]
    assert after.bodies is after.solid
    assert after != before
    assert pickle.loads(pickle.dumps(after)) == after
    sizes = [np.ptp(layout_of(scenes.Picture.of(scene, (60, 300))).ends) for scene in (before, after)]
    assert sizes[1] > sizes[0]  # margin: the order is said


def blocked(point, position, solid, own):
    """Moeller-Trumbore against every triangle outside the edge's own faces."""
    corners = solid.triangles[~np.isin(solid.triangle_faces, own)]
    ray, one, two = position - point, corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    h = np.cross(ray, two)
    a = (one * h).sum(1)
    ok = np.abs(a) > 1e-12
    f = 1 / np.where(ok, a, 1)
    s = point - corners[:, 0]
    q = np.cross(s, one)
    u, v, t = f * (s * h).sum(1), f * (q @ ray), f * (two * q).sum(1)
    return bool((ok & (u > 0) & (v > 0) & (u + v < 1) & (t > 1e-9)).any())


def test_visible_points_against_rays(rng):
    """Exact hidden intervals of the bracket's edges against a ray for every point."""
    solid = scenes.load("bracket").solid
    positions = 100 * direction(np.column_stack([rng.uniform(0, 180, 30), rng.uniform(0, 360, 30)]))
    fractions = np.linspace(0.013, 0.987, 23)
    hidden = 0
    for edge in solid.edges:
        start, stop = solid.vertices[list(edge.ends)]
        ours = seen(solid, edge, positions, fractions)
        for i, position in enumerate(positions):
            expected = [not blocked(start + f * (stop - start), position, solid, edge.faces) for f in fractions]
            assert ours[i].tolist() == expected
            hidden += expected.count(False)
    assert hidden > 500


def test_half_hidden_edge():
    """From low over the short leg the upright hides part of the edge behind it; the span says which part."""
    solid = scenes.load("bracket").solid
    edge = solid.edge("e14")  # from (1.5, 5, 1.5) along the base
    position = np.array([-60.0, 3.0, 40.0])  # beyond the upright, whose top is at 6
    ((start, stop),) = visible_spans(solid, edge, position)
    shadow = 1.5 + (6 - 1.5) / (40 - 6) * 61.5  # similar triangles through the upright's inner top edge
    assert stop == 1
    assert 1.5 + start * 8.5 == pytest.approx(shadow, rel=1e-9)
    assert turned(solid, solid.edge("e10"), np.array([50.0, 2.5, -3.0])).tolist() == [False, False]


def test_a_sliver_folded_back_onto_itself_has_a_normal():
    """As a mesh from a CAD system had one: its triangles cancel, and the normal was not a number."""
    box = mesh.solid(trimesh.creation.box((2, 2, 2)))
    sliver = np.array([[1.0, 1, 1], [1, -1, 1], [1, 0, 1.0001]])
    folded = replace(
        box,
        faces=(*box.faces, (0, 1)),
        triangles=np.concatenate([box.triangles, [sliver, sliver[::-1]]]),
        triangle_faces=np.concatenate([box.triangle_faces, [6, 6]]),
        holes=(*box.holes, ()),
    )
    assert np.abs(folded.normals[6]) == pytest.approx([1, 0, 0])
    assert np.array_equal(folded.normals[:6], box.normals)
