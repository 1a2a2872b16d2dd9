"""Parts from STEP files: exact surfaces, names, units, circles, and what is refused. Without the kernel, its record."""

import json
import math
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import scenes
from scenes import InvalidInput
from scenes.load import from_document
from scenes.parts import step, step_kernel
from scenes.parts.solid import Circle
from scenes.parts.surfaces import Cone, Cylinder, Plane

RECORD = Path(__file__).parent / "flange.step.json"
kernel = pytest.mark.skipif(find_spec("OCP") is None, reason="needs OpenCASCADE: pip install 'ice-vision[step]'")
PLATE = ((60, 40, 10), [(20, 20, 6), (45, 20, 3)])


def check_flange(part: step.StepPart, scale: float = 1.0, pieces: int = 96) -> None:
    """A disc of radius 40 and height 10 with a bore of 12, its chamfer, and six bolt holes of 4 on a circle of 28."""
    kinds = [surface.kind for surface in part.surfaces]
    assert sorted(kinds) == ["cone"] + 8 * ["cylinder"] + 2 * ["plane"]
    walls = [s for s in part.surfaces if isinstance(s, Cylinder)]
    assert sorted(round(w.radius / scale, 9) for w in walls) == 6 * [4.0] + [12.0, 40.0]
    assert [w.radius / scale > 20 for w in walls] == [not w.hollow for w in walls]
    bolts = [w.point for w in walls if w.radius < 5 * scale]
    # margin: digits of the file's own numbers
    np.testing.assert_allclose(np.hypot(*np.array(bolts)[:, :2].T), 28 * scale, rtol=1e-12)
    cone = next(s for s in part.surfaces if isinstance(s, Cone))
    assert cone.hollow
    assert abs(cone.slope) == pytest.approx(1.0)  # 45 degrees
    for number, surface in enumerate(part.surfaces):
        corners = part.triangles[part.triangle_faces == number]
        assert np.abs(surface.values(corners.reshape(-1, 3))).max() < 1e-9 * scale
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert ((surface.normals(corners.mean(1)) * facing).sum(1) > 0).all()
    solid = part.solid
    sizes = sorted(round(circle.radius / scale, 9) for circle in solid.circles)
    assert sizes == 12 * [4.0] + [12.0, 13.0] + 2 * [40.0]  # the bore's upper rim lies within it, at the chamfer
    assert len(solid.circles[0].edges) == pieces
    assert {edge.kind for edge in part.edges} == {"circle"}
    assert "top" in solid.face_names
    top = solid.face_names.index("top")
    np.testing.assert_allclose(solid.normals[top], [0, 0, 1], atol=1e-12)


def test_record_of_a_flange():
    """What the kernel said of it once, with 24 pieces a turn: all but the kernel itself."""
    record = json.loads(RECORD.read_text())
    check_flange(step.part(record), 1.0, 24)
    check_flange(step.part(record, "inch"), 1 / 25.4, 24)


def test_what_most_faces_are_called_is_no_name():
    """Some programs call each face "NONE", others by its body's name; what a face alone is called stays."""
    record = json.loads(RECORD.read_text())
    for face in record["faces"]:
        face["name"] = face["name"] if face["name"] == "top" else "NONE"
    part = step.part(record)
    assert "top" in part.solid.face_names
    assert not [name for name in part.solid.face_names if name.startswith("NONE")]
    assert [wall.name for wall in part.curved] == ["k1"]


def test_another_format_is_refused():
    with pytest.raises(InvalidInput, match="must be a record of format 2, got 1"):
        step.part({"format": 1})


@kernel
@pytest.mark.parametrize("unit", ["MM", "INCH"])
def test_read(tmp_path, unit):
    """Units come from the file: the same part in inches is as large."""
    from tests.step_parts import flange, written

    check_flange(step.read(written(flange(), tmp_path / "flange.step", {1: "top"}, unit)))


@kernel
def test_a_scene_of_it(tmp_path):
    """Planned and measured by today's means: circles by name, in the scene's unit."""
    import planner
    from tests.step_parts import drilled, written

    written(drilled(*PLATE), tmp_path / "plate.stp")
    document = tomllib.loads(Path(scenes.find("plate")).read_text())
    document |= {"object": {"kind": "step", "file": "plate.stp"}, "units": "mm", "settings": []}
    document["camera"] |= {"look_at": [30.0, 20.0, 10.0], "distance": 300.0}
    document["camera"]["focal_px"] = 2500.0
    document["light"] = {"distance": 300.0}
    document.pop("task", None)
    document["measurands"] = [{"name": "bore", "kind": "diameter", "features": [{"circle": "c2"}]}]
    for key in ("obstacles", "floor", "materials", "textures"):
        document.pop(key, None)
    file = tmp_path / "scene.toml"
    scene = from_document(file, document)
    circles = {round(c.radius, 9) for c in scene.solid.circles}
    assert circles == {6.0, 3.0}
    found = planner.predict(scene, (30.0, 30.0), (20.0, 120.0))
    assert found.status == "ok"
    assert 0 < found.measurands[0].variance_object < 1


