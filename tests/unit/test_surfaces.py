"""Material by face: which faces are meant, how bright they are, and what a bad choice of faces says."""

import numpy as np
import pytest
import trimesh

import planner
import render
import scenes
from imaging.geometry.projection import project
from imaging.light.appearance import face_signal, is_separable
from imaging.light.between import light_between
from imaging.light.edge_sides import side_signals, whites
from imaging.pictures import Pictures
from scenes import FaceMaterial, InvalidInput, Material, Picture
from scenes.load import BUNDLED, from_document
from scenes.parts.mesh import read
from scenes.selection import Where

SENSOR, LIGHT = (30, 135), (30, 225)


def with_materials(scene, *materials, **default):
    material = scene.material.model_copy(update=default)
    return scene.model_copy(update={"material": material, "materials": materials})


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("faces = ['up']", r"materials\[0\]\.faces\[0\] must be one of top, bottom, front, .*, got 'up'"),
        ("faces = ['top', 'top']", r"materials\[0\]\.faces must be different faces, got 'top' twice"),
        ("", r"materials\[0\]\.faces or materials\[0\]\.where must be given, not both, got none"),
        ("faces = ['top']\nwhere = 'left'", r"must be given, not both, got both"),
        ("where = { within_deg = 3 }", r"materials\[0\]\.where must be a side, or have a normal or a box, got neither"),
        ("where = { normal = [0, 0, 0] }", r"materials\[0\]\.where\.normal must be a direction, got \[0\.0, 0"),
        ("where = { normal = [1, 1, 0] }", r"materials\[0\]\.where must hold a face of the object, got none"),
        ("where = { box = [[0, 0, 0], [0, 1, 1]] }", r"materials\[0\]\.where\.box must be of rising corners, got"),
        ("faces = ['top']\nroughness = -1", r"materials\[0\]\.roughness must be at least 1e-06, got -1"),
        ("faces = ['top']\nkind = 'wood'", r"materials\[0\]\.kind must be one of 'torrance_sparrow', got 'wood'"),
        (
            "where = 'top'\n[[materials]]\nname = 'b'\nfaces = ['left', 'top']",
            r"materials\[1\]\.faces must be faces without a material, got 'top', which is of 'a'",
        ),
        (
            "where = 'top'\n[[materials]]\nname = 'a'\nfaces = ['left']",
            r"materials\[1\]\.name must be a name of its own, got 'a' again",
        ),
    ],
)  # fmt: skip
def test_a_bad_choice_of_faces_is_one_line(tmp_path, text, line):
    path = tmp_path / "bad.toml"
    path.write_text((BUNDLED / "task1.toml").read_text() + f"\n[[materials]]\nname = 'a'\n{text}\n")
    with pytest.raises(InvalidInput, match=line) as error:
        scenes.load(path)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


def test_faces_by_place_are_those_by_name(task1):
    solid = task1.solid
    for name in ("top", "bottom", "front", "back", "left", "right"):
        (found,) = FaceMaterial(name="a", where=name).chosen(solid, "materials[0]")
        assert solid.face_names[found] == name
    (found,) = np.flatnonzero(Where(box=((12, -1, -1), (13, 8, 3))).holds(solid))
    assert solid.face_names[found] == "right"
    sides = Where(normal=(0, 0, 1), within_deg=90).holds(solid)
    assert [name for name, held in zip(solid.face_names, sides, strict=True) if held] == [
        "top", "front", "back", "left", "right",
    ]  # fmt: skip


def test_faces_of_a_mesh_are_named_by_place_whatever_their_order(tmp_path):
    """The same wedge with its triangles in another order has the same names at the same places."""
    wedge = scenes.load("wedge").solid
    mesh = trimesh.Trimesh(wedge.triangles[::-1].reshape(-1, 3), np.arange(3 * len(wedge.triangles)).reshape(-1, 3))
    mesh.export(tmp_path / "other.stl")
    other = read(tmp_path / "other.stl")
    assert sorted(wedge.face_names) == [f"f{i}" for i in range(1, 6)]
    for name, normal in zip(wedge.face_names, wedge.normals, strict=True):
        assert other.normals[other.face_names.index(name)] == pytest.approx(normal, abs=1e-5)


def test_the_wall_of_a_circle_is_one_surface():
    plate = scenes.load("plate")
    wall = next(f for f in plate.solid.edge(plate.solid.circles[0].edges[0]).faces if f != plate.solid.circles[0].face)
    document = plate.model_dump(exclude_defaults=True) | {
        "materials": [{"name": "a", "faces": [plate.solid.face_names[wall]]}]
    }
    with pytest.raises(InvalidInput, match="materials must leave the wall of circle c1 one material, got several"):
        from_document(BUNDLED / "plate.toml", document)


