"""The pictures show what was measured."""

import numpy as np
import pytest

import measure
from planner.imaging.projection import project
from tests.oracle import polygon_image
from validation.report.figures import edge_pixels

SENSOR = (30, 135)
RING = ("v4", "v3", "v7", "v6")


def away_from(points: np.ndarray, start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """Distance of points from the segment, px."""
    along = stop - start
    t = np.clip((points - start) @ along / (along @ along), 0, 1)
    return np.linalg.norm(points - start - t[:, None] * along, axis=1)


@pytest.mark.parametrize("noise", [0.0, 2.4])
def test_edge_pixels_are_those_that_canny_measures_by(task1, noise, rng):
    """As many at each required edge as the measurement counts, all within a pixel of it, away from its corners."""
    corners = project(np.array([task1.solid.vertex(v) for v in RING]), np.array(SENSOR, float), task1.camera)
    picture = polygon_image(corners, (240, 256), task1.camera.blur_px, 150.0)
    picture = picture + noise * rng.standard_normal(picture.shape)
    drawn = np.argwhere(edge_pixels(task1, SENSOR, picture))[:, ::-1]
    found = measure.distance(picture, task1, SENSOR, estimator="canny")
    ring = zip(corners, np.roll(corners, -1, 0), strict=True)
    apart = np.stack([away_from(drawn, *side) for side in ring])
    assert sorted(np.bincount(apart.argmin(0), minlength=4)) == sorted(found.used)
    assert apart.min(0).max() < 1
    assert np.linalg.norm(drawn[:, None] - corners, axis=-1).min() > 2
