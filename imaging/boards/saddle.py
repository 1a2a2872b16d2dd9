"""The image of two edges that cross, as a lens and square pixels record it.

Of two unit signs s1, s2, each +1 on one side of a line, what a Gaussian lens blur leaves is E[s1] = erf(z1 / sqrt 2),
z being the signed distance over the blur, and E[s1 s2] = erf erf + 4 times the integral of the bivariate normal density
over the correlation from 0 to rho, the cosine of the angle between the normals (Plackett's identity). The four
quadrants' levels, linear in place, are combinations of 1, E[s1], E[s2] and E[s1 s2]. The pixel's box is integrated by
three Gauss-Legendre points each way. A line that is slightly bent has the distance to its parabola.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import erf

SHAPE = 5  # x, y, angle of one edge, of the other, logarithm of the blur
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_INSIDE = np.stack(np.meshgrid(_NODES / 2, _NODES / 2), -1).reshape(-1, 2)  # of a pixel
_SHARE = np.outer(_WEIGHTS, _WEIGHTS).ravel() / 4
_PLACES, _PARTS = np.polynomial.legendre.leggauss(6)


@dataclass(frozen=True, eq=False)
class Response:
    """What pixels make of a crossing.

    Attributes
    ----------
    signs : ndarray, shape (n, pixels, 3)
        E[s1], E[s2], E[s1 s2].
    slopes : ndarray, shape (n, pixels, 3, 5)
        Their derivatives by x, y (px), both angles (radians) and the logarithm of the blur.
    """

    signs: np.ndarray
    slopes: np.ndarray


def response(places: np.ndarray, shape: np.ndarray, bend: np.ndarray) -> Response:
    """Of n crossings in the pixels around them.

    Parameters
    ----------
    places : ndarray, shape (n, pixels, 2)
        Centres of pixels, px.
    shape : ndarray, shape (n, 5)
        x, y (px), directions of both edges (radians), logarithm of the lens blur's standard deviation (px).
    bend : ndarray, shape (n, 2)
        Curvature of both edges where they cross, 1/px, towards the left normal (-sin, cos) of their direction.
    """
    angle, scale = shape[:, None, None, 2:4], np.exp(shape[:, 4])[:, None, None]
    away = places[:, :, None] + _INSIDE - shape[:, None, None, :2]  # (n, pixels, inside, 2)
    distance, slopes = [], []
    for k in range(2):
        sine, cosine, kappa = np.sin(angle[..., k]), np.cos(angle[..., k]), bend[:, None, None, k]
        along = away[..., 0] * cosine + away[..., 1] * sine
        across = away[..., 1] * cosine - away[..., 0] * sine
        distance.append((across - kappa * along**2 / 2) / scale)
        tilt = kappa * along
        slopes.append(
            np.stack([sine + tilt * cosine, tilt * sine - cosine, -along * (1 + kappa * across)], -1) / scale[..., None]
        )
    turn = angle[..., 0] - angle[..., 1]
    return _averaged(*distance, *slopes, turn)


def _averaged(one: np.ndarray, other: np.ndarray, by_one: np.ndarray, by_other: np.ndarray, turn: np.ndarray):
    """Mean over each pixel, of the signs and of their derivatives."""
    rho = np.cos(turn)
    first, second = erf(one / np.sqrt(2)), erf(other / np.sqrt(2))
    both = first * second + 4 * _plackett(one, other, rho)
    density = [np.sqrt(2 / np.pi) * np.exp(-(z**2) / 2) for z in (one, other)]
    left = np.sqrt(np.maximum(1 - rho**2, 1e-6))
    by = [density[0] * erf((other - rho * one) / (left * np.sqrt(2))),
          density[1] * erf((one - rho * other) / (left * np.sqrt(2)))]  # fmt: skip
    joint = np.exp(-(one**2 - 2 * rho * one * other + other**2) / (2 * left**2)) * (2 / np.pi / left)
    turning = -np.sin(turn) * joint  # of E[s1 s2] by the first angle through rho

    def mean(values: np.ndarray) -> np.ndarray:
        return values @ _SHARE

    signs = np.stack([mean(first), mean(second), mean(both)], -1)
    slopes = np.zeros((*signs.shape, SHAPE))
    for axis in (0, 1):
        slopes[..., 0, axis] = mean(density[0] * by_one[..., axis])
        slopes[..., 1, axis] = mean(density[1] * by_other[..., axis])
        slopes[..., 2, axis] = mean(by[0] * by_one[..., axis] + by[1] * by_other[..., axis])
    slopes[..., 0, 2] = mean(density[0] * by_one[..., 2])
    slopes[..., 1, 3] = mean(density[1] * by_other[..., 2])
    slopes[..., 2, 2] = mean(by[0] * by_one[..., 2] + turning)
    slopes[..., 2, 3] = mean(by[1] * by_other[..., 2] - turning)
    slopes[..., 0, 4] = -mean(density[0] * one)
    slopes[..., 1, 4] = -mean(density[1] * other)
    slopes[..., 2, 4] = -mean(by[0] * one + by[1] * other)
    return Response(signs, slopes)


def _plackett(one: np.ndarray, other: np.ndarray, rho: np.ndarray) -> np.ndarray:
    """Integral of the bivariate standard normal density over its correlation, from 0 to rho (r = sin of an angle)."""
    most = np.arcsin(rho)
    total, square, product = np.zeros_like(one), (one**2 + other**2) / 2, one * other
    for place, part in zip(_PLACES, _PARTS, strict=True):
        at = most * (1 + place) / 2
        total += part * np.exp((product * np.sin(at) - square) / np.cos(at) ** 2)
    return total * most / (4 * np.pi)
