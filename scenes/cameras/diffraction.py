"""The blur of a lens without faults: that of its aperture."""

from __future__ import annotations

import math


def airy_um(wavelength_nm: float, f_number: float) -> float:
    """Standard deviation in the image of the Gaussian nearest to an Airy disc, at a working f-number [um].

    sqrt(2) lambda / (2 pi A) with the numerical aperture A = 1 / (2 N) on the sensor's side (Zhang, Zerubia and
    Olivo-Marin 2007, two-dimensional, paraxial).

    >>> round(airy_um(550, 8), 3)
    1.981
    """
    return math.sqrt(2) / math.pi * wavelength_nm / 1000 * f_number
