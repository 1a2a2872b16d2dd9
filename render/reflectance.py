"""The paper's reflectance (eq. 1) with polarised light and an analyser, for any array library.

Written once and run by Dr.Jit inside the renderer and by numpy where influences are estimated. ``ops`` names the
functions that differ. Vectors are tuples of three components, so that one text serves both.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from planner.imaging.illumination import bands
from scenes import Material, Scene

Vector = tuple[Any, Any, Any]


class Ops(NamedTuple):
    """The functions that Dr.Jit and numpy spell differently."""

    sqrt: Callable
    exp: Callable
    minimum: Callable
    maximum: Callable
    select: Callable


NUMPY = Ops(np.sqrt, np.exp, np.minimum, np.maximum, np.where)


class Index(NamedTuple):
    """Refractive index n, extinction k, and the weight of the light that sees them."""

    n: float
    k: float
    weight: float


def indices(scene: Scene, *, spectral: bool = True) -> tuple[Index, ...]:
    """The index at each wavelength that the sensor weighs (eq. 1), or the one number of the material."""
    if not spectral:
        return (Index(scene.material.refractive_index, scene.material.extinction, 1.0),)
    return tuple(Index(band.refractive_index, band.extinction, band.share) for band in bands(scene))


def brightness(
    ops: Ops,
    material: Material,
    index: tuple[Index, ...],
    normal: Vector,
    to_light: Vector,
    to_sensor: Vector,
    polarisation: Vector | None = None,
    analyser: Vector | None = None,
):
    """N.L times the reflectance, of a surface lit from ``to_light`` and seen from ``to_sensor``.

    Parameters
    ----------
    normal, to_light, to_sensor : Vector
        Unit vectors N, L, V.
    polarisation : Vector, optional
        Direction of polarisation (unit, perpendicular to L): J_perp = (polarisation . s)^2 and J_par =
        1 - J_perp with s the normal of the plane of L and V. Unpolarised, J_par = J_perp = 1/2, when not given.
    analyser : Vector, optional
        Direction that the analyser passes (unit, perpendicular to V). The diffuse term is unpolarised: half of it
        passes. The two components of the specular term keep their phase, so they interfere in the analyser.

    Returns
    -------
    array
        0 where the surface faces away from the light or from the sensor.
    """
    nl, nv = _dot(normal, to_light), _dot(normal, to_sensor)
    s = material.specular_fraction
    total = (1 - s) * material.diffuse_reflectance * nl * (1.0 if analyser is None else 0.5)
    if not material.is_diffuse:
        total = total + s * _specular(
            ops, material.roughness, index, normal, to_light, to_sensor, polarisation, analyser
        )
    return ops.select((nl > 0) & (nv > 0), total, 0.0)


def fresnel(ops: Ops, cosine, n: float, k: float):
    """Fresnel reflectance (parallel, perpendicular) and the real part of r_parallel times conjugate r_perpendicular.

    With q = (a - ib - t) / (a - ib + t), t = sin psi tan psi, the amplitudes obey r_parallel = -q r_perpendicular.
    Numerators and denominators are multiplied by cos^2, which keeps grazing incidence finite.
    """
    sine2 = (1 - cosine) * (1 + cosine)
    excess = (n - 1) * (n + 1) - k * k
    c = excess + cosine * cosine
    root = ops.sqrt(ops.maximum((ops.sqrt(c * c + (2 * n * k) ** 2) + abs(c)) / 2, 1e-30))
    other = n * k / root
    a, b = ops.select(c >= 0, root, other), ops.select(c >= 0, other, root)
    near = (excess + b * b) / ops.maximum(a + cosine, 1e-15)  # a - cos, without cancellation
    perpendicular = (near * near + b * b) / ops.maximum((a + cosine) * (a + cosine) + b * b, 1e-30)
    lower = ops.maximum((a * cosine + sine2) * (a * cosine + sine2) + b * b * cosine * cosine, 1e-30)
    upper = (a * cosine - sine2) * (a * cosine - sine2) + b * b * cosine * cosine
    coherent = (a * cosine - sine2) * (a * cosine + sine2) + b * b * cosine * cosine
    return perpendicular * upper / lower, perpendicular, -perpendicular * coherent / lower


def _specular(ops, roughness, index, normal, to_light, to_sensor, polarisation, analyser):
    """N.L K rho, K = D G / (pi N.L N.V)."""
    nl = ops.maximum(_dot(normal, to_light), 0.0)
    nv = ops.maximum(_dot(normal, to_sensor), 1e-12)
    half = _unit(ops, tuple(x + y for x, y in zip(to_light, to_sensor, strict=True)))
    nh = ops.maximum(_dot(normal, half), 1e-6)
    vh = ops.minimum(ops.maximum(_dot(to_sensor, half), 1e-6), 1.0)
    across = _cross(normal, half)
    tangent2 = _dot(across, across) / (nh * nh)
    distribution = ops.exp(-tangent2 / roughness**2) / (roughness**2 * nh * nh * nh * nh)
    g_over_nv = ops.minimum(1 / nv, 2 * nh * ops.minimum(1.0, nl / nv) / vh)
    reflected = _polarised(ops, index, vh, half, to_light, to_sensor, polarisation, analyser)
    return distribution * g_over_nv / math.pi * reflected


def _polarised(ops, index, cosine, half, to_light, to_sensor, polarisation, analyser):
    """Fraction of the light that a facet of normal ``half`` sends through the analyser, averaged over the bands."""
    if polarisation is not None or analyser is not None:
        s = _across(ops, half, to_light, to_sensor)
        p_in, p_out = _cross(s, to_light), _cross(to_sensor, s)
        es, ep = (None, None) if polarisation is None else (_dot(polarisation, s), _dot(polarisation, p_in))
        ts, tp = (None, None) if analyser is None else (_dot(analyser, s), _dot(analyser, p_out))
    total = 0.0
    for n, k, weight in index:
        parallel, perpendicular, coherent = fresnel(ops, cosine, n, k)
        if polarisation is None and analyser is None:
            passed = (parallel + perpendicular) / 2
        elif analyser is None:
            passed = parallel * ep * ep + perpendicular * es * es
        elif polarisation is None:
            passed = (parallel * tp * tp + perpendicular * ts * ts) / 2
        else:
            passed = parallel * (ep * tp) ** 2 + perpendicular * (es * ts) ** 2 + 2 * coherent * es * ep * ts * tp
        total = total + weight * passed
    return total


def _across(ops, half, to_light, to_sensor) -> Vector:
    """Unit normal of the plane of L and V; any direction across ``half`` where they coincide."""
    plane = _cross(to_light, to_sensor)
    flat = _dot(plane, plane) < 1e-10
    steep = abs(half[0]) > 0.7
    spare = _cross(half, (ops.select(steep, 0.0, 1.0), ops.select(steep, 1.0, 0.0), 0.0 * half[2]))
    return _unit(ops, tuple(ops.select(flat, x, y) for x, y in zip(spare, plane, strict=True)))


def _dot(a: Vector, b: Vector):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(ops: Ops, a: Vector) -> Vector:
    size = ops.sqrt(ops.maximum(_dot(a, a), 1e-30))
    return a[0] / size, a[1] / size, a[2] / size


def polarised_across(ops: Ops, axis: Vector, beam: Vector) -> Vector:
    """The direction across ``beam`` nearest to ``axis``: how a linear polariser of that axis acts on a slanted ray."""
    along = _dot(axis, beam)
    return _unit(ops, tuple(x - along * y for x, y in zip(axis, beam, strict=True)))
