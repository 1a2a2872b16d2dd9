"""Files of several bodies that say their unit: GLB, 3MF and STEP, and which of them is measured."""

import json
import zipfile
from importlib.util import find_spec

import numpy as np
import pytest
import trimesh

from scenes import InvalidInput, Mesh
from scenes.parts import bodies, mesh, step
from scenes.parts.step_file import Step
from tests.commands import ice

lxml = pytest.mark.skipif(find_spec("lxml") is None, reason="needs lxml: pip install 'ice-vision[3mf]'")
kernel = pytest.mark.skipif(find_spec("OCP") is None, reason="needs OpenCASCADE: pip install 'ice-vision[step]'")
SINGLE = 1e-6  # of a length in single precision
MODEL = """<?xml version="1.0"?>
<model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>{objects}</resources>
<build><item objectid="1"/><item objectid="2" transform="1 0 0 0 1 0 0 0 1 30 0 0"/></build></model>"""


def two():
    """A block of 10 x 20 x 30 about the origin, and a pin of radius 2 and length 20 about its own."""
    return {"block": trimesh.creation.box((10, 20, 30)), "pin": trimesh.creation.cylinder(2, 20, sections=48)}


@pytest.fixture
def glb(tmp_path):
    """Both, the pin 30 mm aside, in metres as GLB has them."""
    scene = trimesh.Scene()
    for name, body in two().items():
        aside = trimesh.transformations.translation_matrix((0.03 * (name == "pin"), 0, 0))
        scene.add_geometry(body.apply_scale(1e-3), node_name=name, geom_name=f"mesh of {name}", transform=aside)
    path = tmp_path / "two.glb"
    path.write_bytes(scene.export(file_type="glb"))
    return path


def three_mf(path, unit):
    """The same, written out."""
    objects = object_of("block", 1) + object_of("pin", 2)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("3D/3dmodel.model", MODEL.format(unit=unit, objects=objects))
    return path


def object_of(name, number):
    """One of the two as 3MF has it."""
    body = two()[name]
    corners = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*at) for at in body.vertices)
    faces = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*face) for face in body.faces)
    inside = f"<mesh><vertices>{corners}</vertices><triangles>{faces}</triangles></mesh>"
    return f'<object id="{number}" name="{name}" type="model">{inside}</object>'


def check(read, scale=1.0):
    """All, and each by its name: sizes and middles."""
    for body, low, high in (
        ("block", (-5, -10, -15), (5, 10, 15)),
        ("pin", (28, -2, -10), (32, 2, 10)),
        (None, (-5, -10, -15), (32, 10, 15)),
    ):
        solid = read(body)
        ends = solid.vertices.min(0), solid.vertices.max(0)
        np.testing.assert_allclose(ends, scale * np.array([low, high]), atol=32 * scale * SINGLE)
        assert len(solid.circles) == (0 if body == "block" else 2)


def test_glb(glb):
    """In metres; brought to the unit that is asked for, or read as the unit that the scene says its numbers are in."""
    check(lambda body: mesh.read(glb, None, "mm", body))
    check(lambda body: Mesh(kind="mesh", file=glb, body=body).solid_in("inch"), 1 / 25.4)
    check(lambda body: Mesh(kind="mesh", file=glb, body=body).solid)
    check(lambda body: Mesh(kind="mesh", file=glb, units="cm", body=body).solid_in("mm"), 1 / 100)
    numbers = {number: np.ptp(mesh.read(glb, None, "mm", number).vertices[:, 2]) for number in (1, 2)}
    assert sorted(round(height) for height in numbers.values()) == [20, 30]


