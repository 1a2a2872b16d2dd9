"""Dimensions and tolerances of STEP AP242 files: against OpenCASCADE's own reader, and entity by entity."""

from collections import Counter
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import scenes
from imaging.features.measurand import measurands
from imaging.pictures import Pictures
from scenes.measurands.drawn import drawn
from scenes.parts import pmi, step
from validation.new_scene import written

CTC_01 = Path(__file__).parents[1] / "nist" / "ctc_01.stp"
kernel = pytest.mark.skipif(find_spec("OCP") is None, reason="needs OpenCASCADE: pip install 'ice-vision[step]'")

UNITS = """#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#2=(CONVERSION_BASED_UNIT('INCH',#3)LENGTH_UNIT()NAMED_UNIT(#9));
#3=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#1);
#4=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#5=ADVANCED_FACE('',(),#8,.T.);
#6=ADVANCED_FACE('',(),#8,.T.);
#7=ADVANCED_FACE('',(),#8,.T.);
#20=SHAPE_ASPECT('','',#8,.T.);
#21=SHAPE_ASPECT('','',#8,.T.);
#22=COMPOSITE_SHAPE_ASPECT('','',#8,.T.);
#23=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#20,#8,#5);
#24=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#21,#8,(#6,#7));
#25=SHAPE_ASPECT_RELATIONSHIP('','',#22,#20);
#26=SHAPE_ASPECT_RELATIONSHIP('','',#22,#21);
"""


def _measure(number, value, unit="#1", kind="LENGTH_MEASURE", name="nominal value"):
    return (
        f"#{number}=({kind}_WITH_UNIT()MEASURE_REPRESENTATION_ITEM()MEASURE_WITH_UNIT({kind}({value}),{unit})"
        f"REPRESENTATION_ITEM('{name}'));\n"
    )


def _shown(dimension, *items):
    names = ",".join(f"#{item}" for item in items)
    return (
        f"#90=SHAPE_DIMENSION_REPRESENTATION('',({names}),#8);\n"
        f"#91=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#{dimension},#90);\n"
    )


def _read(text):
    return pmi.read((UNITS + text).encode())


def test_a_diameter_with_its_deviations():
    text = "#30=DIMENSIONAL_SIZE(#20,'diameter');\n" + _measure(31, 20.0) + _shown(30, 31)
    text += "#32=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(-0.1),#1);\n"
    text += "#33=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.05),#1);\n"
    text += "#34=TOLERANCE_VALUE(#32,#33);\n#35=PLUS_MINUS_TOLERANCE(#34,#30);\n"
    (found,) = _read(text).characteristics
    assert (found.number, found.kind, found.value, found.plus, found.minus) == (30, "diameter", 20.0, 0.05, 0.1)
    assert (found.unit, found.faces, found.others, found.is_tolerance) == ("mm", (5,), (), False)


def test_limits_and_inches():
    text = "#30=DIMENSIONAL_SIZE(#22,'diameter');\n" + _measure(31, 2.0, "#2", name="upper limit")
    text += _measure(32, 1.9, "#2", name="lower limit") + _shown(30, 31, 32)
    (found,) = _read(text).characteristics
    assert (found.value, found.plus, found.minus) == pytest.approx((1.95 * 25.4, 0.05 * 25.4, 0.05 * 25.4))
    assert found.faces == (5, 6, 7)


def test_a_fit_of_iso_286():
    text = "#30=DIMENSIONAL_SIZE(#20,'diameter');\n" + _measure(31, 20.0) + _shown(30, 31)
    text += "#34=LIMITS_AND_FITS('H','hole','7','');\n#35=PLUS_MINUS_TOLERANCE(#34,#30);\n"
    (found,) = _read(text).characteristics
    assert (found.value, found.plus, found.minus, found.fit) == (20.0, 0.021, 0.0, "H7")


def test_a_general_tolerance_is_of_lengths_that_have_none():
    """20 mm +-0.2 in class m; not what has limits, is exact, has no value, or is an angle."""
    free = pmi.Characteristic(1, "diameter", 20.0)
    told = pmi.with_general(free, "m")
    assert (told.plus, told.minus, told.general) == (0.2, 0.2, "ISO 2768-m")
    for same in (
        pmi.Characteristic(1, "diameter", 20.0, 0.1, 0.1), pmi.Characteristic(1, "diameter", 20.0, note="theoretical"),
        pmi.Characteristic(1, "diameter"), pmi.Characteristic(1, "angle", 20.0, unit="deg"),
        pmi.Characteristic(1, "flatness", zone=0.1), pmi.Characteristic(1, "diameter", 0.2),
    ):  # fmt: skip
        assert pmi.with_general(same, "m") is same


