"""A photograph's noise against level, before rounding, its correlation, and JPEG's blocks, from images made with known
ones."""

from functools import lru_cache
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from measure.photo import compression
from measure.photo import noise_curve as noise_curve_module
from measure.photo.compression import is_compressed
from measure.photo.correlation import FAR, REACH, correlation
from measure.photo.noise_curve import noise_curve, scale_of
from measure.photo.patches import smooth_patches
from measure.photo.recording import recording
from scenes.photograph import Photograph
from tests.oracle import polygon_image

SHAPE = (260, 330)
CORNERS = np.array([[61.3, 52.2], [241.6, 63.9], [230.4, 190.7], [50.8, 179.1]])


@lru_cache(maxsize=1)
def shaded():
    """Two levels with an edge between them, both gently shaded, so that levels lie anywhere between whole numbers."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return polygon_image(CORNERS, SHAPE, 0.8, 100.0, 40.0) + 0.03 * x + 0.021 * y


@pytest.mark.parametrize("sigma", [0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 1.0, 3.0])
def test_noise_before_rounding(sigma, rng):
    """Within 3 %, or 0.006 of a level (0.03 below a fifth of one), of what there was, which rounding hides; with the
    rounding's part to 5 %."""
    image = np.rint(shaded() + sigma * rng.standard_normal(SHAPE))
    curve = noise_curve(image)
    assert curve.gain == 0
    # margin: the claim, below a fifth of a level 0.03
    assert np.sqrt(curve.dark) == pytest.approx(sigma, rel=0.03, abs=0.006 if sigma >= 0.2 else 0.03)
    # margin: the claim, 5 %
    assert np.sqrt(curve.variance(100.0)) == pytest.approx(np.sqrt(sigma**2 + 1 / 12), rel=0.05)
    if sigma < 0.5:
        # margin: the order is said: what rounding adds
        assert smooth_patches(image, step=1.0).variance.mean() > 1.4 * sigma**2


def test_shot_noise(rng):
    """Variance at both levels to 4 %; a constant noise is told as such."""
    clean = shaded()
    noisy = clean + np.sqrt(1.0 + 0.08 * clean) * rng.standard_normal(SHAPE)
    levels = np.array([45.0, 95.0, 150.0])
    for image in (noisy, np.rint(noisy)):
        rounded = (image is not noisy) / 12
        # margin: the claim, 4 %
        assert noise_curve(image).variance(levels) == pytest.approx(1.0 + 0.08 * levels + rounded, rel=0.04)
    assert noise_curve(clean + rng.standard_normal(SHAPE)).gain == 0


def test_noise_that_falls_is_told(rng):
    """As a gamma curve that was not undone makes it."""
    light = (shaded() + 2 * rng.standard_normal(SHAPE)) / 255
    assert noise_curve(255 * light**0.45).falls
    assert not noise_curve(255 * light).falls


def test_saturated_patches_do_not_count(rng):
    """A face at the end of the scale has no noise; the background's is told."""
    image = np.clip(np.rint(polygon_image(CORNERS, SHAPE, 0.8, 300.0, 60.0) + 2 * rng.standard_normal(SHAPE)), 0, 255)
    assert np.sqrt(noise_curve(image).dark) == pytest.approx(2.0, rel=0.03)


def test_scale():
    """12 bits in steps of 16; real numbers have no steps."""
    assert scale_of(np.array([[0, 160, 16], [48, 65520, 32.0]]))[:2] == (16.0, 16)
    assert scale_of(np.array([[0.0, 4095.0], [1.0, 2.0]]))[:2] == (1.0, 12)
    assert scale_of(np.array([[0.25, 3.0]])).step == 0


def kernel_of(taps):
    """Autocovariance of white noise through a filter, at lags up to REACH."""
    half = taps.shape[0] - 1
    full = cv2.filter2D(np.pad(taps, half), cv2.CV_64F, taps, borderType=cv2.BORDER_CONSTANT)
    middle = full.shape[0] // 2
    return full[middle - REACH : middle + REACH + 1, middle - REACH : middle + REACH + 1]


def test_correlation_of_filtered_noise(rng):
    """Every lag within 5 standard errors (0.02) of the filter's own autocorrelation."""
    taps = np.zeros((7, 7))
    taps[3, 3] = 1
    taps = gaussian_filter(taps, 0.6, mode="constant")
    image = shaded() + cv2.filter2D(4 * rng.standard_normal(SHAPE), cv2.CV_64F, taps)
    seen = recording(Photograph(image), CORNERS)
    expected = kernel_of(taps)
    assert not seen.correlation.white
    # margin: 5 standard errors, and what is estimated beside the edge
    near = np.s_[FAR - REACH : FAR + REACH + 1,] * 2
    assert seen.correlation.kernel[near] == pytest.approx(expected / expected[REACH, REACH], abs=0.03)
    assert seen.correlation.kernel[FAR, FAR + REACH + 1 :] == pytest.approx(0, abs=0.02)
    assert float(seen.curve.variance(100.0)) == pytest.approx(16 * expected[REACH, REACH], rel=0.05)


