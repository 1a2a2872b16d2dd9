"""The paper's illumination model (its section 2): polarised Torrance-Sparrow reflectance.

All functions are elementwise on broadcastable arrays. Cosines are of angles between unit vectors; angles
enter through their cosine and sine so that nothing is lost near 0 and 90 degrees.
"""

from __future__ import annotations

import numpy as np

from scenes import Material


def fresnel(cosine: np.ndarray, n: float, k: float) -> tuple[np.ndarray, np.ndarray]:
    """Fresnel reflectance (parallel, perpendicular) of a surface of complex index n - ik.

    The printed rho_parallel has sin^2 cos^2 in its numerator; it must be sin^2 tan^2 (textbook Fresnel),
    and here both sides of that fraction are multiplied by cos^2 so that grazing incidence stays finite.

    Parameters
    ----------
    cosine : array_like
        Cosine of the angle of incidence, 0 to 1.
    n, k : float
        Refractive index and extinction coefficient.

    Examples
    --------
    >>> [round(float(r), 6) for r in fresnel(1.0, 1.5, 0.0)]
    [0.04, 0.04]
    """
    cosine = np.asarray(cosine, float)
    sine2 = (1 - cosine) * (1 + cosine)
    excess = (n - 1) * (n + 1) - k * k  # a^2 - b^2 - cos^2; exactly 0 at n = 1, k = 0
    c = excess + cosine**2
    size = np.hypot(c, 2 * n * k)
    root = np.sqrt((size + np.abs(c)) / 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        other = np.where(root > 0, n * k / root, 0.0)
    a, b = np.where(c >= 0, root, other), np.where(c >= 0, other, root)
    total = a + cosine
    a_minus_cosine = np.divide(excess + b * b, total, out=np.zeros_like(total), where=total > 0)
    perpendicular = np.divide(
        a_minus_cosine**2 + b * b, total**2 + b * b, out=np.ones_like(total), where=total**2 + b * b > 0
    )
    upper = (a * cosine - sine2) ** 2 + (b * cosine) ** 2
    lower = (a * cosine + sine2) ** 2 + (b * cosine) ** 2
    return perpendicular * np.divide(upper, lower, out=np.ones_like(total), where=lower > 0), perpendicular


def beckmann(cosine: np.ndarray, sine: np.ndarray, m: float) -> np.ndarray:
    """Beckmann roughness distribution D, as printed: exp(-(tan/m)^2) / (m^2 cos^4)."""
    cosine = np.asarray(cosine, float)
    lit = cosine > 1e-100  # below, D is 0 for every roughness
    safe = np.where(lit, cosine, 1.0)
    exponent = -((np.asarray(sine) / (m * safe)) ** 2) - 4 * np.log(safe) - 2 * np.log(m)
    return np.where(lit, np.exp(np.where(lit, exponent, -np.inf)), 0.0)


def perpendicular_share(to_light: np.ndarray, half: np.ndarray, field: np.ndarray | None) -> np.ndarray | float:
    """J_perp of light of unit strength: the share of its field across the plane of incidence, spanned by L and H.

    1/2 for unpolarised light, and at normal incidence, where the two directions are the same to the surface.
    """
    if field is None:
        return 0.5
    field = field - np.einsum("...i,...i->...", field, to_light)[..., None] * to_light
    across = np.cross(to_light, half)
    size = np.einsum("...i,...i->...", across, across) * np.einsum("...i,...i->...", field, field)
    share = np.einsum("...i,...i->...", field, across) ** 2
    return np.divide(share, size, out=np.full(np.broadcast(share, size).shape, 0.5), where=size > 1e-28)


def reflected(
    material: Material,
    normal: np.ndarray,
    to_light: np.ndarray,
    to_sensor: np.ndarray,
    field: np.ndarray | None = None,
    index: tuple[float, float] | None = None,
) -> np.ndarray:
    """Brightness N.L (R_par J_par + R_perp J_perp) with J_par + J_perp = 1 (eq. 1).

    Parameters
    ----------
    normal, to_light, to_sensor : ndarray, shape (..., 3)
        Unit vectors N, L and V.
    field : ndarray, shape (..., 3), optional
        Electric field of linearly polarised light; unpolarised (J_par = J_perp = 1/2) when not given.
    index : pair of float, optional
        (n, k) at the wavelength; the material's when not given.

    Returns
    -------
    ndarray, shape (...)
        0 where the surface faces away from the light or from the sensor.
    """
    nl = np.einsum("...i,...i->...", normal, to_light)
    nv = np.einsum("...i,...i->...", normal, to_sensor)
    s = material.specular_fraction
    brightness = (1 - s) * material.diffuse_reflectance * nl
    if not material.is_diffuse:
        index = index or (material.refractive_index, material.extinction)
        brightness = brightness + s * _specular(material, normal, to_light, to_sensor, nl, nv, field, index)
    return np.where((nl > 0) & (nv > 0), brightness, 0.0)


def _specular(material, normal, to_light, to_sensor, nl, nv, field, index):
    """N.L K (rho_par J_par + rho_perp J_perp) with the factor G / (N.V) kept finite at grazing view."""
    half = to_light + to_sensor
    half = half / np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), np.finfo(float).tiny)
    nh = np.einsum("...i,...i->...", normal, half)
    vh = np.clip(np.einsum("...i,...i->...", to_sensor, half), np.finfo(float).tiny, 1.0)
    sine = np.linalg.norm(np.cross(normal, half), axis=-1)
    above = np.clip(nv, np.finfo(float).tiny, None)
    with np.errstate(over="ignore"):
        g_over_nv = np.minimum(1 / above, 2 * nh * np.minimum(1.0, np.maximum(nl, 0) / above) / vh)
    parallel, perpendicular = fresnel(vh, *index)
    share = perpendicular_share(to_light, half, field)
    mirrored = parallel * (1 - share) + perpendicular * share
    return beckmann(nh, sine, material.roughness) * g_over_nv / np.pi * mirrored