@pytest.mark.parametrize(
    ("stated", "found"), [("m", "m"), ("ISO 2768-mK", "m"), ("ISO2768-f", "f"), ("ISO 22081", ""), ("x", "")]
)
def test_a_general_tolerance_that_the_file_states(stated, found):
    text = "#30=DIMENSIONAL_SIZE(#20,'diameter');\n" + _measure(31, 20.0) + _shown(30, 31)
    text += "#60=REPRESENTATION('default tolerance',(#61),#8);\n"
    text += f"#61=DESCRIPTIVE_REPRESENTATION_ITEM('tolerance class','{stated}');\n"
    assert _read(text).general == found


@pytest.mark.parametrize("note", ["theoretical", "auxiliary"])
def test_a_dimension_that_has_no_limits_for_a_reason(note):
    text = "#30=DIMENSIONAL_SIZE(#20,'diameter');\n" + _measure(31, 20.0) + _shown(30, 31, 32)
    text += f"#32=DESCRIPTIVE_REPRESENTATION_ITEM('dimensional note','{note}');\n"
    (found,) = _read(text).characteristics
    assert (found.value, found.plus, found.note) == (20.0, None, note)


@pytest.mark.parametrize(
    "entity",
    [
        "ANGULAR_LOCATION('angle',$,#20,#21,.EQUAL.)",
        "(ANGULAR_LOCATION(.EQUAL.)DIMENSIONAL_LOCATION()SHAPE_ASPECT_RELATIONSHIP('angle',$,#20,#21))",
    ],
)
def test_an_angle_between_two_features(entity):
    text = f"#30={entity};\n" + _measure(31, np.pi / 3, "#4", "PLANE_ANGLE_MEASURE") + _shown(30, 31)
    (found,) = _read(text).characteristics
    assert (found.kind, found.unit, found.faces, found.others) == ("angle", "deg", (5,), (6, 7))
    assert found.value == pytest.approx(60.0)


def test_a_position_in_a_datum_system_with_a_common_datum():
    """Its zone, the modifier, letters in order; a dimension as what is toleranced stands for its faces."""
    text = "#29=DIMENSIONAL_SIZE(#21,'diameter');\n#31=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.25),#1);\n"
    text += "#40=DATUM('',$,#8,.F.,'A');\n#41=DATUM('',$,#8,.F.,'B');\n#42=DATUM('',$,#8,.F.,'C');\n"
    text += "#43=DATUM_REFERENCE_COMPARTMENT('',$,#8,.F.,#40,(SIMPLE_DATUM_REFERENCE_MODIFIER(.TRANSLATION.)));\n"
    most = "(SIMPLE_DATUM_REFERENCE_MODIFIER(.MAXIMUM_MATERIAL_REQUIREMENT.))"
    text += f"#44=DATUM_REFERENCE_ELEMENT('',$,#8,.F.,#41,{most});"
    text += "\n#45=DATUM_REFERENCE_ELEMENT('',$,#8,.F.,#42,$);\n"
    text += "#46=DATUM_REFERENCE_COMPARTMENT('',$,#8,.F.,COMMON_DATUM_LIST((#44,#45)),$);\n"
    text += "#47=DATUM_SYSTEM('',$,#8,.F.,(#43,#46));\n"
    text += "#50=(GEOMETRIC_TOLERANCE('','',#31,#29)GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#47))"
    text += "GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.MAXIMUM_MATERIAL_REQUIREMENT.))POSITION_TOLERANCE());\n"
    text += "#51=TOLERANCE_ZONE_FORM('cylindrical or circular');\n#52=TOLERANCE_ZONE('',$,#8,.F.,(#50),#51);\n"
    text += "#53=DATUM_FEATURE('',$,#8,.T.);\n#54=SHAPE_ASPECT_RELATIONSHIP('',$,#53,#40);\n"
    text += "#55=ITEM_IDENTIFIED_REPRESENTATION_USAGE('',$,#53,#8,SET_REPRESENTATION_ITEM((#7,#5)));\n"
    read = _read(text)
    size, found = read.characteristics
    assert size.value is None
    assert (found.kind, found.zone, found.is_round, found.modifiers) == ("position", 0.25, True, ("M",))
    assert (found.datums, found.faces, found.is_tolerance) == (("A", "B-C"), (6, 7), True)
    assert found.datum_modifiers == ("translation", "M")
    assert read.datums == {"A": (7, 5), "B": (), "C": ()}


def test_a_flatness_and_an_older_datum_reference():
    text = "#31=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.2),#1);\n#40=DATUM('',$,#8,.F.,'A');\n"
    text += "#41=DATUM_REFERENCE(1,#40);\n#50=FLATNESS_TOLERANCE('','',#31,#20);\n"
    text += "#51=PERPENDICULARITY_TOLERANCE('','',#31,#21,(#41));\n"
    flat, upright = _read(text).characteristics
    assert (flat.kind, flat.zone, flat.datums, flat.is_round) == ("flatness", 0.2, (), False)
    assert (upright.kind, upright.datums, upright.faces) == ("perpendicularity", ("A",), (6, 7))


