"""The model of a circle is what fitting it to points with the predicted errors gives."""

import numpy as np
import pytest
from scipy.optimize import least_squares

import planner
import scenes
from imaging.features.circles import fisher_circle, rim
from imaging.geometry.projection import project
from imaging.models.paper import PAPER_KAPPA2, paper
from imaging.pictures import Pictures

SENSOR = np.array([40.0, 30.0])
COUNT = 1500
TOLERANCE = 4 * np.sqrt(2 / (COUNT - 1))  # four standard errors of a variance


def check(empirical, predicted):
    """Each variance within four standard errors; 1.3 times the prediction and 0 are not."""
    for ours, theirs in zip(empirical, predicted, strict=True):
        assert ours / theirs == pytest.approx(1, abs=TOLERANCE)  # margin: 4 standard errors
        assert ours / (1.3 * theirs) != pytest.approx(1, abs=TOLERANCE)  # margin: 30 % are 6 standard errors
        assert ours > TOLERANCE * theirs


def test_design_against_central_differences():
    """How far each place of the rim moves along its normal when the circle moves in its plane or grows."""
    plate = scenes.load("plate")
    circle, pictures = plate.solid.circle("c2"), Pictures.of(plate, SENSOR, (20, 100))
    one, two = circle.axes
    found = rim(pictures, circle).design
    angle = 2 * np.pi * (np.arange(len(found)) + 0.5) / len(found)
    radial = np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two

    def image(x, y, wider):
        return project(circle.centre + x * one + y * two + (2 + wider) * radial, SENSOR, plate.camera)

    along = np.roll(image(0, 0, 0), -1, 0) - np.roll(image(0, 0, 0), 1, 0)
    normal = np.stack([along[:, 1], -along[:, 0]], -1) / np.linalg.norm(along, axis=1)[:, None]
    normal *= np.sign((normal * (image(0, 0, 0) - image(0, 0, -2))).sum(1))[:, None]  # outwards
    for k, step in enumerate(1e-4 * np.eye(3)):
        moved = ((image(*step) - image(*-step)) / 2e-4 * normal).sum(1)
        assert found[:, k] == pytest.approx(moved, rel=3e-3, abs=3e-3)


def test_circle_of_a_hole_by_fitting(rng):
    """The paper model of the plate's hole is that of a circle fitted to points with the paper's errors."""
    plate = scenes.load("plate")
    pictures = Pictures.of(plate, SENSOR, (25, 100))
    circle = plate.solid.circle("c2")
    seen = rim(pictures, circle, fall_off=False)
    weight = seen.squared / (PAPER_KAPPA2 * plate.noise.sigma**2)
    used = weight > 1.0  # a point worse than a pixel is nearly no point, and its distance is not linear
    predicted = fisher_circle(seen, np.where(used, weight, 0.0), used)
    one, two = circle.axes
    angle = 2 * np.pi * (np.arange(64) + 0.5) / 64
    radial = (np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two)[used]
    outward = seen.design[used, 2]  # px along the normal for a unit of the radius
    fits = []
    for _ in range(COUNT):
        away = rng.standard_normal(used.sum()) / np.sqrt(weight[used]) / outward
        points = circle.centre + (circle.radius + away)[:, None] * radial
        x, y = ((points - circle.centre) @ axis for axis in (one, two))

        def residual(q, x=x, y=y):
            return (np.hypot(x - q[0], y - q[1]) - circle.radius - q[2]) * outward * np.sqrt(weight[used])

        fits.append(least_squares(residual, np.zeros(3), method="lm").x)
    check(np.var(fits, axis=0, ddof=1), np.diag(predicted))
    evaluated = paper(pictures)
    assert planner.predict(plate, SENSOR, (25, 100), "paper").variance_px2 == pytest.approx(float(evaluated.variance))
