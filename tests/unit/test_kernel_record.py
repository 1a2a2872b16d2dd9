"""What is recorded of OpenCASCADE's shapes, by a stand-in for it: no kernel is needed."""

import io
import json
import math
import sys
from types import ModuleType, SimpleNamespace

import pytest

from scenes.parts import step_kernel
from scenes.parts.step_kernel import Unusable


class Shape:
    """A face, edge or solid of a stand-in: all have one hash, and those of one name are the same."""

    def __init__(self, name, parts=(), turned=False, **facts):
        self.name, self.parts, self.turned = name, parts, turned
        self.__dict__.update(facts)

    def __hash__(self):
        return 7

    def __eq__(self, other):
        return self is other

    def IsSame(self, other):  # noqa: N802
        return self.name == other.name

    def Orientation(self):  # noqa: N802
        return "reversed" if self.turned else "forward"


class Explorer:
    """Goes through the parts of one kind."""

    def __init__(self, shape, kind):
        self.left = [part for part in shape.parts if part.kind == kind]

    def More(self):  # noqa: N802
        return bool(self.left)

    def Current(self):  # noqa: N802
        return self.left[0]

    def Next(self):  # noqa: N802
        self.left = self.left[1:]


def vector(x, y, z):
    moved = lambda turn: vector(x + turn[0], y + turn[1], z + turn[2])  # noqa: E731
    return SimpleNamespace(X=lambda: x, Y=lambda: y, Z=lambda: z, Transformed=moved)


def curve(kind, **numbers):
    """The adaptor of an edge's curve, from parameter 0.5 to 2: there its point is (t, 2 t, 3 t)."""
    position = SimpleNamespace(Location=lambda: vector(1, 2, 3), Direction=lambda: vector(0, 0.6, 0.8))
    shape = SimpleNamespace(Position=lambda: position, **{name: (lambda v=v: v) for name, v in numbers.items()})
    return SimpleNamespace(
        GetType=lambda: f"GeomAbs_CurveType.GeomAbs_{kind}", FirstParameter=lambda: 0.5, LastParameter=lambda: 2.0,
        Value=lambda t: vector(t, 2 * t, 3 * t), **{kind: lambda: shape},
    )  # fmt: skip


@pytest.fixture
def kernel(monkeypatch):
    """OpenCASCADE's names as far as they are used; ``said`` is what the test lets it read."""
    said = SimpleNamespace(
        status=1, roots=1, shapes=1, whole=None, names={}, mesh=None, moved=(0, 0, 0), cut=None,
        healed=lambda: None, splined=lambda shape: shape,
    )  # fmt: skip
    entity = lambda face, _: said.names.get(face.name)  # noqa: E731

    class Reader:
        ReadStream = staticmethod(lambda name, data: said.status if data.read().startswith(b"data") else 0)
        TransferRoots = staticmethod(lambda: said.roots)
        NbShapes = staticmethod(lambda: said.shapes)
        OneShape = staticmethod(lambda: said.whole)
        WS = staticmethod(lambda: SimpleNamespace(
            TransferReader=lambda: SimpleNamespace(EntityFromShapeResult=entity),
            Model=lambda: SimpleNamespace(
                NbEntities=lambda: len(said.names), Value=lambda number: list(said.names.values())[number - 1]
            ),
        ))  # fmt: skip

    def cut(*given):
        said.cut = said.cut or given  # the first way

    cast = SimpleNamespace(Face=lambda s: s, Edge=lambda s: s, Solid=lambda s: s)
    kinds = SimpleNamespace(TopAbs_FACE="face", TopAbs_EDGE="edge", TopAbs_SOLID="solid")
    names = {
        "OCP": {},
        "OCP.BRepMesh": {"BRepMesh_IncrementalMesh": cut},
        "OCP.BRepTools": {"BRepTools": SimpleNamespace(Clean_s=lambda shape: None)},
        "OCP.ShapeFix": {"ShapeFix_Shape": lambda shape: SimpleNamespace(Perform=said.healed, Shape=lambda: shape)},
        "OCP.BRepBuilderAPI": {
            "BRepBuilderAPI_NurbsConvert": lambda shape: SimpleNamespace(Shape=lambda: said.splined(shape)),
        },
        "OCP.IMeshTools": {"IMeshTools_Parameters": SimpleNamespace},
        "OCP.Message": {"Message_ProgressRange": lambda: None},
        "OCP.STEPControl": {"STEPControl_Reader": Reader},
        "OCP.TopAbs": {
            "TopAbs_ShapeEnum": kinds, "TopAbs_Orientation": SimpleNamespace(TopAbs_REVERSED="reversed"),
        },
        "OCP.TopExp": {"TopExp_Explorer": Explorer},
        "OCP.TopoDS": {"TopoDS": cast},
        "OCP.BRep": {"BRep_Tool": SimpleNamespace(Triangulation_s=lambda face, location: said.mesh)},
        "OCP.TopLoc": {"TopLoc_Location": lambda: SimpleNamespace(Transformation=lambda: said.moved)},
        "OCP.BRepAdaptor": {
            "BRepAdaptor_Surface": lambda face: face.surface, "BRepAdaptor_Curve": lambda edge: edge.curve,
        },
    }  # fmt: skip
    for name, facts in names.items():
        module = ModuleType(name)
        module.__dict__.update(facts)
        monkeypatch.setitem(sys.modules, name, module)
        if "." in name:
            setattr(sys.modules["OCP"], name.split(".")[1], module)
    return said