@kernel
def test_500_faces(tmp_path):
    """A plate with 120 holes and 77 bosses: 511 faces, each on its surface; few pieces a turn, circles exact still."""
    from tests.step_parts import drilled, written

    holes = [(10 + 20 * i, 10 + 20 * j, 4) for i in range(12) for j in range(10)]
    bosses = [(18 + 20 * i, 18 + 20 * j, 3, 5) for i in range(11) for j in range(7)]
    part = step.read(written(drilled((250, 210, 10), holes, bosses), tmp_path / "plate.step"))
    assert len(part.surfaces) == 6 + 120 + 5 * 77
    solid = part.solid
    assert len(solid.circles) == 240
    assert {round(circle.radius, 12) for circle in solid.circles} == {4.0}
    assert sum(isinstance(s, Plane) for s in part.surfaces) == 391


@pytest.mark.parametrize(
    ("name", "data", "match"),
    [
        ("a.txt", b"", "must be one of .step, .stp"),
        ("none.step", None, "must be a readable STEP file"),
    ],
)
def test_refused(tmp_path, name, data, match):
    if data is not None:
        (tmp_path / name).write_bytes(data)
    with pytest.raises(InvalidInput, match=match):
        step.read(tmp_path / name)


def test_without_the_kernel_it_says_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "a.step").write_bytes(b"ISO-10303-21;")
    monkeypatch.setattr(step, "find_spec", lambda name: None)
    with pytest.raises(InvalidInput, match=r"pip install 'ice-vision\[step\]', got"):
        step.read(tmp_path / "a.step")


