"""Light as data sheets state it: lumens, lux and candelas as watts, watts as photons."""

from __future__ import annotations

import math

MOST_LM_PER_W = 683.0  # of 555 nm, by definition (SI)
WHITE_LM_PER_W, WHITE_NM = 300.0, 560.0  # light of a white LED: lumens a watt of light, and a wavelength that stands
# for its photons (Murphy 2012, J. Appl. Phys. 111, 104909: 250 to 370 lm/W)
_PLANCK, _LIGHT = 6.62607015e-34, 299792458.0


def efficacy(wavelength_nm: float | None) -> float:
    """Lumens a watt of light of one wavelength, or of a white LED where none is said.

    The photopic curve is the fit of Wyman, Sloan and Shirley (2013, J. Computer Graphics Techniques 2(2), eq. 4),
    within 1 % of its peak.

    >>> round(efficacy(555)), round(efficacy(625)), efficacy(None)
    (682, 216, 300.0)
    """
    if wavelength_nm is None:
        return WHITE_LM_PER_W
    lobes = ((0.821, 568.8, 46.9, 40.5), (0.286, 530.9, 16.3, 31.1))
    return MOST_LM_PER_W * sum(
        height * math.exp(-(((wavelength_nm - at) / (below if wavelength_nm < at else above)) ** 2) / 2)
        for height, at, below, above in lobes
    )


def photons_per_joule(wavelength_nm: float | None) -> float:
    """Of one wavelength, or of a white LED's light.

    >>> f"{photons_per_joule(530):.3g}"
    '2.67e+18'
    """
    return (wavelength_nm or WHITE_NM) * 1e-9 / (_PLANCK * _LIGHT)