def plain(name, parts=(), kind="Other"):
    """A face on a surface of a kind that tells no numbers."""
    adaptor = SimpleNamespace(GetType=lambda: f"GeomAbs_SurfaceType.GeomAbs_{kind}")
    return Shape(name, parts, kind="face", surface=adaptor)


def body(*faces, solid=True):
    return Shape("body", [*faces, *([Shape("solid", faces, kind="solid")] if solid else [])])


def triangles(count=1):
    """Nodes (10 i, i, 0) and triangles of those that follow each other."""
    corner = lambda i: SimpleNamespace(Get=lambda: (i, i + 1, i + 2))  # noqa: E731
    return SimpleNamespace(
        NbNodes=lambda: count + 2, Node=lambda i: vector(10 * i, i, 0), NbTriangles=lambda: count, Triangle=corner
    )


def test_parts_are_told_apart_by_what_they_are_not_by_their_hash(kernel):
    """In the file's order, each once, of one kind."""
    faces = [plain("b"), plain("a"), plain("b"), plain("c")]
    some, more = Shape("all", [*faces, Shape("e", kind="edge")]), Shape("more", [plain("d"), plain("a")])
    found = step_kernel._parts([some, more], "TopAbs_FACE", "Face")
    assert [face.name for face in found] == ["b", "a", "c", "d"]


def test_an_edge_knows_all_of_its_faces_and_a_seam_is_none(kernel, monkeypatch):
    monkeypatch.setattr(step_kernel, "_bend", lambda edge, faces: 0.5 + len(faces))
    edges = {name: Shape(name, kind="edge", curve=curve("Line")) for name in "uvwx"}
    again = Shape("v", kind="edge", curve=curve("Line"))
    faces = [
        plain("f", [edges["u"], edges["v"]]),
        plain("g", [edges["w"]]),
        plain("h", [again, edges["u"], edges["x"]]),
    ]
    found = step_kernel._edges([*faces, plain("i", [edges["x"], edges["w"], edges["u"]])])
    assert [edge["faces"] for edge in found] == [[0, 2, 3], [0, 2], [1, 3], [2, 3]]
    assert {(edge["bend"], edge["straight"]) for edge in found} == {(2.5, True)}
    assert step_kernel._edges([plain("f", [edges["u"], edges["u"]])]) == []


def test_curves_are_recorded_as_they_are(kernel):
    """Ends at the first and the last parameter; numbers of circles and ellipses alone."""
    ends, place = {"ends": [[0.5, 1.0, 1.5], [2.0, 4.0, 6.0]]}, {"point": [1, 2, 3], "axis": [0, 0.6, 0.8]}
    of = lambda kind, **numbers: step_kernel._curve(SimpleNamespace(curve=curve(kind, **numbers)))  # noqa: E731
    assert of("Line") == {"kind": "line"} | ends
    assert of("Circle", Radius=4.0) == {"kind": "circle", "radius": 4.0, "turn": 1.5} | place | ends
    assert of("Ellipse", MajorRadius=5.0, MinorRadius=3.0) == {"kind": "ellipse", "radii": [5.0, 3.0]} | place | ends
    assert of("BSplineCurve") == {"kind": "other"} | ends


def test_triangles_are_counter_clockwise_from_outside(kernel):
    """Indices begin at 1 in the kernel; where it stands is added; the other way round on a reversed face."""
    kernel.mesh, kernel.moved = triangles(2), (0.5, 0.25, -3)
    found = step_kernel._triangles(plain("f"))
    assert found["nodes"] == [[10.5, 1.25, -3], [20.5, 2.25, -3], [30.5, 3.25, -3], [40.5, 4.25, -3]]
    assert found["triangles"] == [[0, 1, 2], [1, 2, 3]]
    assert step_kernel._triangles(Shape("f", turned=True))["triangles"] == [[0, 2, 1], [1, 3, 2]]


