"""The model of a circle's centre is what fitting an ellipse to points with the predicted errors gives."""

import numpy as np
import pytest

import measure
import planner
import scenes
from planner.features.circles import fisher_centre, rim
from planner.imaging.pictures import Pictures
from planner.models.paper import PAPER_KAPPA2, paper

COUNT = 1500
TOLERANCE = 4 * np.sqrt(2 / (COUNT - 1))  # four standard errors of a variance


def check(empirical, predicted):
    """Each variance within four standard errors; 1.3 times the prediction and 0 are not."""
    for ours, theirs in zip(empirical, predicted, strict=True):
        assert ours / theirs == pytest.approx(1, abs=TOLERANCE)
        assert ours / (1.3 * theirs) != pytest.approx(1, abs=TOLERANCE)
        assert ours > TOLERANCE * theirs


def test_rim_is_measured_from_the_ellipses_own_centre():
    plate = scenes.load("plate")
    seen = rim(Pictures.of(plate, (50, 30), (20, 100)), plate.solid.circle("c2"))
    normal = seen.design[:, :2]
    points = seen.design[:, 2:4] / normal
    assert np.linalg.norm(normal, axis=1) == pytest.approx(np.ones(len(normal)))
    assert seen.design[:, 4] == pytest.approx((normal * points[:, ::-1]).sum(1), rel=1e-6, abs=1e-6)
    assert measure.fit_ellipse(points).centre == pytest.approx([0, 0], abs=1e-6)


def test_centre_of_a_hole_by_fitting(rng):
    """The paper model of the plate's hole is that of an ellipse fitted to points with the paper's errors."""
    plate = scenes.load("plate")
    pictures = Pictures.of(plate, (40, 30), (25, 100))
    seen = rim(pictures, plate.solid.circle("c2"), fall_off=False)
    used = seen.counted
    weight = seen.squared[used] / (PAPER_KAPPA2 * plate.noise.sigma**2)
    x, y = (seen.design[used, i] / seen.design[used, i - 2] for i in (2, 3))
    points, sigma = np.stack([x, y], -1), 1 / np.sqrt(weight)
    keep = sigma < 1.0  # a point worse than a pixel is nearly no point, and its distance is not linear
    predicted = fisher_centre(seen, seen.squared / (PAPER_KAPPA2 * plate.noise.sigma**2) * 1.0, used)
    evaluated = paper(pictures)
    assert evaluated.centres[0] == pytest.approx(predicted)
    centres = [
        measure.fit_ellipse(
            points[keep] + sigma[keep, None] * rng.standard_normal((keep.sum(), 2)), sigma[keep] ** 2
        ).centre
        for _ in range(COUNT)
    ]
    check(np.var(centres, axis=0, ddof=1), np.diag(predicted))
    assert planner.predict(plate, (40, 30), (25, 100), "paper").variance_px2 == pytest.approx(evaluated.variance)
