"""What an edge locator does to the noise, in closed form, and what no estimator can beat.

The image of an edge is a step of contrast C blurred with variance s_e^2 = blur^2 + 1/12 (the pixel's own box), in
white noise of variance s_n^2. The locator differentiates the image smoothed by a Gaussian of scale s and takes the
zero crossing of the second derivative across the edge.
"""

from __future__ import annotations

import numpy as np

PIXEL_VARIANCE = 1 / 12  # variance of a uniform distribution one pixel wide, px^2
STEP = 0.5  # px between the places across an edge at which the second derivative is told
CLEARANCE = 3.5  # standard deviations of the smoothed edge that a neighbouring edge must keep

MIN_CONTRAST = 5.0  # contrast / noise below which a locator's error is no longer linear in the noise
MIN_USABLE = 2.0  # px of an edge that must be left after trimming
SPACING = 2.0  # smoothing scales between edge points: between them errors are smooth
MOST_PLACES = 64  # times the planner's places, of those that are measured
FEWEST = 9  # points on an edge, however short: fewer do not stand for the integral along it


def edge_blur(blur_px):
    """Standard deviation s_e of the edge profile: lens blur and pixel aperture, px."""
    return np.hypot(blur_px, np.sqrt(PIXEL_VARIANCE))


def kappa2(scale: float, blur_px):
    """Variance of one edge point's position in units of (s_n / C)^2 px^2: kappa^2 of eq. 7.

    The second derivative's noise has variance 3 s_n^2 / (16 pi s^6); its slope at the crossing is
    C / (sqrt(2 pi) (s^2 + s_e^2)^(3/2)). Their ratio is (3/8) (1 + (s_e / s)^2)^3.

    Examples
    --------
    >>> round(float(kappa2(1.0, 1.3)), 2)
    8.0
    """
    return 3 / 8 * (1 + (edge_blur(blur_px) / scale) ** 2) ** 3


def located_kappa2(scale: float, blur_px):
    """The same of a crossing by the cubic through places of a profile `STEP` px apart, of an edge at one of them.

    Of f(x) = x exp(-x^2 / (2 (s^2 + s_e^2))) the cubic through four places has the slope (4 f(h) - f(2 h) / 2) / (3 h)
    at one of them, which is less than f's own: 1.3 % at a scale of 1 px and a blur of 0.6 px. Places are told from
    where the edge is expected, and it is there.

    Examples
    --------
    >>> [round(float(located_kappa2(scale, 0.6) / kappa2(scale, 0.6)), 3) for scale in (1.0, 2.0)]
    [1.027, 1.003]
    """
    return kappa2(scale, blur_px) / cubic_slope(scale**2 + edge_blur(blur_px) ** 2) ** 2


def cubic_slope(width2):
    """Slope of that cubic over the exact one, of an edge whose blur and smoothing have this variance together, px^2."""
    return (4 * np.exp(-(STEP**2) / (2 * width2)) - np.exp(-2 * STEP**2 / width2)) / 3


def isophote_kappa2(scale: float, blur_px):
    """The same for a level crossing of the smoothed image, the level known.

    The smoothed image's noise has variance s_n^2 / (4 pi s^2), its slope at the crossing is
    C / sqrt(2 pi (s^2 + s_e^2)). Their ratio is (1 + (s_e / s)^2) / 2.
    """
    return (1 + (edge_blur(blur_px) / scale) ** 2) / 2


def correlation(distance: np.ndarray, scale: float) -> np.ndarray:
    """Correlation of two edge points' errors that far apart along the edge: exp(-d^2 / (4 s^2))."""
    return np.exp(-((distance / (2 * scale)) ** 2))


def reach(scale: float, blur_px: float) -> float:
    """How near to another edge a locator's result is still undisturbed, px."""
    return float(CLEARANCE * np.hypot(scale, edge_blur(blur_px)))


def points_along(length: float, scale: float) -> int:
    """Number of edge points on a straight edge, px: at most 2 scales apart, and not too few.

    Points in between add nothing, for their errors are smooth.
    """
    return max(FEWEST, int(np.ceil(length / (SPACING * scale))) + 1)


def spacing(length: np.ndarray, scale: float) -> np.ndarray:
    """How far apart points lie on edges of about these lengths, px: `points_along`, whose steps are smoothed out."""
    return length / np.maximum(FEWEST - 1, length / (SPACING * scale) + 0.5)


def lacking(square):
    """What a sum over correlated points lacks at each end, and has more by a tilt, of what it has in the middle.

    Of points h apart on an edge of length L, of which the first and the last count half, h^2 times the double sum of
    g g' exp(-d^2 / (4 s^2)) is 2 sqrt(pi) s (integral of g^2 + h^2 L / 6 g'^2) - end s^2 (g^2 at both ends)
    + tilt s^4 g'^2 for a linear g. Both are told by (h / s)^2 as Euler and Maclaurin do, to 0.3 and 4 % of 2 and 8 / 3
    at 2 scales; of dense points they are 2 and 8 / 3.

    Examples
    --------
    >>> end, tilt = lacking(4.0)
    >>> round(end, 3), round(tilt, 3)
    (2.625, 0.489)
    """
    end = -(square * (square * (1 / 8064) + 1 / 480)) + 1 / 6
    return square * end + 2.0, square * (square * (11 / 360) - 2 / 3) + 8 / 3


def information_bound(contrast: np.ndarray, noise_variance, blur_px) -> np.ndarray:
    """Fisher information on the edge's position per px of its length, px^-3 (C^2 / (2 sqrt(pi) s_e s_n^2))."""
    return contrast**2 / (2 * np.sqrt(np.pi) * edge_blur(blur_px) * noise_variance)
