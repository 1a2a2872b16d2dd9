"""Geometric tolerances and features between others: values by plain geometry, gradients by central differences."""

from dataclasses import replace

import numpy as np
import pytest

from imaging.features.kinds import in_image, on_plane
from imaging.features.measurand import dense, measurands
from imaging.pictures import Pictures
from tests import toleranced
from tests.unit.test_kinds import moved

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
    known = measurands(Pictures.of(plate, np.array(sensor)))
    seen, ours = known.seen, known.gradient if find is in_image else known.gradient_object
    step = np.tile([1e-3, 1e-5], len(seen.names)).tolist() + [1e-4] * (3 * len(seen.circles))
    for k, h in enumerate(step):
        ahead, behind = (moved(seen, sign * h * np.eye(seen.count)[k]) for sign in (1, -1))
        for m, quantity in enumerate(plate.quantities):
            numeric = (find(ahead, quantity).value - find(behind, quantity).value) / (2 * h)
            assert ours[m, k] == pytest.approx(numeric, rel=1e-6, abs=1e-7 * np.abs(ours[m]).max()), (quantity.name, k)
    assert (np.abs(ours).max(-1) > 0).all()


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
