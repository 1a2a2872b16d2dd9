"""The most likely ellipse in an exact image: parameters, and a covariance that is the information's inverse."""

import numpy as np
import pytest

from measure.estimators import ellipse
from measure.estimators.ellipse import LEAST_BLUR, Sought, _near, likeliest_ellipse
from measure.features.blurred_ellipse import ellipse_image, outline, to_symmetric
from measure.features.optics import Optics
from scenes import Noise
from tests.oracle import polygon_image

SHAPE, BLUR, CONTRAST = (60, 70), 0.8, 60.0
TRUE = np.array([34.3, 29.6, 17.0, 10.0, 0.4])
ROUND = np.array([34.3, 29.6, 13.0, 13.0, 0.0])
ALL = Sought(np.linspace(0, 6, 20), np.ones(20, bool))


def exact(parameters, blur=BLUR):
    """By the oracle: 400 corners lie 5e-4 px farther out than the middles of their chords."""
    ring = outline(to_symmetric(parameters), 2 * np.pi * np.arange(400) / 400)[0]
    return polygon_image(ring, SHAPE, blur, CONTRAST, 20.0)


def drawn(parameters, blur=BLUR):
    """The same by the package's image of an ellipse, which its own tests hold to the oracle."""
    columns, rows = np.arange(SHAPE[1]), np.arange(SHAPE[0])
    return 20.0 + CONTRAST * ellipse_image(to_symmetric(parameters), columns, rows, blur)[0]


@pytest.mark.parametrize("blur", [0.7, 0.9])
@pytest.mark.parametrize("circle", [False, True])
def test_parameters(circle, blur):
    """From half a pixel off to a hundredth of one, the contrast to 1 %, whatever the blur was thought to be."""
    true = ROUND if circle else TRUE
    optics = Optics(SHAPE, BLUR, 4.0, 1.0, 3.0)
    start = to_symmetric(true + ([0.4, -0.3, 0.3, 0.3, 0] if circle else [0.4, -0.3, 0.3, -0.2, 0.02]))
    found = likeliest_ellipse(exact(true, blur), start, optics, circle, ALL)
    assert found.parameters == pytest.approx(true, abs=0.0125)
    assert found.contrast == pytest.approx(CONTRAST, rel=0.01)
    assert found.fits


@pytest.mark.parametrize("noise", [None, Noise(sigma=2.0, gain=0.3)])
@pytest.mark.parametrize("circle", [False, True])
def test_covariance(circle, noise):
    """Least squares of shape, blur, contrast and background: central differences of images."""
    true, image = (ROUND, drawn(ROUND)) if circle else (TRUE, drawn(TRUE))
    optics = Optics(SHAPE, BLUR, 4.0, 1.0, 3.0, noise)
    columns, rows, near = _near(to_symmetric(true), optics, ALL)
    frame = np.ix_(rows, columns)
    ways = [[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 1, 1, 0]] if circle else np.eye(5)
    design = [(drawn(true + 1e-3 * np.array(w)) - drawn(true - 1e-3 * np.array(w)))[frame][near] / 2e-3 for w in ways]
    design += [(drawn(true, BLUR + 1e-3) - drawn(true, BLUR - 1e-3))[frame][near] / 2e-3]
    design += [(image[frame][near] - 20) / CONTRAST, np.ones(near.sum())]
    response = np.linalg.pinv(np.stack(design, 1))[: len(ways)]
    variance = np.full(near.sum(), 4.0) if noise is None else 4.0 + 0.3 * image[frame][near]
    expected = (response * variance) @ response.T
    found = likeliest_ellipse(image, to_symmetric(true), optics, circle, ALL).covariance
    pick = [0, 1, 2, 2] if circle else [0, 1, 2, 3, 4]
    size = len(pick)
    assert found[:size, :size] == pytest.approx(expected[np.ix_(pick, pick)], rel=0.02, abs=0.01 * expected.max())
    assert not found[size:].any()


def test_nothing_is_found():
    optics = Optics(SHAPE, BLUR, 4.0, 1.0, 3.0)
    assert likeliest_ellipse(np.full(SHAPE, 20.0), to_symmetric(TRUE), optics, False, ALL) is None
    far = to_symmetric(TRUE + [6.0, 0, 0, 0, 0])
    assert likeliest_ellipse(exact(TRUE), far, optics, False, ALL) is None
    spoilt = exact(TRUE)
    spoilt[28:32, 50:52] += 40.0
    assert not likeliest_ellipse(spoilt, to_symmetric(TRUE), optics, False, ALL).fits


@pytest.mark.parametrize("turn", [0.0, 2 * np.pi, -2 * np.pi])
def test_only_beside_what_was_seen(turn):
    """The nearest of the places decides, around the circle."""
    seen = Sought(np.array([0.1, 1.5, 3.0, 6.0]), np.array([True, False, True, False]))
    assert seen.near(turn + np.array([0.2, 1.2, 2.9, 5.9, 6.25, 0.9])).tolist() == [
        True,
        False,
        True,
        False,
        True,
        False,
    ]


def test_pixels_near_the_outline():
    """Within a band around it; all of them, and only what the image has."""
    optics = Optics(SHAPE, BLUR, 4.0, 1.0, 3.0)
    for parameters in (ROUND, ROUND - [25.0, 20.0, 0, 0, 0]):
        columns, rows, near = _near(to_symmetric(parameters), optics, ALL)
        assert (columns[0] >= 0) & (rows[0] >= 0) & (columns[-1] < SHAPE[1]) & (rows[-1] < SHAPE[0])
        away = np.abs(np.hypot(columns - parameters[0], rows[:, None] - parameters[1]) - parameters[2])
        band = away[near].max()
        assert near.sum() == (away <= band).sum()
        y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
        assert near.sum() == (np.abs(np.hypot(x - parameters[0], y - parameters[1]) - parameters[2]) <= band).sum()
        assert 5 * np.sqrt(BLUR**2 + 1 / 12) < band < 15
    _, derivatives = ellipse_image(to_symmetric(ROUND), np.arange(70), np.arange(60), LEAST_BLUR)
    assert np.isfinite(derivatives).all()


@pytest.mark.parametrize("expected", [0.5, 0.6])
def test_the_blur_stays_within_four_times_what_is_expected(monkeypatch, expected):
    """An image that is blurred more: the first step goes to the end of the range, no step beyond it."""
    blurs, at = [], ellipse._Linear.at
    monkeypatch.setattr(ellipse._Linear, "at", lambda *how: blurs.append(how[2]) or at(*how))
    likeliest_ellipse(exact(TRUE, 6.0), to_symmetric(TRUE), Optics(SHAPE, expected, 4.0, 1.0, 3.0), False, ALL)
    assert blurs[0] == pytest.approx(expected)
    assert max(blurs) == pytest.approx(4 * expected)