def test_noise_that_a_camera_smoothed_correlates_far(rng):
    """Blots of 3 px besides: the sum over all lags, which is what long edges feel, is 1.35 times that within 3 px."""
    fine, coarse = (cv2.GaussianBlur(rng.standard_normal((420, 560)), (0, 0), width) for width in (0.8, 3.0))
    noise = np.sqrt(0.95) * fine / fine.std() + np.sqrt(0.05) * coarse / coarse.std()
    spectrum = np.abs(np.fft.fft2(noise)) ** 2
    true = np.roll(np.fft.ifft2(spectrum).real, (FAR, FAR), (0, 1))[: 2 * FAR + 1, : 2 * FAR + 1]
    true /= true[FAR, FAR]
    image = 100 + 4 * noise + 0.05 * np.arange(560)
    found = recording(Photograph(image)).correlation.kernel
    assert found.sum() == pytest.approx(true.sum(), rel=0.2)  # margin: 3 standard deviations of 10 seeds
    near = np.s_[FAR - REACH : FAR + REACH + 1,] * 2
    assert found[near] == pytest.approx(true[near], abs=0.03)
    assert np.abs(np.fft.fft2(np.fft.ifftshift(np.pad(found, 30))).imag).max() < 1e-9
    assert np.fft.fft2(np.fft.ifftshift(np.pad(found, 30))).real.min() > -1e-3  # a variance is never below 0
    assert true.sum() > 1.25 * true[near].sum()  # or nothing was tested


def test_white_noise_is_white(rng):
    """Median p-value of 20 images near a half; an edge of 4 times the noise does not pass for correlation."""
    clean = polygon_image(CORNERS, SHAPE, 0.8, 8.0, 60.0)
    found = [recording(Photograph(clean + 2 * rng.standard_normal(SHAPE)), CORNERS).correlation for _ in range(20)]
    told = np.array([one.p_value for one in found])
    assert 0.15 < np.median(told) < 0.85
    assert all(one.white for one in found)


def test_covariance_of_a_mean_under_correlated_noise(rng):
    """The variance of a mean of n pixels of smoothed noise is the kernel's sum over n, about."""
    image = shaded() + cv2.GaussianBlur(4 * rng.standard_normal(SHAPE), (0, 0), 0.6)
    patches, curve = smooth_patches(image), noise_curve(image)
    found = correlation(patches, curve)
    side = 40
    pixels = (np.arange(side)[:, None] * 100 + np.arange(side)).ravel()
    mean = np.full((1, side**2), 1 / side**2)
    whole = found.covariance(mean, pixels, np.ones(side**2), 100)[0, 0] * side**2
    assert whole == pytest.approx(found.kernel.sum(), rel=0.06)  # margin: about: the kernel's ends are cut off
    assert whole > 2  # margin: the order is said: white noise has 1


@pytest.mark.parametrize("quality", [50, 75, 90, 95])
@pytest.mark.parametrize("sigma", [0.5, 1.5])
def test_jpeg_is_seen(quality, sigma, rng):
    """Wherever its grid lies; the same picture before is none."""
    image = np.clip(np.rint(shaded() + sigma * rng.standard_normal(SHAPE)), 0, 255).astype(np.uint8)
    packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    assert is_compressed(cv2.imdecode(packed, cv2.IMREAD_GRAYSCALE)[3:, 6:])
    assert not is_compressed(image)


def test_the_cosines_of_a_block_are_at_right_angles_and_of_length_one():
    """So that what is next to zero is told in the step of grey levels; none of them has a mean."""
    cosines = compression._cosines().astype(float)
    assert cosines.T @ cosines == pytest.approx(np.eye(63), abs=1e-5)
    assert np.abs(cosines.sum(0)).max() < 1e-5  # margin: single precision of 64 numbers


@pytest.mark.parametrize("step", [0.0, 1.0, 16.0])
def test_groups_of_patches_are_no_surer_than_rounding_allows(step):
    """The standard error is that of a chi-square, of no less variance than rounding alone makes."""
    levels, variances = np.linspace(10, 90, 16), np.geomspace(1e-4, 40.0, 16)
    level, variance = np.repeat(levels, 130), np.repeat(variances, 130)
    patches = SimpleNamespace(level=level, variance=variance, freedom=46.0, pixels=np.zeros((2080, 49)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(noise_curve_module, "before_rounding", lambda pixels, surface, variance, step: variance - 0.5)
        found, before, error = noise_curve_module._groups(patches, step)
    assert found == pytest.approx(levels, rel=1e-9)
    assert before == pytest.approx(variances - (0.5 if step else 0.0), rel=1e-9)
    assert error == pytest.approx(np.maximum(variances, step**2 / 12) * np.sqrt(2 / (46 * 130)), rel=1e-6)