def test_ways_to_a_closed_surface(kernel):
    """Triangles of a tetrahedron are taken at once; of an open one the shape is healed, cut with nearer points, divided
    more coarsely, and cut as splines, whose faces are still what they were; the first way's if none closes it.
    """
    tried = []
    tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    nodes = [vector(0, 0, 0), vector(1, 0, 0), vector(0, 1, 0), vector(0, 0, 1)]

    def of(triangles):
        corner = lambda i: SimpleNamespace(Get=lambda: [k + 1 for k in triangles[i - 1]])  # noqa: E731
        return SimpleNamespace(
            NbNodes=lambda: 4, Node=lambda i: nodes[i - 1], NbTriangles=lambda: len(triangles), Triangle=corner
        )

    def cut(shape, how, _):
        kernel.mesh = of(tetrahedron if shape is splined and kernel.helps else kernel.there)
        tried.append(round(4 * math.pi / how.Angle))

    sys.modules["OCP.BRepMesh"].BRepMesh_IncrementalMesh = cut
    kernel.healed = lambda: tried.append("healed")
    kernel.whole, splined = body(plain("f")), body(plain("g", kind="BSplineSurface"))
    kernel.splined = lambda shape: tried.append("splines") or splined
    kernel.there, kernel.helps = tetrahedron, False
    assert len(step_kernel.record(b"data", 96, 2000)["faces"][0]["triangles"]) == 4
    assert tried == [96]
    tried.clear()
    kernel.there, kernel.names = tetrahedron[:3], {"f": SimpleNamespace(Name=lambda: None)}
    coarser = ["healed", 96, 96, 48, "healed", 48, "splines"]
    assert step_kernel.record(b"data", 96, 2000)["segments"] == 96
    assert tried == [96, *coarser, 96, "splines", 48]
    tried.clear()
    kernel.helps = True
    found = step_kernel.record(b"data", 96, 2000)
    assert tried == [96, *coarser, 96]
    assert (len(found["faces"][0]["triangles"]), found["segments"]) == (4, 96)
    tried.clear()
    kernel.splined = lambda shape: {}["BSpline curve: Knots interval values too close"]
    found = step_kernel.record(b"data", 96, 2000)  # a way at which the kernel breaks down is one that does not help
    assert tried == [96, *coarser[:-1]]
    assert (len(found["faces"][0]["triangles"]), found["segments"]) == (3, 96)


def test_faces_that_cannot_be_cut_are_refused(kernel, monkeypatch):
    """By their number, what the first is, and where."""
    kernel.whole = body(plain("f"))
    with pytest.raises(Unusable, match=r"of faces that can be cut into triangles, got 1 that cannot: a surface$"):
        step_kernel.record(b"data", 20, 2000)
    edge = Shape("e", kind="edge", curve=curve("Line"))
    kernel.whole = body(plain("f", [edge]), plain("g"))
    with pytest.raises(Unusable, match=r"got 2 that cannot: a surface through \(0.5, 1, 1.5\) mm$"):
        step_kernel.record(b"data", 20, 2000)
    solids = [Shape(name, (plain(name),), kind="solid") for name in "abc"]
    kernel.whole = Shape("bodies", [*(solid.parts[0] for solid in solids), *solids])
    with pytest.raises(Unusable, match=r"got 3 that cannot: a surface \(of 3 bodies object.body chooses one\)$"):
        step_kernel.record(b"data", 20, 2000)
    uncut = solids[0].parts[0], solids[2].parts[0]
    monkeypatch.setattr(step_kernel, "_mesh", lambda face: None if face in uncut else "triangles")
    with pytest.raises(Unusable, match=r"got 2 that .*\(of 3 bodies object.body chooses one, but for 1, 3\)$"):
        step_kernel.record(b"data", 20, 2000)


def test_a_face_that_cannot_be_cut_stays_open_where_most_can(kernel, monkeypatch):
    """It has no triangles, and is named; its surface and the others are as before."""
    kernel.whole, kernel.mesh = body(*map(plain, "fgh")), triangles(2)
    monkeypatch.setattr(step_kernel, "_mesh", lambda face, *_: None if face.name == "g" else kernel.mesh)
    found = step_kernel.record(b"data", 20, 2000)
    assert [len(face["triangles"]) for face in found["faces"]] == [2, 0, 2]
    assert found["uncut"] == "1, a surface"
    monkeypatch.setattr(step_kernel, "_mesh", lambda face, *_: kernel.mesh)
    assert "uncut" not in step_kernel.record(b"data", 20, 2000)