def block_glb(path, meshes, nodes):
    """A block of 2 x 3 x 4 m from the origin: its triangles are accessor 1 and 2, halves of it, and 3, all of them."""
    low = np.array([[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0], [0, 0, 4], [2, 0, 4], [2, 3, 4], [0, 3, 4]], "<f4")
    quads = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    triangles = np.array([half for a, b, c, d in quads for half in ((a, b, c), (a, c, d))], "<u2")
    data = low.tobytes() + triangles.tobytes()
    views = [(0, 96), (96, 36), (132, 36), (96, 72)]
    facts = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes,
        "materials": [{"name": "red"}, {"name": "blue"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}} | each for each in mesh]} for mesh in meshes],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [2, 3, 4]},
            *(
                {"bufferView": view, "componentType": 5123, "count": views[view][1] // 2, "type": "SCALAR"}
                for view in (1, 2, 3)
            ),
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": size} for at, size in views],
        "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    text = json.dumps(facts).encode()
    text += b" " * (-len(text) % 4)
    chunks = b"".join(len(c).to_bytes(4, "little") + k + c for c, k in ((text, b"JSON"), (data, b"BIN\0")))
    path.write_bytes(b"glTF" + b"".join(each.to_bytes(4, "little") for each in (2, 12 + len(chunks))) + chunks)
    return path


@pytest.mark.parametrize("materials", [({}, {}), ({"material": 0}, {"material": 1})], ids=["bare", "coloured"])
def test_pieces_of_one_body_in_a_glb_are_one(tmp_path, materials):
    """Exporters write a primitive for each colour: the node of two halves is one body; one below it is its own."""
    halves = [{"indices": half, **more} for half, more in zip((1, 2), materials, strict=True)]
    nodes = [
        {"name": "block", "mesh": 0, "translation": [0, 0, 7], "children": [1]},
        {"name": "block_bottom", "mesh": 1, "translation": [5, 0, -7]},
    ]
    path = block_glb(tmp_path / "halves.glb", [halves, [{"indices": 3}]], nodes)
    low, high = np.array([0, 0, 7000]), np.array([2000, 3000, 11000])
    away = np.array([5000, 0, -7000])
    for body, first, last, faces in (("block", low, high, 6), ("block_bottom", low + away, high + away, 6),
                                     (None, low + [0, 0, -7000], high + [5000, 0, 0], 12)):  # fmt: skip
        solid = mesh.read(path, None, "mm", body)
        assert solid.vertices.min(0) == pytest.approx(first)
        assert solid.vertices.max(0) == pytest.approx(last)
        assert (len(solid.faces), len(solid.sharp)) == (faces, 2 * faces)
    with pytest.raises(InvalidInput, match=r"object.body must be one of \d 'block\w*', \d 'block\w*', got 3"):
        mesh.read(path, None, "mm", 3)


def test_lines_in_a_glb_are_no_body(tmp_path):
    """Nor does what is left of a node's primitives become another one."""
    path = block_glb(tmp_path / "lines.glb", [[{"indices": 3}, {"indices": 1, "mode": 1}]], [{"name": "a", "mesh": 0}])
    assert len(mesh.read(path, None, "mm", "a").faces) == 6
    with pytest.raises(InvalidInput, match=r"object.body must be one of 1 'a', got 2"):
        mesh.read(path, None, "mm", 2)


@lxml
@pytest.mark.parametrize(("unit", "millimetres"), [("millimeter", 1), ("inch", 25.4), ("micron", 1e-3), ("meter", 1e3)])
def test_3mf(tmp_path, unit, millimetres):
    path = three_mf(tmp_path / "two.3mf", unit)
    check(lambda body: mesh.read(path, None, "mm", body), millimetres)
    check(lambda body: mesh.read(path, None, "mm", {"block": 1, "pin": 2}.get(body)), millimetres)


PACKED = """<?xml version="1.0"?>
<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" requiredextensions="{needed}"
 xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
 xmlns:b="http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02">
<resources>{objects}</resources><build>{items}</build></model>"""
ASIDE = 'transform="1 0 0 0 1 0 0 0 1 30 0 0"'


def package(path, items, root="", needed="p", **parts):
    """A 3MF package: items and objects of its first model, and objects of others."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("3D/3dmodel.model", PACKED.format(objects=root, items=items, needed=needed))
        for name, objects in parts.items():
            archive.writestr(f"3D/Objects/{name}.model", PACKED.format(objects=objects, items="", needed="p"))
    return path


def component(number, part="", more=""):
    where = f'p:path="/3D/Objects/{part}.model"' if part else ""
    return f'<components><component objectid="{number}" {where} {more}/></components>'


@lxml
def test_a_3mf_may_have_its_objects_in_other_parts(tmp_path):
    """Items of two parts, whose objects have the same number; objects of one part, in objects of the first model."""
    own = "".join(f'<item objectid="{n}" p:path="/3D/Objects/{part}.model"/>' for n, part in ((1, "a"), (2, "B")))
    inner = f'<object id="2" type="model">{component(1, more=ASIDE)}</object>'
    items = package(tmp_path / "items.3mf", own, a=object_of("block", 1), b=inner + object_of("pin", 1))
    check(lambda body: mesh.read(items, None, "mm", body))
    outer = f'<object id="1" type="model">{component(2, "both", ASIDE)}</object>'
    outer += f'<object id="2" type="model">{component(1, "both")}</object>'
    both = object_of("block", 1) + object_of("pin", 2)
    objects = package(tmp_path / "objects.3mf", '<item objectid="1"/><item objectid="2"/>', outer, both=both)
    check(lambda body: mesh.read(objects, None, "mm", body))


@lxml
def test_a_3mf_that_cannot_be_read_says_why(tmp_path):
    item = '<item objectid="1" p:path="/3D/Objects/a.model"/>'
    for name, more, match in (
        ("part.3mf", {}, r"part.3mf \(no part '3d/objects/a.model' in it\)"),
        ("object.3mf", {"a": object_of("pin", 7)}, r"object.3mf \(no object 1 in a part that is to have it\)"),
        ("beams.3mf", {"needed": "p b"}, r"it requires extensions that are not read: http://\S+/beamlattice/2017/02\)"),
    ):
        with pytest.raises(InvalidInput, match=match):
            mesh.read(package(tmp_path / name, item, **more))


def test_what_cannot_be_chosen(glb, tmp_path):
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "box.stl")
    for body in ("lid", 3, ""):
        with pytest.raises(InvalidInput, match=r"object.body must be one of \d '(pin|block)', \d '(pin|block)', got"):
            mesh.read(glb, None, "mm", body)
    with pytest.raises(InvalidInput, match=r"object.body must be left out for a STL file, which is one body, got 1"):
        mesh.read(tmp_path / "box.stl", body=1)


def test_a_body_of_another_name_is_another_part(glb):
    one, other = (Mesh(kind="mesh", file=glb, body=body) for body in ("pin", "block"))
    assert one != other
    assert hash(one) != hash(other)


def test_hostile_files_are_refused_before_memory_is_taken(tmp_path):
    """A GLB that counts numbers which it does not have, and broken ones."""
    told = json.dumps({"asset": {"version": "2.0"}, "accessors": [{"count": 10**12, "type": "VEC3"}]}).encode()
    sizes = [each.to_bytes(4, "little") for each in (2, 20 + len(told), len(told))]
    for name, data, match in (
        ("bomb.glb", b"glTF" + sizes[0] + sizes[1] + sizes[2] + b"JSON" + told, "of at most 1000000 triangles"),
        ("broken.glb", b"glTF nothing of the kind", "a broken GLB header"),
        ("none.glb", b"", "a broken GLB header"),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InvalidInput, match=match):
            mesh.read(tmp_path / name)


@pytest.mark.parametrize(("counts", "good"), [((30, 4), True), ((4, 31), False), ((), True)])
def test_a_glb_may_tell_of_three_numbers_a_triangle(counts, good):
    """Of ten triangles, if each has three corners of its own; whichever of its lists is the longest counts."""
    told = json.dumps({"accessors": [{"count": count} for count in counts]} if counts else {}).encode()
    data = b"glTF" + b"\2\0\0\0" + (20 + len(told)).to_bytes(4, "little") + len(told).to_bytes(4, "little") + b"JSON"
    if good:
        bodies._check_glb("a.glb", data + told, 10)
        return
    with pytest.raises(InvalidInput, match=r"must be of at most 10 triangles, got a.glb with 31 numbers"):
        bodies._check_glb("a.glb", data + told, 10)


@pytest.mark.parametrize(("most", "triangles", "good"), [(2, 204, True), (1, 204, False), (2, 203, False)])
def test_a_glb_may_have_so_many_bodies_and_triangles(glb, monkeypatch, most, triangles, good):
    """A block of 12, and a pin of 48 sides, of 192."""
    monkeypatch.setattr(bodies, "MOST_BODIES", most)
    if good:
        assert len(bodies.read(glb, glb.read_bytes(), triangles)[0]) == 2
        return
    with pytest.raises(InvalidInput, match=rf"at most {triangles} triangles and {most} bodies, got .* with 204 and 2"):
        bodies.read(glb, glb.read_bytes(), triangles)


@lxml
def test_archives_that_are_none_or_too_large(tmp_path, monkeypatch):
    path = three_mf(tmp_path / "two.3mf", "millimeter")
    monkeypatch.setattr(bodies, "_MOST_UNPACKED", 1000)
    with pytest.raises(InvalidInput, match=r"of at most 1000000 triangles, got .* unpacked"):
        mesh.read(path)
    path.write_bytes(b"no archive")
    with pytest.raises(InvalidInput, match="no archive"):
        mesh.read(path)


def test_without_lxml_it_says_what_to_install(tmp_path, monkeypatch):
    path = three_mf(tmp_path / "two.3mf", "millimeter")
    monkeypatch.setattr(bodies, "find_spec", lambda name: None)
    with pytest.raises(InvalidInput, match=r"a 3MF file needs lxml, pip install 'ice-vision\[3mf\]'"):
        mesh.read(path)


@kernel
def test_step(tmp_path):
    """Two plates in one file, 100 mm apart: both, each by its number, and what is told of another."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt
    from OCP.TopoDS import TopoDS_Compound

    from tests.step_parts import written

    both, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(both)
    for at, side in ((0, 10), (100, 20)):
        builder.Add(both, BRepPrimAPI_MakeBox(gp_Pnt(at, 0, 0), side, side, side).Shape())
    path = written(both, tmp_path / "two.step")
    for body, low, high, faces in ((None, 0, 120, 12), (1, 0, 10, 6), (2, 100, 120, 6)):
        solid = Step(kind="step", file=path, body=body).solid
        assert (solid.vertices[:, 0].min(), solid.vertices[:, 0].max()) == pytest.approx((low, high))
        assert len(solid.faces) == faces
    with pytest.raises(InvalidInput, match=r"object.file must be with object.body one of 1.*, 2.*, got 'x'"):
        step.read(path, "mm", "x")


def test_a_scene_of_one_body(glb, tmp_path):
    """``ice new`` writes which, and the scene that it writes is read."""
    assert ice("new", "two.glb", "--body", "block", "-o", "block.toml", cwd=tmp_path).returncode == 0
    text = (tmp_path / "block.toml").read_text()
    assert 'body = "block"' in text
    assert 'units = "mm" # of the numbers' not in text
    shown = json.loads(ice("show", "block.toml", "--json", cwd=tmp_path).stdout)
    assert (len(shown["vertices"]), len(shown["circles"])) == (8, 0)
    assert "object.body must be one of" in ice("new", "two.glb", "--body", "lid", "-o", "x.toml", cwd=tmp_path).stderr
