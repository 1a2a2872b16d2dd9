"""Geometric tolerances and features between others: values by plain geometry, gradients by central differences."""

from dataclasses import replace

import numpy as np
import pytest

from imaging.features.kinds import in_image, on_plane
from imaging.features.measurand import dense, measurands
from imaging.pictures import Pictures
from scenes import InvalidInput
from tests import toleranced
from tests.unit.test_kinds import assert_gradients

SENSOR = np.array([35.0, 70.0])


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    return toleranced.scene(tmp_path_factory.mktemp("plate"))


def test_values_in_the_object(plate):
    """Of every number, by the plate's own dimensions."""
    known = measurands(Pictures.of(plate, SENSOR))
    assert [quantity.name for quantity in known.quantities] == list(toleranced.VALUES)
    assert known.value_object == pytest.approx(np.array(list(toleranced.VALUES.values())), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("sensor", [(35.0, 70.0), (60.0, 215.0), (0.0, 0.0)])
@pytest.mark.parametrize("find", [in_image, on_plane])
def test_gradients_against_central_differences(plate, sensor, find):
    """Of every number by every parameter of what is found."""
    assert_gradients(plate, sensor, find)


def test_what_is_found_where_expected_is_the_object(plate):
    known = measurands(Pictures.of(plate, SENSOR))
    found = replace(known.seen, expected=False)
    again = [on_plane(found, quantity) for quantity in plate.quantities]
    assert [each.value for each in again] == pytest.approx(known.value_object, rel=1e-9, abs=1e-9)
    assert dense(again, (), found.count) == pytest.approx(known.gradient_object, rel=1e-9, abs=1e-11)


def test_signs_are_the_objects_from_either_side(plate):
    """A number that may be negative is the same from above and from below, in the plane of what it is of."""
    poses = np.array([[20.0, 10.0], [60.0, 200.0], [150.0, 30.0]])
    known = measurands(Pictures.of(plate, poses))
    values = np.stack([np.broadcast_to(on_plane(known.seen, q).value, 3) for q in plate.quantities], -1)
    assert values == pytest.approx(np.broadcast_to(known.value_object, values.shape), abs=1e-6)


def test_many_pictures_are_each_as_alone(plate):
    poses = np.array([[[20.0, 10.0], [60.0, 200.0]]])
    many = measurands(Pictures.of(plate, poses))
    for i in range(2):
        one = measurands(Pictures.of(plate, poses[0, i]))
        assert many.value[0, i] == pytest.approx(one.value, rel=1e-12, abs=1e-9)
        assert many.gradient_object[0, i] == pytest.approx(one.gradient_object, rel=1e-9, abs=1e-11)


B, C, D, FRONT, LEFT = {"circle": "c2"}, {"circle": "c6"}, {"circle": "c4"}, {"edge": "e5"}, {"edge": "e4"}


@pytest.mark.parametrize(
    ("kind", "features", "more", "line"),
    [
        ("radius", [FRONT], {}, "features must be a circle or a curved surface for kind radius, got e5"),
        ("parallelism", [FRONT, LEFT], {}, "must be edges within 1 degree of parallel, got e5, e4"),
        ("perpendicularity", [FRONT, {"edge": "e8"}], {}, "must be edges within 1 degree of square, got e5, e8"),
        ("parallelism", [FRONT, {"edge": "e8"}], {"nominal": 0.1}, "nominal must be left out for kind parallelism"),
        ("true_position", [D, B, C], {"nominal": 3.0}, "nominal must be two numbers for kind true_position, got 3.0"),
        ("slot", [{"circle": "c8"}, B], {"nominal": 3.0}, "nominal must be two numbers for kind slot, got 3.0"),
        ("true_position", [D, B, C], {"tolerance": {"plus": 0.1, "minus": 0.2}}, "one number, the zone's size"),
        ("true_position", [D, B, {"edge": "e2"}], {}, "must be features in one plane, got c4, c2, e2"),
        ("slot", [B, D], {}, "must be round ends of one radius, got 3 and 4"),
        ("pitch_circle", [B, C], {}, "features must be at least three circles for kind pitch_circle, got c2, c6"),
        ("symmetry", [{"centre_line": ["e5", "e4"]}, FRONT], {}, "centre_line must be edges within 1 degree"),
        ("distance", [B, {"crossing": ["e5", "e8"]}], {}, "crossing must be edges at least 5 degrees from parallel"),
        ("distance", [B, {"crossing": ["e5", "e16"]}], {}, "crossing must be features in one plane, got e5, e16"),
        ("distance", [B, {"crossing": ["e5", "e99"]}], {}, r"crossing\[1\].edge must be one of e1, e2"),
        ("distance", [B, {"midpoint": [B, {"circle": "c99"}]}], {}, r"midpoint\[1\].circle must be one of c1"),
        ("offset", [{"centre_line": ["e5", "e8"]}, FRONT], {}, "features must be a corner or a circle, then"),
        ("offset", [B, {"midpoint": [B, D]}], {}, "must be a corner or a circle, then an edge for kind offset"),
    ],
)  # fmt: skip
def test_what_is_refused(plate, kind, features, more, line):
    with pytest.raises(InvalidInput, match=line):
        plate.with_(measurands=[{"name": "it", "kind": kind, "features": features, **more}])


def test_zones_halve_what_is_about_a_place(plate):
    """Of a circle about a true place a component has half of the diameter; of a width to one side all of it."""
    half = {quantity.name: quantity.tolerance and quantity.tolerance.half for quantity in plate.quantities}
    assert (half["in edges.x"], half["in edges.y"], half["slot to plate"], half["back"]) == (0.1, 0.1, 0.1, 0.1)
    zones = {zone.name: zone for zone in plate.zones}
    assert zones["in edges"].parts == ("in edges.x", "in edges.y")
    assert [zones[name].is_joint for name in ("in edges", "back", "slot to plate")] == [True, False, False]
    assert (zones["in edges"].size, zones["slot to plate"].factor, zones["back"].factor) == (0.2, 2.0, 1.0)
    assert zones["centres"].size is None
    nominal = {quantity.name: quantity.nominal for quantity in plate.quantities}
    assert (nominal["back"], nominal["slot to plate"], nominal["in edges.x"]) == (0.0, 0.0, None)


def test_a_line_of_the_datum_system_is_all_that_y_needs(plate):
    """So that what hides the secondary datum loses x alone; two edges' crossing is told where it is flat."""
    needed = {quantity.name: quantity.edges for quantity in plate.quantities}
    assert (needed["in edges.x"], needed["in edges.y"]) == (("c4", "e5", "e4"), ("c4", "e5"))
    assert (needed["in bores.x"], needed["in bores.y"]) == (("c4", "c2", "c6"),) * 2
    crossings = {quantity.name: quantity.crossings for quantity in plate.quantities}
    assert [each.edges for each in crossings["to the crossing"]] == [("e5", "e4")]
    assert [each.edges for each in crossings["to the middle"]] == [("e8", "e15")]
    assert crossings["bolts"] == ()
