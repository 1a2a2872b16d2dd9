"""Goodness of fit against the incomplete gamma function at 50 digits."""

import mpmath
import numpy as np
import pytest

from measure.goodness import p_value


def exact(squares, freedom):
    """Two-sided chi-square of each part that has any freedom, the smallest by Sidak; quiet parts are no misfit."""
    found = []
    with mpmath.workdps(50):
        for square, number in zip(squares, freedom, strict=True):
            if number:
                low = mpmath.gammainc(mpmath.mpf(number) / 2, 0, mpmath.mpf(square) / 2, regularized=True)
                tail = 1 - low if square < number / 10 else min(low, 1 - low)
                found.append(min(1, 2 * tail))
        return float(1 - (1 - min(found)) ** len(found))


@pytest.mark.parametrize(
    ("squares", "freedom"),
    [
        ([100.0], [100.0]), ([150.0], [100.0]), ([60.0], [100.0]), ([3.0], [2.0]), ([250.0, 90.0, 5.0], [200, 80, 8]),
        ([250.0, 7.0], [200.0, 0.0]), ([9.9], [100.0]), ([10.1], [100.0]), ([40.0, 9.0], [30.0, 100.0]),
        ([0.0, 31.0], [50.0, 30.0]),
    ],
)  # fmt: skip
def test_p_value(squares, freedom):
    assert p_value(np.array([squares]), np.array([freedom]))[0] == pytest.approx(exact(squares, freedom), rel=1e-9)


def test_each_image_by_itself():
    squares, freedom = np.array([[250.0, 90.0], [180.0, 70.0]]), np.array([[200.0, 80.0], [200.0, 0.0]])
    expected = [exact(*pair) for pair in zip(squares, freedom, strict=True)]
    assert p_value(squares, freedom) == pytest.approx(expected, rel=1e-9)
