"""Middles of slots and centres of patterns of bores as what a drawing asks for: in a scene file, and of a STEP file."""

from importlib.util import find_spec

import numpy as np
import pytest

from imaging.features.kinds import in_image, on_plane
from imaging.features.measurand import measurands
from imaging.pictures import Pictures
from scenes import InvalidInput
from scenes.measurands.drawn import drawn
from scenes.measurands.features import point_of
from scenes.parts import step
from scenes.parts.pmi import Characteristic, Pmi
from tests import step_parts, toleranced
from tests.unit.test_drawn_tolerances import asked, numbers, told
from tests.unit.test_kinds import assert_gradients

SLOT, PATTERN = {"midpoint": [{"circle": "c8"}, {"circle": "c10"}]}, {"pitch_circle": ["c2", "c6", "c4"]}
B, C, D, FRONT, LEFT = {"circle": "c2"}, {"circle": "c6"}, {"circle": "c4"}, {"edge": "e5"}, {"edge": "e4"}
MIDDLE = np.array([30.0, 18.0])  # of the slot
CENTRE = toleranced.CENTRE
ASKED = {
    "slot from edges": ("position", [SLOT, FRONT, LEFT], (18.0, 30.0)),
    "pattern from edges": ("position", [PATTERN, FRONT, LEFT], CENTRE[::-1]),
    "slot in edges": ("true_position", [SLOT, FRONT, LEFT], MIDDLE),
    "pattern in edges": ("true_position", [PATTERN, FRONT, LEFT], CENTRE),
    "slot in bores": ("true_position", [SLOT, B, C], MIDDLE - 8),
    "bore from the slot": ("true_position", [D, SLOT, FRONT], (0.0, 14.0)),
    "slot to pattern": ("distance", [SLOT, PATTERN], (18.0 - CENTRE[1],)),
    "slot and pattern": ("concentricity", [SLOT, PATTERN], (0.0, 18.0 - CENTRE[1])),
    "slot from the front": ("offset", [SLOT, FRONT], (18.0,)),
}


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    scene = toleranced.scene(tmp_path_factory.mktemp("plate"))
    rows = [{"name": name, "kind": kind, "features": features} for name, (kind, features, _) in ASKED.items()]
    return scene.with_(measurands=rows)


def test_values_are_the_plates(plate):
    """By the plate's own dimensions; along the datum circle's own two axes of a place that has no others."""
    known = measurands(Pictures.of(plate, np.array([35.0, 70.0])))
    expected = np.concatenate([np.atleast_1d(values) for *_, values in ASKED.values()])
    found = dict(zip([quantity.name for quantity in known.quantities], known.value_object, strict=True))
    axes = np.array(plate.solid.circle("c2").axes)[:, :2]
    away = [found.pop(f"slot and pattern.{axis}") for axis in "xy"]
    assert np.array(away) @ axes == pytest.approx(ASKED["slot and pattern"][2], abs=1e-6)
    expected = [value for name, (*_, values) in ASKED.items() if name != "slot and pattern" for value in values]
    assert list(found.values()) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("find", [in_image, on_plane])
def test_gradients_against_central_differences(plate, find):
    assert_gradients(plate, (35.0, 70.0), find)


def test_what_has_no_axis_is_not_concentric(plate):
    corner = {"vertex": "v8", "edges": ["e8", "e15"]}
    for feature in (FRONT, corner, {"midpoint": [corner, B]}, {"through": [B, C]}):
        with pytest.raises(InvalidInput, match="features must be a circle or what lies between circles"):
            plate.with_(measurands=[{"name": "it", "kind": "concentricity", "features": [feature, B]}])


ROW = ((8.0, 32.0, 2.0), (52.0, 32.0, 2.0), (30.0, 8.0, 2.0))
TOP, FRONT_FACE, LEFT_FACE = ((0, 0, 1), 6.0), ((0, -1, 0), 0.0), ((-1, 0, 0), 0.0)


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    """60 x 40 x 6 mm with a slot of 6 mm from (20, 20) to (40, 20), three bores of a pattern and one at its centre's
    side."""
    tools = [("bore", (x, 20.0, -1.0), (3.0, 8.0)) for x in (20.0, 40.0)]
    tools += [("box", (20.0, 17.0, -1.0), (20.0, 6.0, 8.0))]
    tools += [("bore", (x, y, -1.0), (r, 8.0)) for x, y, r in (*ROW, (50.0, 12.0, 3.5))]
    shape = step_parts.cut((60.0, 40.0, 6.0), tools)
    return step.read(step_parts.written(shape, tmp_path_factory.mktemp("block") / "block.step"))


needs_kernel = pytest.mark.skipif(find_spec("OCP") is None, reason="needs OpenCASCADE: pip install 'ice-vision[step]'")


def at(part, measurand):
    """Where a measurand's first feature is on the part."""
    return point_of(part.solid, measurand.features[0])[:2]


@needs_kernel
def test_the_position_of_a_slot(block):
    """Its ends' faces, with those of its sides: the middle about its true place, of one datum at its distance."""
    sides = [((0, 1, 0), 17.0), ((0, -1, 0), -23.0)]
    for of in ([3.0], [3.0, *sides]):
        found = asked(block, "position", of, (TOP, FRONT_FACE, LEFT_FACE), is_round=True)
        assert told(found) == ("true_position", 0.2)
        assert len(found.candidates) == 1
        assert at(block, found.candidates[0][0]) == pytest.approx([30.0, 20.0])
    assert told(asked(block, "position", [3.0], (TOP, FRONT_FACE), is_round=True)) == ("offset", 0.1)
    across = asked(block, "position", [3.0, *sides], (TOP, FRONT_FACE))  # its zone is between two planes
    assert told(across) == ("width", 0.1)


@needs_kernel
def test_a_pattern_of_bores_as_a_datum_is_its_centre(block):
    """Not that of one of them."""
    found = asked(block, "position", [3.5], (TOP, 2.0, FRONT_FACE), is_round=True)
    assert told(found) == ("true_position", 0.2)
    assert len(found.candidates[0][0].features[1].pitch_circle) == 3
    assert told(asked(block, "coaxiality", [3.0], (2.0,), is_round=True)) == ("concentricity", 0.2)


def distance(part, value, one, other):
    each = Characteristic(1, "linear distance", value=value, plus=0.1, minus=0.1, faces=one, others=other)
    (found,) = drawn(part, Pmi((each,), {}, {place: place for place in part.places}), "mm")
    return found


@needs_kernel
def test_distances_of_bores_slots_and_patterns(block):
    """Between centres, or from a side; what the part has not is no measurand."""
    centre = np.array([30.0, (32.0**2 - 8.0**2 + 22.0**2) / (2 * 24.0)])  # of the pattern: as far from each bore
    bore, slot, pattern = (numbers(block, radius) for radius in (3.5, 3.0, 2.0))
    away = {
        "bore and slot": (np.hypot(20.0, 8.0), bore, slot, "distance"),
        "pattern and bore": (np.linalg.norm(centre - [50.0, 12.0]), pattern, bore, "distance"),
        "slot and front": (20.0, slot, numbers(block, FRONT_FACE), "offset"),
        "left and bore": (50.0, numbers(block, LEFT_FACE), bore, "offset"),
    }
    for value, one, other, kind in away.values():
        assert told(distance(block, value, one, other)) == (kind, 0.1)
        lost = distance(block, 1.01 * value, one, other)
        assert lost.candidates == ()
        assert "no two straight edges or centres" in lost.reason
