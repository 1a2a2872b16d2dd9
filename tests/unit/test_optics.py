"""Lens blur and binning against closed forms."""

import numpy as np
import pytest
from scipy.special import ndtr

from render.optics import blur_and_bin
from scenes import Camera


def camera(blur):
    return Camera(width=40, height=40, focal_px=800.0, distance=100.0, blur_px=blur)


def test_flat_image_stays_flat_inside():
    assert blur_and_bin(np.ones((80, 80)), camera(0.6), 4, (0, 0))[8:12, 8:12] == pytest.approx(1)


def test_step_becomes_the_normal_distribution_averaged_over_pixels():
    """Edge between two fine pixels; 8 x supersampling. The pixel's mean of Phi is a difference of its integrals.

    The mean of 8 values stands for the integral: the midpoint rule is off by (1/8)^2 / 24 of Phi's slope there, 6.5e-4.
    """
    fine = np.zeros((320, 320))
    fine[:, 163:] = 1
    row = blur_and_bin(fine, camera(0.6), 8, (0, 0))[20]
    x = np.arange(40) - (163 / 8 - 0.5)
    ramp = lambda u: u * ndtr(u) + np.exp(-u * u / 2) / np.sqrt(2 * np.pi)  # noqa: E731
    expected = 0.6 * (ramp((x + 0.5) / 0.6) - ramp((x - 0.5) / 0.6))
    assert row[10:30] == pytest.approx(expected[10:30], abs=7e-4)


def test_no_blur_only_averages():
    assert blur_and_bin(np.arange(16.0).reshape(4, 4), camera(0.0), 2, (0, 0)) == pytest.approx(
        np.array([[2.5, 4.5], [10.5, 12.5]])
    )