def test_each_side_of_an_edge_is_as_bright_as_its_own_material(task1):
    """Signals of a block of three materials are those of blocks that are all of one of them."""
    top = FaceMaterial(name="a", where="top", diffuse_reflectance=0.3)
    gloss = Material(specular_fraction=0.6, refractive_index=1.5, extinction=2.0, roughness=0.3)
    right = FaceMaterial(name="b", where="right", **gloss.model_dump())
    names, points = ("e6", "e9", "e1"), task1.solid.vertices[[[2, 6], [2, 6], [0, 1]]] * 0.5 + 1
    found = side_signals(Pictures.of(with_materials(task1, top, right), SENSOR, (50, 50)), names, points)
    for each, name in ((task1.material, None), (top.material, "top"), (gloss, "right")):
        plain = with_materials(task1).model_copy(update={"material": each})
        alone = side_signals(Pictures.of(plain, SENSOR, (50, 50)), names, points)
        for e, edge in enumerate(names):
            for side, face in enumerate(task1.solid.edge(edge).faces):
                own = {"top": "top", "right": "right"}.get(task1.solid.face_names[face])
                if own == name:
                    assert found[e, side] == pytest.approx(alone[e, side], rel=1e-14)


def test_separable_faces_of_several_whites_are_as_without_the_shortcut(task1):
    """Both models by the closed sums and by signals at points: a trace of gloss, 1e-13, takes the second way."""
    sensors, lights = np.array([[30, 135], [45, 225], [20, 300]]), np.array([[15, 165]])
    top = FaceMaterial(name="a", where="top", diffuse_reflectance=0.4)
    fast = with_materials(task1, top, specular_fraction=0.0)
    slow = with_materials(task1, top, specular_fraction=1e-13, refractive_index=1.5)
    assert is_separable(fast)
    assert not is_separable(slow)
    for model in ("paper", "calibrated"):
        quick = planner.variances(fast, sensors, lights, model)
        assert quick == pytest.approx(planner.variances(slow, sensors, lights, model), rel=1e-6)
        assert (np.abs(quick / planner.variances(task1, sensors, lights, model) - 1) > 0.1).any()


@pytest.mark.render
@pytest.mark.parametrize("gloss", [0.0, 0.5])
def test_rendered_faces_have_their_own_intensity(gloss):
    """Four px around the middle of each face that is seen, against the signal there."""
    scene = scenes.load("anodised")
    looks = tuple(each.model_copy(update={"specular_fraction": gloss}) for each in scene.materials)
    scene = with_materials(scene, *looks, specular_fraction=gloss)
    image = render.image(scene, (55, 325), (40, 330)) - scene.noise.dark_level
    pictures, seen = Pictures.of(Picture.of(scene, (55, 325), (40, 330))), []
    for face in ("top", "front", "right"):
        index = scene.solid.face_names.index(face)
        middle = scene.solid.vertices[list(scene.solid.faces[index])].mean(0)
        x, y = np.rint(project(middle[None], pictures.sensors, scene.camera)[0]).astype(int)
        offsets = np.array([[i, j] for i in (-1, 1) for j in (-1, 1)])
        level = image[y + offsets[:, 1], x + offsets[:, 0]].mean()
        expected = float(face_signal(pictures, middle[None], index, 1)[0])
        assert level == pytest.approx(expected, rel=8e-3)  # the middle's pixel is up to half a px away
        seen.append(expected)
    assert max(seen) > 2 * min(seen)


@pytest.mark.render
def test_a_block_of_twice_the_same_material_is_rendered_as_of_one(task1):
    same = FaceMaterial(name="a", where="top", **task1.material.model_dump())
    assert np.array_equal(render.image(task1, SENSOR, LIGHT), render.image(with_materials(task1, same), SENSOR, LIGHT))


def test_faces_send_on_what_their_own_material_reflects():
    """On a bracket of white 0.9, a black face is lit by the others but neither sends nor shows anything."""
    scene = scenes.load("bracket")
    inner = [int(face) for face in np.flatnonzero(~scene.solid.outer)]
    names = [scene.solid.face_names[face] for face in inner]
    middles = np.array([scene.solid.triangles[scene.solid.triangle_faces == face][0].mean(0) for face in inner])
    first = FaceMaterial(name="a", faces=tuple(names[:1]), diffuse_reflectance=0.0)
    whole, some = (
        light_between(Pictures.of(Picture.of(each, (45, 135), (30, 0))), middles, np.array(inner))
        for each in (scene, with_materials(scene, first))
    )
    assert whole.min() > 0
    assert some[0] == 0
    assert (some[1:] < whole[1:]).all()
    assert whites(with_materials(scene, first))[inner[0]] == 0
