"""What `ice calibrate` reads from variances, on variances of a known law; and the picture that it measures."""

import numpy as np
import pytest

from imaging.features.locator import information_bound, kappa2
from measure.calibration import RATIOS, _curve, _lines, _points, _square, blur_for
from measure.features.layout import polygon_layout
from tests.oracle import polygon_image


def variances(floor, kappa2, length, ends):
    ratios = np.array(RATIOS)
    grown = np.where(ratios > ends, 1.5, 1.0)
    return np.column_stack([(floor**2 + kappa2 * ratios**2) * grown, np.full(ratios.size, length)])


@pytest.mark.parametrize("floor", [0.0, 0.002])
@pytest.mark.parametrize("last", [len(RATIOS) - 1, len(RATIOS) - 3])
def test_the_law_is_found_again(floor, last, task1):
    kappa2, length, bound = 0.9, 3.5, 1.7
    found = _curve("gradient", variances(floor, kappa2, length, RATIOS[last]), task1, bound)
    assert found.kappa2 == pytest.approx(kappa2, rel=1e-9)
    assert found.floor_px == pytest.approx(floor, abs=1e-7)
    assert found.correlation_px == pytest.approx(length)
    assert found.linear_to == RATIOS[last]
    assert found.efficiency == pytest.approx(bound / (kappa2 * length))
    assert found.sigma_px == pytest.approx(np.sqrt(variances(floor, kappa2, length, RATIOS[last])[:, 0]))


def test_too_few_ratios_tell_nothing(task1):
    found = variances(0.0, 1.0, 3.0, 1.0)
    found[2:] = np.nan
    assert np.isnan(_curve("canny", found, task1, 1.0).kappa2)


@pytest.mark.parametrize("degrees", [3.0, 25.0])
def test_the_square(degrees, task1):
    """Its edges are those of the exact polygon: four points a pixel each way are good to 1e-4 of the contrast."""
    image, layout = _square(degrees, 0.1, task1)
    corners = layout.ends[:, 0]
    assert np.linalg.norm(np.diff(layout.ends, axis=1)[:, 0], axis=1) == pytest.approx(np.full(4, 60.0))
    exact = polygon_image(corners, image.shape, max(task1.camera.blur_px, 0.3), 1.0)
    assert image / image.max() == pytest.approx(exact / exact.max(), abs=5e-4)
    sides = layout.directions
    assert np.degrees(np.arctan2(sides[0, 1], sides[0, 0])) == pytest.approx(degrees)
    assert np.abs(sides[0] @ sides[1]) < 1e-12


@pytest.mark.parametrize("blur", [0.0, 0.6, 1.33])
@pytest.mark.parametrize("scale", [1.0, 1.5])
def test_blur_for_a_kappa(blur, scale):
    """The inverse of (3/8) (1 + (blur^2 + 1/12) / s^2)^3."""
    kappa2 = 3 / 8 * (1 + (blur**2 + 1 / 12) / scale**2) ** 3
    assert blur_for(kappa2, scale) == pytest.approx(blur, abs=1e-7)
    assert blur_for(0.1, scale) == 0


def test_variance_of_points(task1, rng):
    """Of 4 sides x some 25 independent points x 40 images: within 9 % of kappa^2 s_n^2 / C^2."""
    ratio = 0.02
    clean, layout = _square(14.0, ratio, task1)
    noisy = clean + 100.0 * ratio * rng.standard_normal((40, *clean.shape))
    variance, length = _points(noisy, layout, "gradient")
    scale = task1.locator.scale_px
    assert variance == pytest.approx(
        kappa2(scale, task1.camera.blur_px) * ratio**2, rel=0.09
    )  # margin: 4 standard errors
    # margin: chance, of 4 sides; a length of one pixel is 70 % off
    assert length == pytest.approx(2 * np.sqrt(np.pi) * scale, rel=0.3)


def test_variance_of_lines(task1, rng):
    """Of 4 sides x 60 images: told as that of points which, one correlation length apart, make the side's middle.

    One side is expected a tenth of a pixel off, which is no scatter.
    """
    ratio = 0.02
    clean, layout = _square(14.0, ratio, task1)
    noisy = clean + 100.0 * ratio * rng.standard_normal((60, *clean.shape))
    beside = polygon_layout(layout.ends[:, 0] + [[0.1, 0], [0, 0], [0, 0], [0.1, 0]], layout.optics)
    variance, length = _lines(noisy, beside, "strip")
    assert length == pytest.approx(2 * np.sqrt(np.pi) * task1.locator.scale_px)
    least = ratio**2 / float(information_bound(np.array(1.0), 1.0, task1.camera.blur_px))
    # margin: between the bound and what the strip loses, and chance
    assert 0.8 * least < variance * length < 1.6 * least
