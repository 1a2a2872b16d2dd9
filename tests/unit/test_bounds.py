"""The bound of quantities some of which cannot be measured."""

import numpy as np
import pytest

import planner
import scenes


def test_what_cannot_be_measured_takes_no_bound_from_the_others():
    """Seen from above the front is too short: the top has the bound that it has alone."""
    scene, sensor, light = scenes.load("two_lights"), (0.05, 277), ((40, 190), (30, 100))
    told = planner.predict(scene, sensor, light, "bound").measurands
    alone = scene.model_copy(update={"measurands": scene.measurands[:1]})
    (top,) = planner.predict(alone, sensor, light, "bound").measurands
    assert [np.isfinite(each.variance_object) for each in told] == [True, False]
    assert told[0].variance_object == pytest.approx(top.variance_object, rel=0.1)  # margin: edges that lie beside


def test_a_hidden_edge_takes_no_bound_from_what_is_seen():
    """The front faces away: the top, whose edges are seen, is told as well as it is alone."""
    scene, sensor, light = scenes.load("two_lights"), (40, 7), ((40, 190), (30, 100))
    told = planner.predict(scene, sensor, light, "bound").measurands
    alone = scene.model_copy(update={"measurands": scene.measurands[:1]})
    (top,) = planner.predict(alone, sensor, light, "bound").measurands
    assert [each.status for each in told] == ["ok", "not_visible"]
    assert np.isinf(told[1].variance_object)
    assert told[0].variance_object == pytest.approx(top.variance_object, rel=0.1)  # margin: edges that lie beside