@kernel
@pytest.mark.parametrize("change", ["empty", "first line", "cut", "numbers", "open", "no solid", "references"])
def test_hostile_files(tmp_path, change):
    """One line, no traceback, whatever the kernel makes of it."""
    from tests.step_parts import drilled, written

    file = written(drilled(*PLATE), tmp_path / "plate.step")
    text = file.read_text()
    broken = {
        "empty": "",
        "first line": "ISO-10303-21;\n",
        "cut": text[: len(text) // 2],
        "numbers": text.replace("60.", "1e999"),
        "open": text.replace("CLOSED_SHELL('',(", "CLOSED_SHELL('',(#99999,"),
        "no solid": text.replace("MANIFOLD_SOLID_BREP", "SOMETHING"),
        "references": text.replace("#1", "#7"),
    }[change]
    file.write_text(broken)
    if change == "open":  # a face that is not there is passed over
        assert np.isfinite(step.read(file).solid.vertices).all()
        return
    with pytest.raises(InvalidInput, match=r"^object.file must [^\n]*$"):
        _ = step.read(file).solid


@kernel
def test_the_worker_is_silent(tmp_path):
    """Nothing but the record comes out, although the kernel prints."""
    from tests.step_parts import drilled, written

    data = written(drilled(*PLATE), tmp_path / "plate.step").read_bytes()
    command = [sys.executable, "-P", step_kernel.__file__, "24", "2000"]
    done = subprocess.run(command, input=data, capture_output=True, timeout=60, check=True)
    record = json.loads(done.stdout)
    assert (record["format"], record["unit"], len(record["faces"])) == (2, "mm", 8)
    assert sum(edge["kind"] == "circle" for edge in record["edges"]) == 4


def test_circles_of_the_mesh_are_those_of_the_edges_that_they_stand_for():
    """Centre, axis and radius of the nearest edge, the axis along the mesh's own; None where none is near."""

    def edge(kind, centre, axis, *radii):
        return step.StepEdge(kind, (0, 1), np.zeros((2, 3)), np.array(centre, float), np.array(axis, float), radii)

    circles = near, far, small = (
        Circle("c1", np.array([1.0, 2.0, 3.0]), np.array([0.6, 0.0, 0.8]), 2.5, 0, (), True),
        Circle("c2", np.array([-4.0, 2.0, 1.0]), np.array([0.0, 0.0, 1.0]), 1.5, 1, (), True),
        Circle("c3", np.array([4.0, -2.0, 0.5]), np.array([0.0, 1.0, 0.0]), 0.7, 2, (), False),
    )
    edges = (
        edge("ellipse", near.centre, near.axis, near.radius, near.radius / 2),
        edge("circle", near.centre + [0, 0, 3e-6], -near.axis, near.radius + 2e-6),
        edge("circle", near.centre + [4e-6, 0, 0], near.axis, near.radius + 7e-6),
        edge("circle", far.centre + [0, 3e-4, 0], far.axis, far.radius),
        edge("circle", small.centre, small.axis, small.radius + 3e-4),
    )
    part = step.StepPart((), (), edges, np.zeros((0, 3, 3)), np.zeros(0, int))
    made, found = zip(*part._exact(circles, 10.0), strict=True)
    assert made == circles
    assert found[0].centre.tolist() == edges[1].centre.tolist()
    assert found[0].axis.tolist() == near.axis.tolist()
    assert found[0].radius == near.radius + 2e-6
    assert found[1:] == (None, None)
    bare = step.StepPart((), (), edges[:1], np.zeros((0, 3, 3)), np.zeros(0, int))
    assert list(bare._exact(circles, 10.0)) == [(near, None), (far, None), (small, None)]


@kernel
def test_a_surface_beside_the_solid_is_none_of_its_faces(tmp_path):
    """As datum targets and construction geometry stand in files of CAD systems."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Dir, gp_Pln, gp_Pnt
    from OCP.TopoDS import TopoDS_Compound

    from tests.step_parts import drilled, written

    plate, both, builder = drilled(*PLATE), TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(both)
    builder.Add(both, plate)
    builder.Add(both, BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(10, 10, 10), gp_Dir(0, 0, 1)), -4, 4, -3, 3).Face())
    alone, beside = (
        step.read(written(shape, tmp_path / f"{name}.step")) for name, shape in (("a", plate), ("b", both))
    )
    assert len(beside.surfaces) == len(alone.surfaces) == 8
    np.testing.assert_allclose(beside.solid.triangles, alone.solid.triangles, atol=1e-12)


@kernel
def test_a_part_cut_as_splines_is_the_same_part(tmp_path, monkeypatch):
    """Where the surfaces leave holes: the faces are still cylinders and planes, and the volume is theirs."""
    from tests.step_parts import drilled, written

    monkeypatch.setattr(step_kernel, "_WAYS", (("splines", 1),))
    record = step_kernel.record(written(drilled(*PLATE), tmp_path / "plate.step").read_bytes(), 96, 2000)
    part = step.part(record)
    assert sorted(surface.kind for surface in part.surfaces) == 2 * ["cylinder"] + 6 * ["plane"]
    assert sorted(round(circle.radius, 9) for circle in part.solid.circles) == [3.0, 3.0, 6.0, 6.0]
    assert len(part.solid.sharp) == 12
    a, b, c = part.solid.triangles.swapaxes(0, 1)
    volume = np.einsum("ti,ti->", a, np.cross(b, c)) / 6
    exact = 60 * 40 * 10 - np.pi * (6**2 + 3**2) * 10
    chords = 10 * (6**2 + 3**2) * np.pi * (2 * np.pi / 96) ** 2 / 6  # of polygons of 96 sides
    assert exact < volume < exact + 1.5 * chords


@kernel
def test_a_part_cut_finely_has_as_many_pieces_of_each_turn(tmp_path, monkeypatch):
    """Of a bore of 0.04 mm, too, whose points are nearer to each other than the kernel lets them be by itself."""
    from tests.step_parts import drilled, written

    data = written(drilled((1.0, 1.0, 0.5), [(0.3, 0.4, 0.02)]), tmp_path / "small.step").read_bytes()
    monkeypatch.setattr(step_kernel, "_WAYS", (("fine", 1),))
    record = step_kernel.record(data, 96, 2000)
    counts = {face["kind"]: len(face["triangles"]) for face in record["faces"]}
    assert counts["cylinder"] == 2 * 96


def test_a_cone_has_the_radius_of_its_middle():
    """From 1 at its first end to 5 at its last; the file's own point is where it is 1, and may be its tip."""
    made = step._cone(np.array([7.0, 0, 0]), np.array([0, 0, 1.0]), 1.0, math.atan(0.5), [0.0, 8.0], True)
    assert np.asarray(made.point).tolist() == [7, 0, 4]
    assert (made.radius, made.ends) == (pytest.approx(3.0), (-4.0, 4.0))
