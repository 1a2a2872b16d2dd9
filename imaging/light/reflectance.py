"""The paper's reflectance (its eq. 1 and section 2): polarised Torrance-Sparrow, written once for any array library.

``ops`` names the functions that differ: numpy for the planner and the measurement, Dr.Jit within the renderer, mpmath
for references of 50 digits. Vectors are tuples of three components, so that one text serves all; `reflected` takes
numpy's arrays of vectors.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from scenes import Material

Vector = tuple[Any, Any, Any]


class Ops(NamedTuple):
    """The functions that array libraries spell differently, and two numbers of their precision.

    ``tiny`` is so small that nothing is lost by taking it for 0, and its inverse can be formed; below ``flat`` the
    squared sine of the angle between two directions is rounding.
    """

    sqrt: Callable
    exp: Callable
    log: Callable
    minimum: Callable
    maximum: Callable
    select: Callable
    tiny: Any = 1e-300
    flat: Any = 1e-26
    pi: Any = math.pi


NUMPY = Ops(np.sqrt, np.exp, np.log, np.minimum, np.maximum, np.where)


class Index(NamedTuple):
    """Refractive index n, extinction k, and the share of the light that sees them."""

    n: float
    k: float
    share: float = 1.0


def fresnel(cosine, n: float, k: float, ops: Ops = NUMPY):
    """Fresnel reflectance (parallel, perpendicular) and the real part of r_parallel times conjugate r_perpendicular.

    The printed rho_parallel has sin^2 cos^2 in its numerator; it must be sin^2 tan^2 (textbook Fresnel), and here
    numerators and denominators are multiplied by cos^2 so that grazing incidence stays finite. With q = (a - ib - t) /
    (a - ib + t), t = sin psi tan psi, the amplitudes obey r_parallel = -q r_perpendicular.

    Parameters
    ----------
    cosine : array
        Cosine of the angle of incidence, 0 to 1.
    n, k : float
        Refractive index n - ik.

    Examples
    --------
    >>> [round(float(r), 6) for r in fresnel(np.array(1.0), 1.5, 0.0)]
    [0.04, 0.04, -0.04]
    """
    sine2 = (1 - cosine) * (1 + cosine)
    excess = (n - 1) * (n + 1) - k * k  # a^2 - b^2 - cos^2; exactly 0 at n = 1, k = 0
    c = excess + cosine * cosine
    root = ops.sqrt((ops.sqrt(c * c + (2 * n * k) ** 2) + abs(c)) / 2)
    other = n * k / ops.maximum(root, ops.tiny)
    a, b = ops.select(c >= 0, root, other), ops.select(c >= 0, other, root)
    total = a + cosine
    near = ops.select(total > 0, (excess + b * b) / ops.maximum(total, ops.tiny), 0 * total)  # a - cos, no cancellation
    size = total * total + b * b
    perpendicular = ops.select(size > 0, (near * near + b * b) / ops.maximum(size, ops.tiny), 1 + 0 * size)
    minus, plus, side = a * cosine - sine2, a * cosine + sine2, b * b * cosine * cosine
    lower = plus * plus + side
    share = ops.select(lower > 0, (minus * minus + side) / ops.maximum(lower, ops.tiny), 1 + 0 * lower)
    coherent = ops.select(lower > 0, (minus * plus + side) / ops.maximum(lower, ops.tiny), -1 + 0 * lower)
    return perpendicular * share, perpendicular, -perpendicular * coherent


def beckmann(cosine, sine2, m: float, ops: Ops = NUMPY):
    """Beckmann roughness distribution D, as printed: exp(-(tan / m)^2) / (m^2 cos^4), from cosine and squared sine."""
    lit = cosine > 1e-9 * ops.flat  # below, D is 0 for every roughness
    safe = ops.select(lit, cosine, 1 + 0 * cosine)
    exponent = -sine2 / (m * safe) / (m * safe) - 4 * ops.log(safe) - 2 * ops.log(m + 0 * safe)
    return ops.select(lit, ops.exp(exponent), 0 * cosine)


def brightness(
    material: Material,
    index: tuple[Index, ...],
    normal: Vector,
    to_light: Vector,
    to_sensor: Vector,
    polarisation: Vector | None = None,
    analyser: Vector | None = None,
    ops: Ops = NUMPY,
):
    """N.L (R_par J_par + R_perp J_perp), J_par + J_perp = 1 (eq. 1): 1 for a white diffuse surface facing it.

    Parameters
    ----------
    index : tuple of Index
        At each wavelength that the sensor weighs.
    normal, to_light, to_sensor : Vector
        Unit vectors N, L, V.
    polarisation : Vector, optional
        Direction of the light's polarisation (unit, perpendicular to L): J_perp = (polarisation . s)^2, s the normal of
        the plane of L and V. Unpolarised, J_par = J_perp = 1/2, when not given.
    analyser : Vector, optional
        Direction that the analyser passes (unit, perpendicular to V). The diffuse term is unpolarised: half of it
        passes. The two components of the specular term keep their phase, so they interfere in the analyser.

    Returns
    -------
    array
        0 where the surface faces away from the light or from the sensor.
    """
    nl, nv = _dot(normal, to_light), _dot(normal, to_sensor)
    total = diffuse(material, analyser is not None) * nl
    if not material.is_diffuse:
        shown = _specular(ops, material.roughness, index, normal, to_light, to_sensor, nl, nv, polarisation, analyser)
        total = total + material.specular_fraction * shown
    return ops.select((nl > 0) & (nv > 0), total, 0 * total)


def diffuse(material: Material, analysed: bool = False) -> float:
    """The diffuse term over N.L; an analyser passes half of it."""
    return (1 - material.specular_fraction) * material.diffuse_reflectance * (0.5 if analysed else 1.0)


def reflected(
    material: Material,
    index: tuple[Index, ...],
    normal: np.ndarray,
    to_light: np.ndarray,
    to_sensor: np.ndarray,
    polarisation: np.ndarray | None = None,
    analyser: np.ndarray | None = None,
) -> np.ndarray:
    """`brightness` for arrays of vectors (..., 3), which are broadcast; polariser axes need not lie across the ray."""
    n, light, sensor = (_components(v) for v in (normal, to_light, to_sensor))
    axes = [
        None if axis is None else across(_components(axis), ray)
        for axis, ray in ((polarisation, light), (analyser, sensor))
    ]
    with np.errstate(all="ignore"):
        return np.asarray(brightness(material, index, n, light, sensor, *axes))


def across(axis: Vector, beam: Vector, ops: Ops = NUMPY) -> Vector:
    """The direction across ``beam`` nearest to ``axis``: how a linear polariser of that axis acts on a slanted ray."""
    along = _dot(axis, beam)
    return _unit(ops, tuple(x - along * y for x, y in zip(axis, beam, strict=True)))


def _specular(ops, roughness, index, normal, to_light, to_sensor, nl, nv, polarisation, analyser):
    """N.L K rho with K = D G / (pi N.L N.V), the factor G / (N.V) kept finite at grazing view."""
    half = _unit(ops, tuple(x + y for x, y in zip(to_light, to_sensor, strict=True)))
    nh, vh = _dot(normal, half), ops.minimum(ops.maximum(_dot(to_sensor, half), ops.tiny), 1.0)
    off = _cross(normal, half)
    above = ops.maximum(nv, ops.tiny)
    masking = ops.minimum(1 / above, 2 * nh * ops.minimum(1.0, ops.maximum(nl, 0.0) / above) / vh)
    facets = beckmann(nh, _dot(off, off), roughness, ops)
    return facets * masking / ops.pi * _mirrored(ops, index, vh, half, to_light, to_sensor, polarisation, analyser)


def _mirrored(ops, index, cosine, half, to_light, to_sensor, polarisation, analyser):
    """Fraction of the light that a facet of normal ``half`` sends through the analyser, averaged over the bands."""
    if polarisation is not None or analyser is not None:
        s = _plane(ops, half, to_light, to_sensor)
        p_in, p_out = _cross(s, to_light), _cross(to_sensor, s)
        es, ep = (None, None) if polarisation is None else (_dot(polarisation, s), _dot(polarisation, p_in))
        ts, tp = (None, None) if analyser is None else (_dot(analyser, s), _dot(analyser, p_out))
    total = 0.0
    for n, k, share in index:
        parallel, perpendicular, coherent = fresnel(cosine, n, k, ops)
        if polarisation is None and analyser is None:
            passed = (parallel + perpendicular) / 2
        elif analyser is None:
            passed = parallel * ep * ep + perpendicular * es * es
        elif polarisation is None:
            passed = (parallel * tp * tp + perpendicular * ts * ts) / 2
        else:
            passed = parallel * (ep * tp) ** 2 + perpendicular * (es * ts) ** 2 + 2 * coherent * es * ep * ts * tp
        total = total + share * passed
    return total


def _plane(ops, half, to_light, to_sensor) -> Vector:
    """Unit normal of the plane of L and V; any direction across ``half`` where they coincide."""
    plane = _cross(to_light, to_sensor)
    flat = _dot(plane, plane) < ops.flat
    steep = abs(half[0]) > 0.7
    zero, one = 0.0 * half[2], 1.0 + 0.0 * half[2]
    spare = _cross(half, (ops.select(steep, zero, one), ops.select(steep, one, zero), zero))
    return _unit(ops, tuple(ops.select(flat, x, y) for x, y in zip(spare, plane, strict=True)))


def _components(vectors: np.ndarray) -> Vector:
    vectors = np.asarray(vectors, float)
    return vectors[..., 0], vectors[..., 1], vectors[..., 2]


def _dot(a: Vector, b: Vector):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(ops: Ops, a: Vector) -> Vector:
    size = ops.sqrt(ops.maximum(_dot(a, a), ops.tiny))
    return a[0] / size, a[1] / size, a[2] / size