def test_a_dimension_between_edges_is_of_the_faces_beside_them():
    """Edge 70 lies between faces 5 and 6, edge 71 between 6 and 7; a tolerance of an edge is of no face."""
    text = "#30=DIMENSIONAL_LOCATION('linear distance',$,#40,#41);\n" + _measure(31, 20.0) + _shown(30, 31)
    text += "#40=SHAPE_ASPECT('',$,#8,.T.);\n#41=SHAPE_ASPECT('',$,#8,.T.);\n"
    text += "#42=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#40,#8,#70);\n"
    text += "#43=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#41,#8,#71);\n"
    text += "#44=FLATNESS_TOLERANCE('','',#31,#40);\n"
    text += "#70=EDGE_CURVE('',#1,#2,#3,.T.);\n#71=EDGE_CURVE('',#1,#2,#3,.T.);\n"
    for face, edges in ((5, (70,)), (6, (70, 71)), (7, (71,))):
        used = ",".join(f"#{10 * face + edge}" for edge in edges)
        text += "".join(f"#{10 * face + edge}=ORIENTED_EDGE('',*,*,#{edge},.T.);\n" for edge in edges)
        text += f"#{500 + face}=EDGE_LOOP('',({used}));\n#{600 + face}=FACE_OUTER_BOUND('',#{500 + face},.T.);\n"
        text += f"#{face}=ADVANCED_FACE('',(#{600 + face}),#8,.T.);\n"
    found, flat = _read(text).characteristics
    assert (found.faces, found.others) == ((5, 6), (6, 7))
    assert flat.faces == ()


def test_aspects_that_are_each_others_parts_end():
    text = "#60=SHAPE_ASPECT_RELATIONSHIP('','',#20,#22);\n#30=DIMENSIONAL_SIZE(#22,'diameter');\n"
    (found,) = _read(text).characteristics
    assert found.faces == (5, 6, 7)


def test_a_file_without_any():
    assert pmi.read(b"ISO-10303-21;DATA;#1=ADVANCED_FACE('',(),#2,.T.);ENDSEC;").characteristics == ()


def _by_kernel(path):
    """(kind, value, plus, minus) of dimensions with a value, and (kind, zone, datums), as OpenCASCADE reads them."""
    from OCP.collections import Sequence_TDF_Label
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDF import TDF_AttributeIterator
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import (
        XCAFDoc_Datum,
        XCAFDoc_Dimension,
        XCAFDoc_DimTolTool,
        XCAFDoc_DocumentTool,
        XCAFDoc_GeomTolerance,
    )

    def attribute(label, kind):
        each = TDF_AttributeIterator(label)
        while each.More():
            if isinstance(each.Value(), kind):
                return each.Value().GetObject()
            each.Next()
        return None

    def labels(get):
        found = Sequence_TDF_Label()
        get(found)
        return [found.Value(i) for i in range(1, found.Length() + 1)]

    document, reader = TDocStd_Document(TCollection_ExtendedString("XmlXCAF")), STEPCAFControl_Reader()
    reader.SetGDTMode(True)
    assert int(reader.ReadFile(str(path))) == 1
    reader.Transfer(document)
    tool = XCAFDoc_DocumentTool.DimTolTool_s(document.Main())
    dimensions, tolerances = [], []
    for label in labels(tool.GetDimensionLabels):
        here = attribute(label, XCAFDoc_Dimension)
        values = here.GetValues()
        numbers = [] if values is None else [values.Value(i) for i in range(values.Lower(), values.Upper() + 1)]
        if numbers:
            kind = str(here.GetType()).rsplit("_", 1)[-1].split(":")[0].lower()
            low, high = (
                numbers[:2] if here.IsDimWithRange()
                else (numbers[0] - here.GetLowerTolValue(), numbers[0] + here.GetUpperTolValue())
            )  # fmt: skip
            dimensions.append((kind, round(low, 6), round(high, 6)))
    for label in labels(tool.GetGeomToleranceLabels):
        here = attribute(label, XCAFDoc_GeomTolerance)
        systems = Sequence_TDF_Label()
        XCAFDoc_DimTolTool.GetDatumWithObjectOfTolerLabels_s(label, systems)
        letters = [
            attribute(systems.Value(i), XCAFDoc_Datum).GetName().ToCString() for i in range(1, systems.Length() + 1)
        ]
        kind = str(here.GetType()).rsplit("_", 1)[-1].split(":")[0].lower()
        tolerances.append((kind, round(here.GetValue(), 6), tuple(letters)))
    return Counter(dimensions), Counter(tolerances)


