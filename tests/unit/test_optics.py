"""Lens blur and binning against closed forms."""

import numpy as np
import pytest
from scipy.special import ndtr

from imaging.geometry.lens import recorded, undistorted
from render.optics import blur_and_bin, distort
from scenes import Camera, Lens


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
    # margin: the midpoint rule's error, 6.5e-4, in closed form
    assert row[10:30] == pytest.approx(expected[10:30], abs=7e-4)


def test_no_blur_only_averages():
    assert blur_and_bin(np.arange(16.0).reshape(4, 4), camera(0.0), 2, (0, 0)) == pytest.approx(
        np.array([[2.5, 4.5], [10.5, 12.5]])
    )


def test_a_bent_step():
    """Each row's levels add up to where the lens records the edge there.

    Fine pixels are blurred before they are bent, so that nothing rings beside the step.
    """
    seen = Camera(
        width=60, height=50, focal_px=60.0, distance=100.0, blur_px=0.8, lens=Lens(distortion=(-0.1, 0.0, 0.01, -0.02))
    )
    k = 4
    fine = np.zeros((50 * k, 60 * k))
    fine[:, 41 * k :] = 1.0  # ideal x from 40.5 on
    image = blur_and_bin(fine, seen, k, (0, 0))
    assert -2e-4 < image.min() <= image.max() < 1 + 2e-4  # margin: a step is 0 and 1; 2e-4 more or less is no ringing
    rows = np.arange(4, 46)
    for row in rows:
        y = np.linspace(row - 4, row + 4, 9)
        edge = recorded(np.column_stack([np.full(9, 40.5), y]), seen)
        place = np.interp(row, edge[:, 1], edge[:, 0])
        assert (1 - image[row, 30:52]).sum() + 29.5 == pytest.approx(place, abs=3e-3)


def test_a_crop_is_bent_as_the_whole():
    """Only the start says where in the frame it is; what the lens does not show is dark."""
    seen = Camera(width=60, height=50, focal_px=60.0, distance=100.0, blur_px=0.8, lens=Lens(distortion=(-0.1,)))
    y, x = np.mgrid[:100, :120] / 2
    fine = np.sin(0.3 * x) * np.cos(0.2 * y)
    whole, part = distort(fine, seen, (0, 0), 2), distort(fine[20:80, 30:90], seen, (30, 20), 2)
    assert part[10:50, 10:50] == pytest.approx(whole[30:70, 40:80], abs=1e-4)
    centre = undistorted(np.array([[20.25, 15.25]]), seen)[0]
    assert whole[31, 41] == pytest.approx(np.sin(0.3 * (centre[0] + 0.25)) * np.cos(0.2 * (centre[1] + 0.25)), abs=1e-3)


def test_a_sharp_image_is_bent_by_straight_lines_between_fine_pixels():
    """Without blur nothing may ring: a bilinear mean of four, written out, of random levels."""
    seen = Camera(width=30, height=20, focal_px=40.0, distance=100.0, blur_px=0.0, lens=Lens(distortion=(-0.08, 0.02)))
    fine = np.random.default_rng(3).uniform(10, 90, (40, 60))
    found = distort(fine, seen, (0, 0), 2)
    for row, column in ((7, 11), (22, 47), (31, 14)):
        at = (undistorted(np.array([[column, row]]) / 2 - 0.25, seen)[0] + 0.25) * 2
        (x, y), (u, v) = np.floor(at).astype(int), at % 1
        around = fine[y : y + 2, x : x + 2]
        assert found[row, column] == pytest.approx(np.array([1 - v, v]) @ around @ np.array([1 - u, u]), rel=1e-9)
        # margin: an inequality that says where the point lies
        assert 0.005 < min(u, v) < max(u, v) < 0.995  # between fine pixels


def _slope(radius: np.ndarray, variance: float) -> float:
    """Slope in the middle of an edge of height 1 that discs (n,) and a Gaussian of a variance have blurred, by angles
    of the disc's chords."""
    angle = (np.arange(2000) + 0.5) / 2000 * np.pi
    at = radius[:, None] * np.cos(angle)
    smooth = np.exp(-(at**2) / (2 * variance)) / np.sqrt(2 * np.pi * variance)
    return float((2 * np.sin(angle) ** 2 * smooth).mean())


@pytest.mark.parametrize(("ends", "within"), [(1.0, 0.014), (2.0, 0.06)])
def test_a_band_of_foci_blurs_as_its_second_moment_says(ends: float, within: float) -> None:
    """Discs of a focus that is spread evenly to +-``ends`` px, about depths of up to 1 px, against one Gaussian.

    The variance of an edge point goes as 1 / slope^2; the spread ignored is told too small by more.
    """
    base = 1.0 + 0.6**2 + 1 / 12  # locator, lens and pixel
    spread = np.linspace(-ends, ends, 201)[1::2]
    for depth in (0.0, 0.5, 1.0):
        true = _slope(np.abs(depth + spread), base)
        told, ignored = (_slope(np.zeros(1), base + more / 4) for more in (depth**2 + ends**2 / 3, depth**2))
        assert (true / told) ** 2 == pytest.approx(1, abs=within)
        assert (true / ignored) ** 2 < 1 - 2 * within
