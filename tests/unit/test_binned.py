"""Long blurred sides are measured in larger pixels: the same values, hardly less precise."""

import cv2
import numpy as np
import pytest

import measure
from imaging.models import reach
from measure.photo import binned
from measure.photo.binned import back, bin_size, into
from scenes.photograph import Photograph
from tests.oracle import polygon_image

CORNERS = np.array([[40.3, 41.7], [180.1, 54.2], [172.6, 170.4], [52.8, 155.9]])
BLUR, SIGMA = 2.2, 2.0


@pytest.fixture(scope="module")
def pictures():
    clean = polygon_image(CORNERS, (210, 230), BLUR, 140.0, 40.0)
    return clean + np.random.default_rng(7).normal(0, SIGMA, (6, *clean.shape))


def test_same_values_with_the_sigma_of_their_scatter(pictures, monkeypatch):
    whole = [measure.measure_quadrilateral(Photograph(image), corners=CORNERS) for image in pictures]
    monkeypatch.setattr(reach, "_MANY", 4000)
    assert bin_size(pictures[0], CORNERS) == 2
    coarse = [measure.measure_quadrilateral(Photograph(image), corners=CORNERS) for image in pictures]
    assert {each.status for each in coarse} == {"ok"}
    sigma = np.sqrt([np.diag(each.covariance) for each in coarse])
    apart = np.array([a.corners.ravel() - b.corners.ravel() for a, b in zip(coarse, whole, strict=True)])
    assert np.sqrt(((apart / sigma) ** 2).mean()) < 0.95  # less than their scatter; the strips differ, too
    away = np.array([each.corners - CORNERS for each in coarse]).reshape(len(coarse), 8)
    assert 0.59 < np.sqrt(((away / sigma) ** 2).mean()) < 1.41  # margin: 4 standard errors of 48
    finer = np.sqrt([np.diag(each.covariance) for each in whole])
    assert 0.95 < (sigma / finer).mean() < 1.05
    assert coarse[0].blur_px == pytest.approx(BLUR, abs=0.035)
    assert coarse[0].noise == pytest.approx(SIGMA, rel=0.03)


@pytest.mark.parametrize(("blur", "size"), [(0.4, 1), (0.74, 1), (0.76, 1), (1.6, 2), (4.6, 6)])
def test_pixels_are_as_large_as_leaves_three_quarters_of_one_of_blur(blur, size, monkeypatch):
    """One pixel at the least, and where sides are short, however blurred."""
    monkeypatch.setattr(binned, "edge_sigma", lambda image, corners: blur)
    for long, expected in ((True, size), (False, 1)):
        monkeypatch.setattr(binned, "is_long", lambda length, told, long=long: long)
        assert bin_size(np.zeros((9, 9)), CORNERS) == expected


def test_points_go_into_larger_pixels_and_back():
    assert np.allclose(back(into(CORNERS, 3), 3), CORNERS, atol=1e-12)
    small = cv2.resize(np.arange(36.0).reshape(6, 6) % 6, (2, 2), interpolation=cv2.INTER_AREA)
    assert np.allclose(back(np.array([[0.0, 0.0], [1.0, 0.0]]), 3)[:, 0], small[0])