_KERNEL_KINDS = {"profile of a surface": "profileofsurface", "angle": "angular"}


@kernel
def test_nists_part_as_opencascade_reads_it():
    """Kinds, limits, zones and datum systems are those that another reader finds in the same file."""
    read = pmi.read(CTC_01.read_bytes())
    dimensions, tolerances = _by_kernel(CTC_01)
    mine = Counter(
        (_KERNEL_KINDS.get(each.kind, each.kind), round(each.value - each.minus, 6), round(each.value + each.plus, 6))
        for each in read.characteristics if each.value is not None
    )  # fmt: skip
    zones = Counter(
        (_KERNEL_KINDS.get(each.kind, each.kind), round(each.zone, 6), each.datums)
        for each in read.characteristics if each.is_tolerance
    )  # fmt: skip
    assert len(dimensions) >= 6
    assert mine == dimensions
    assert zones == tolerances
    assert {letter: len(faces) for letter, faces in read.datums.items()} == {"A": 1, "B": 2, "C": 2}


@kernel
def test_dimensions_are_of_the_faces_that_the_file_says():
    """Each diameter is that of its cylinder, each candidate measures what the dimension says."""
    part, read = step.read(CTC_01), pmi.read(CTC_01.read_bytes())
    by_place = {place: face for face, place in enumerate(part.places)}
    sizes = [each for each in read.characteristics if each.kind == "diameter" and each.value is not None]
    for each in sizes:
        surfaces = [part.surfaces[by_place[read.order[number]]] for number in each.faces]
        assert [2 * surface.radius for surface in surfaces] == pytest.approx([each.value] * 2)
    asked = [m for each in drawn(part, read, "mm") for some in each.candidates for m in some]
    scene = scenes.Scene.model_validate({
        "name": "ctc", "units": "mm", "object": {"kind": "step", "file": str(CTC_01)},
        "material": {"diffuse_reflectance": 0.7}, "light": {"distance": 3000.0},
        "camera": {"width": 640, "height": 480, "focal_px": 2000.0, "distance": 3000.0, "look_at": [-400, 200, 0],
                   "blur_px": 0.8, "exposure": 180.0},
        "noise": {"dark_level": 16.0, "sigma": 1.5, "bits": 8},
        "measurands": [each.model_dump(exclude_none=True) for each in asked],
    })  # fmt: skip
    radii = {circle.name: circle.radius for circle in scene.solid.circles}
    values = {each.number: each.value for each in read.characteristics}
    assert len(asked) >= 14
    assert {measurand.kind for measurand in asked} == {"angle", "diameter", "width"}
    places = [measurand for measurand in asked if measurand.kind == "width"]
    assert [measurand.name.split()[:2] for measurand in places] == [["position", "#21"], ["position", "#22"]]
    assert [measurand.tolerance.plus for measurand in places] == [0.375, 0.375]  # half of the zones' width
    known = measurands(Pictures.of(scene, np.array([20.0, 30.0])))
    told = dict(zip((quantity.name for quantity in known.quantities), known.value_object, strict=True))
    assert [told[measurand.name] for measurand in places] == pytest.approx([175.0, 175.0])  # both from bore B
    for measurand in asked:
        value = values[int(measurand.name.split("#")[1].split()[0])]
        if measurand.kind == "diameter":
            assert 2 * radii[measurand.features[0].circle] == pytest.approx(value)


@kernel
def test_a_new_scene_asks_for_what_the_file_does(tmp_path):
    """All dimensions that are seen, with the file's limits in the scene's unit; each characteristic has its line."""
    new, scale = written(CTC_01, tmp_path / "ctc.toml", "inch"), 1 / 25.4
    rows = {row["number"]: row for row in new.characteristics}
    assert len(rows) == 18
    assert all(row["measurands"] or row["reason"] for row in rows.values())
    measured = {measurand.name: measurand for measurand in scenes.load(tmp_path / "ctc.toml").measurands}
    named = [name for row in rows.values() for name in row["measurands"]]
    assert sorted(named) == sorted(measured)
    assert len(named) >= 5
    for row in rows.values():
        for name in row["measurands"] if row["zone"] is None else ():
            limits = measured[name].tolerance
            one = 1.0 if row["unit"] == "deg" else scale
            half = None if row["zone"] is None else row["zone"] / 2  # of the middle of two planes, to either side
            wanted = (abs(row["plus"]), abs(row["minus"])) if half is None else (half, half)
            assert (limits.plus, limits.minus) == pytest.approx((wanted[0] * one, wanted[1] * one), rel=1e-5)
    text = (tmp_path / "ctc.toml").read_text()
    unseen = [row for row in rows.values() if row["reason"] and "not seen" in row["reason"]]
    assert text.count("# [[measurands]]") == len(unseen) > 0
