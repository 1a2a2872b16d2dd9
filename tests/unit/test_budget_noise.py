"""Pixel noise of a budget before a picture: that of the estimator that is taken, where lines share faces."""

import numpy as np
import pytest

import measure
import planner
from scenes import Picture
from tests import placements as parts


@pytest.mark.parametrize("sensor", [(25, 290), (40, 120)])
def test_it_is_what_the_estimator_tells_of_a_picture(tmp_path, sensor):
    scene = parts.scene(tmp_path, "roof").with_(placement={"from": "known", "datums": [], "datum_sd": None})
    picture = Picture.of(scene, sensor, (30, 40))
    told = np.array([each.of("pixel noise").u for each in planner.budget(picture).measurands])
    found = measure.propagate(planner.image(picture), picture, estimator="arrangement").measurands
    np.testing.assert_allclose(told**2, np.diag(found.covariance), rtol=0.01)  # 0.003 found
    by_bound = [each.variance_object for each in planner.predict(picture, model="bound").measurands]
    assert (np.array(by_bound) < 0.93 * told**2).any()  # which looks farther than the estimator does
