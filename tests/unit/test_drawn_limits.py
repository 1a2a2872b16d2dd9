"""Limits of a STEP file's dimensions as a scene has them: on one side, of the other angle, with the file's value."""

from types import SimpleNamespace

import numpy as np
import pytest

from scenes import load
from scenes.measurands import drawn
from scenes.measurands.drawn_faces import angle_of, measurand
from scenes.measurands.features import Centre
from scenes.parts.pmi import Characteristic
from validation import new_scene

RIM = (Centre(circle="c1"),)


@pytest.mark.parametrize(
    ("plus", "minus", "nominal", "zone"),
    [
        (0.05, 0.1, 20.0, (0.05, 0.1)),  # as it stands
        (0.0, 0.2, 20.0, (0.0, 0.2)),
        (-0.007, 0.02, 19.9865, (0.0065, 0.0065)),  # both limits below: a shaft g6
        (0.053, -0.02, 20.0365, (0.0165, 0.0165)),  # both above: a hole F8
    ],
)
def test_limits_stay_where_they_are(plus, minus, nominal, zone):
    found = measurand(Characteristic(7, "diameter", 20.0, plus, minus), "mm", "diameter", RIM, "c1")
    assert found.nominal == pytest.approx(nominal)
    assert (found.tolerance.plus, found.tolerance.minus) == pytest.approx(zone)
    assert found.nominal + found.tolerance.plus == pytest.approx(20.0 + plus)
    assert found.nominal - found.tolerance.minus == pytest.approx(20.0 - minus)


def test_lengths_are_of_the_scenes_unit():
    found = measurand(Characteristic(7, "diameter", 20.0, 0.05, 0.1), "cm", "diameter", RIM, "c1")
    assert (found.nominal, found.tolerance.plus, found.tolerance.minus) == pytest.approx((2.0, 0.005, 0.01))


def test_a_drawn_angle_is_measured_as_that_or_as_the_other_one():
    """Two sides of a triangle meet at 60 degrees; drawn as the 120 beside it, its limits are the other way round."""
    ends = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.5, np.sqrt(0.75), 0], [2.0, 0, 0]])
    edges = [SimpleNamespace(name=f"e{k}", ends=pair) for k, pair in enumerate([(0, 1), (2, 0), (1, 3)])]
    solid = SimpleNamespace(vertices=ends, edge=lambda name: edges[int(name[1:])])
    assert angle_of(solid, *edges[:2]) == pytest.approx(60)
    assert angle_of(solid, *edges[1:]) == pytest.approx(120)  # apart: as lines run
    known = SimpleNamespace(solid=solid, across=lambda *_: [(-1.0, *edges[:2])])
    for value, nominal, zone in ((60.0, 60.0, (1.0, 0.25)), (120.0, 60.0, (0.25, 1.0))):
        (found,) = drawn._angles(known, Characteristic(7, "angle", value, 1.0, 0.25, unit="deg"), [(None, None)])
        assert (found.nominal, found.tolerance.plus, found.tolerance.minus) == (nominal, *zone)


def test_a_scene_says_the_value_and_the_limits(tmp_path):
    found = measurand(Characteristic(7, "diameter", 20.0, 0.05, 0.1), "mm", "diameter", RIM, "c1")
    text = new_scene._measurand(found)
    assert "nominal = 20.0\ntolerance = { plus = 0.05, minus = 0.1 }\n" in text
    assert "nominal" not in new_scene._measurand(found.model_copy(update={"nominal": None}))
    assert load("plate").measurands[0].nominal is None


@pytest.mark.parametrize(("note", "said"), [("theoretical", "exact"), ("auxiliary", "information"), ("", "--general")])
def test_a_dimension_without_limits_says_why(note, said):
    known = SimpleNamespace(told=lambda number: f"#{number}")
    told = drawn._drawn(known, Characteristic(7, "diameter", 20.0, note=note, faces=(5,)), {}, "mm")
    assert said in told.reason
    assert told.candidates == ()