@pytest.mark.parametrize(
    ("faces", "most", "pieces"), [(2, 2000, 96), (2, 83, 81), (2, 25, 23), (2, 14, 12), (2, 3, 12), (3, 83, 40)]
)
def test_pieces_of_a_turn(kernel, faces, most, pieces):
    """As many as are wanted, as the faces' number allows for each curved one, and at least 12; one plane is none."""
    kernel.mesh = triangles()
    plane = SimpleNamespace(
        Axis=lambda: SimpleNamespace(Direction=lambda: vector(0, 0, 1)),
        Position=lambda: SimpleNamespace(Direct=lambda: True), Location=lambda: vector(0, 0, 0),
    )  # fmt: skip
    flat = plain("plane", kind="Plane")
    flat.surface.Plane = lambda: plane
    kernel.whole = body(flat, *(plain(f"f{i}") for i in range(faces - 1)))
    kernel.names = {"f0": SimpleNamespace(Name=lambda: SimpleNamespace(ToCString=lambda: "bore"))}
    kernel.names["plane"] = SimpleNamespace(Name=lambda: None)
    found = step_kernel.record(b"data", 96, most)
    assert (found["segments"], found["unit"], found["format"]) == (pieces, "mm", step_kernel.FORMAT)
    assert kernel.cut[0] is kernel.whole
    assert kernel.cut[1].Angle == pytest.approx(2 * (2 * math.pi / pieces))  # an angle of two pieces
    assert [face["name"] for face in found["faces"]] == ["", "bore", ""][:faces]
    assert [face["kind"] for face in found["faces"]] == ["plane", "other", "other"][:faces]
    assert [face["place"] for face in found["faces"]] == [1, 0, -1][:faces]
    assert found["faces"][0]["triangles"] == [[0, 1, 2]]


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"status": 0}, "a readable STEP file, got something else"),
        ({"roots": 0}, "of a solid body, got none"),
        ({"shapes": 0}, "of a solid body, got none$"),
        ({"whole": body(plain("f"), solid=False)}, r"got none \(faces that enclose no body: 1\)$"),
        ({"whole": body()}, "of a solid body, got none$"),
        ({"whole": body(*map(plain, "fgh"))}, "of at most 2 faces, got 3"),
    ],
)
def test_what_is_no_body_is_refused(kernel, change, match):
    kernel.mesh, kernel.whole = triangles(), body(plain("f"), plain("g"))
    assert step_kernel.record(b"data", 96, 2)["segments"] == 12
    kernel.__dict__.update(change)
    with pytest.raises(Unusable, match=match):
        step_kernel.record(b"data", 96, 2)


def test_an_assembly_of_other_files_names_them(kernel):
    """Whose parts a file refers to, and has no body of its own."""
    kernel.roots = 0
    others = b"data #3=DOCUMENT_FILE('lid.stp','','',#4,'',$) ;\n#7 = DOCUMENT_FILE ( 'box.stp','','',#8,'',$);"
    with pytest.raises(Unusable, match=r"got none \(it names other files: 'lid.stp', 'box.stp'\)$"):
        step_kernel.record(others, 96, 2)


@pytest.mark.parametrize(
    ("change", "status", "said"),
    [
        ({}, 0, ""),
        ({"status": 0}, 2, "a readable STEP file, got something else\n"),
        ({"names": None}, 2, "readable by OpenCASCADE, got a broken one\n"),
        (None, 3, "missing\n"),
    ],
)
def test_the_process_ends_with_a_record_or_one_line(kernel, monkeypatch, capfd, change, status, said):
    kernel.mesh, kernel.whole = triangles(), body(plain("f"), plain("g"))
    if change is None:
        monkeypatch.setitem(sys.modules, "OCP.BRepMesh", None)
    else:
        kernel.__dict__.update(change)
    monkeypatch.setattr(sys, "argv", ["step_kernel.py", "48", "33"])
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(b"data")))
    kept = step_kernel.os.dup(1)
    try:
        assert step_kernel.main() == status
    finally:
        step_kernel.os.dup2(kept, 1)
        step_kernel.os.close(kept)
    out, err = capfd.readouterr()
    assert err == said
    assert (json.loads(out)["segments"] == 15) if status == 0 else out == ""
