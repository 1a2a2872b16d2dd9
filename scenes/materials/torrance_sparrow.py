"""The paper's reflectance (its eq. 1 and section 2): polarised Torrance-Sparrow."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, field_validator

from scenes.materials.brdf import Brdf, Curves, Index, Interval
from scenes.materials.kinds import MATERIALS
from scenes.materials.vectors import NUMPY, Ops, Vector, cross, dot, unit
from scenes.ranges import Fraction, Positive, rising

_COSINES, _BETWEEN = 2048, 1e-4  # where a range is tabulated, and what it may be beyond that between


@MATERIALS.add("torrance_sparrow")
class Material(Brdf):
    """Reflectance of the surface: the paper's Torrance-Sparrow model (its section 2).

    With n = 1 and k = 0 the Fresnel term vanishes and the surface is purely diffuse, reflecting (1 - s) R_d.
    """

    kind: Literal["torrance_sparrow"] = "torrance_sparrow"
    """The paper's reflectance; others of the renderer are refused, for no formula here says how bright they are."""
    specular_fraction: Fraction = 0.0
    """s: the part of light that is reflected by facets."""
    diffuse_reflectance: Fraction = 1.0
    """R_d."""
    refractive_index: Annotated[float, Field(gt=0, le=1e6)] = 1.0  # its square and its square's square must be numbers
    """n."""
    extinction: Annotated[float, Field(ge=0, le=1e6)] = 0.0
    """k."""
    roughness: Annotated[float, Field(ge=1e-6, le=1e6)] = 0.2
    """m of Beckmann's distribution: rms slope of the facets."""
    index_table: tuple[tuple[Positive, Positive, Annotated[float, Field(ge=0, le=1e6)]], ...] = ()
    """n and k by wavelength, instead of the two: rows [nm, n, k] of rising wavelengths."""

    @field_validator("index_table")
    @classmethod
    def _in_order(cls, rows: tuple) -> tuple:
        return rising("material.index_table", rows)

    @property
    def lambertian(self) -> float:
        """(1 - s) R_d."""
        return (1 - self.specular_fraction) * self.diffuse_reflectance

    @property
    def dull(self) -> str | None:
        """Why the specular term is exactly zero; None where it is not."""
        if self.specular_fraction == 0:
            return "specular_fraction is 0"
        table = [row[1:] for row in self.index_table] or [(self.refractive_index, self.extinction)]
        return "n = 1 and k = 0: no Fresnel reflection" if all(index == (1, 0) for index in table) else None

    @property
    def lobe_reflectance(self) -> float:
        """s, as if every facet were a perfect mirror."""
        return 0.0 if self.is_diffuse else self.specular_fraction

    @property
    def lobe_slope(self) -> float:
        """m."""
        return self.roughness

    @property
    def dispersion(self) -> tuple[tuple[float, float, float], ...]:
        """The table of indices."""
        return self.index_table

    def lobe(
        self,
        index: tuple[Index, ...],
        normal: Vector,
        to_light: Vector,
        to_sensor: Vector,
        polarisation: Vector | None,
        analyser: Vector | None,
        ops: Ops,
    ) -> Any:
        """The specular term of eq. 1 times N.L."""
        args = ops, self.roughness, index, normal, to_light, to_sensor, polarisation, analyser
        return self.specular_fraction * _specular(*args)

    def lobe_range(
        self,
        index: tuple[Index, ...],
        lean: Interval,
        facing: Interval,
        light_cosine: Interval,
        sensor_cosine: Interval,
        polarised: tuple[bool, bool],
    ) -> Interval:
        """Bounds of D, which has one maximum, times those of G and of the Fresnel term.

        >>> glossy = Material(specular_fraction=0.5, refractive_index=1.5)
        >>> ahead, aside = (0.0, 0.0, 1.0), (0.0, 0.6, 0.8)
        >>> cosine = 3 / np.sqrt(10)
        >>> sure = [(np.array(x), np.array(x)) for x in (np.arccos(cosine), cosine, 1.0, 0.8)]
        >>> told = glossy.lobe_range(glossy.indices(), *sure, (False, False))
        >>> exact = float(glossy.lobe(glossy.indices(), ahead, ahead, aside, None, None, NUMPY))
        >>> [round(float(each) / exact, 2) for each in told]
        [1.0, 1.0]
        """
        if self.is_diffuse:
            return super().lobe_range(index, lean, facing, light_cosine, sensor_cosine, polarised)
        widest = np.arccos(min(1.0, np.sqrt(0.5) / self.roughness))  # where D is largest
        facets = [beckmann(np.cos(at), np.sin(at) ** 2, self.roughness) for at in (*lean, np.clip(widest, *lean))]
        above, lit = (np.maximum(each, NUMPY.tiny) for each in sensor_cosine), np.maximum(light_cosine, 0.0)
        steep, flat = above
        ways = np.cos(np.minimum(lean, np.pi / 2)), np.maximum(facing, NUMPY.tiny)
        least, most = (
            np.minimum(1 / v, 2 * ways[0][1 - k] * np.minimum(1.0, lit[k] / v) / ways[1][1 - k])
            for k, v in enumerate((flat, steep))
        )
        mirrored, seen = _mirrored_range(index, facing, polarised), sensor_cosine[0] > 0
        shine = self.specular_fraction / np.pi
        least = np.where(seen, np.minimum(*facets[:2]) * least, 0.0)
        return shine * least * mirrored[0], shine * facets[2] * most * mirrored[1]

    def matt(self) -> Self:
        """The same with n = 1 and k = 0."""
        return self.tried(refractive_index=1.0, extinction=0.0, index_table=())

    def dimmed(self, part: float) -> Self:
        """Of both terms: s less by the part, and R_d such that (1 - s) R_d is.

        >>> shiny = Material(specular_fraction=0.4, diffuse_reflectance=0.5)
        >>> round(shiny.dimmed(0.1).lambertian / shiny.lambertian, 12)
        0.9
        """
        specular = (1 - part) * self.specular_fraction
        lambertian = (1 - part) * self.lambertian
        diffuse = lambertian / (1 - specular) if specular != 1 else self.diffuse_reflectance
        return self.tried(specular_fraction=specular, diffuse_reflectance=diffuse)

    def indices(self, curves: Curves = ()) -> tuple[Index, ...]:
        """The spectral sum of eq. 1: C S Q by the trapezium rule at the wavelengths of the table.

        Shares add up to 1, so that the exposure keeps its meaning: the grey level of a white diffuse surface. One
        without a table, for then nothing depends on the wavelength.
        """
        if not self.index_table:
            return (Index(self.refractive_index, self.extinction, 1.0),)
        wavelength, n, k = np.array(self.index_table).T
        width = np.gradient(wavelength) if len(wavelength) > 2 else np.ones(len(wavelength))
        width[[0, -1]] = np.diff(wavelength)[[0, -1]] / 2 if len(wavelength) > 2 else 1.0
        share = width.copy()
        for curve in curves:
            if curve:
                share *= np.interp(wavelength, *np.array(curve).T)
        share /= share.sum()
        return tuple(Index(*map(float, row)) for row in zip(n, k, share, strict=True))

    def with_dispersion(self, rows: tuple[tuple[float, float, float], ...]) -> Self:
        """The same with another table of indices."""
        return self.model_copy(update={"index_table": rows})


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
    coherent = ops.select(lower > 0, (minus * plus + side) / ops.maximum(lower, ops.tiny), 1 + 0 * lower)
    return perpendicular * share, perpendicular, -perpendicular * coherent


def beckmann(cosine, sine2, m: float, ops: Ops = NUMPY):
    """Beckmann roughness distribution D, as printed: exp(-(tan / m)^2) / (m^2 cos^4), from cosine and squared sine."""
    lit = cosine > 1e-9 * ops.flat  # below, D is 0 for every roughness
    safe = ops.select(lit, cosine, 1 + 0 * cosine)
    exponent = -sine2 / (m * safe) / (m * safe) - 4 * ops.log(safe) - 2 * ops.log(m + 0 * safe)
    return ops.select(lit, ops.exp(exponent), 0 * cosine)


def _specular(ops, roughness, index, normal, to_light, to_sensor, polarisation, analyser):
    """N.L K rho with K = D G / (pi N.L N.V), the factor G / (N.V) kept finite at grazing view."""
    nl, nv = dot(normal, to_light), dot(normal, to_sensor)
    half = unit(ops, tuple(x + y for x, y in zip(to_light, to_sensor, strict=True)))
    nh, vh = dot(normal, half), ops.minimum(ops.maximum(dot(to_sensor, half), ops.tiny), 1.0)
    off = cross(normal, half)
    above = ops.maximum(nv, ops.tiny)
    masking = ops.minimum(1 / above, 2 * nh * ops.minimum(1.0, ops.maximum(nl, 0.0) / above) / vh)
    facets = beckmann(nh, dot(off, off), roughness, ops)
    return facets * masking / ops.pi * _mirrored(ops, index, vh, half, to_light, to_sensor, polarisation, analyser)


def _mirrored(ops, index, cosine, half, to_light, to_sensor, polarisation, analyser):
    """Fraction of the light that a facet of normal ``half`` sends through the analyser, averaged over the bands."""
    if polarisation is not None or analyser is not None:
        s = _plane(ops, half, to_light, to_sensor)
        p_in, p_out = cross(s, to_light), cross(to_sensor, s)
        es, ep = (None, None) if polarisation is None else (dot(polarisation, s), dot(polarisation, p_in))
        ts, tp = (None, None) if analyser is None else (dot(analyser, s), dot(analyser, p_out))
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


def _mirrored_range(index: tuple[Index, ...], facing: Interval, polarised: tuple[bool, bool]) -> Interval:
    """The least and the most of `_mirrored` between two cosines, with light and analyser at whatever angle.

    Of runs of 1, 2, 4, ... places least and most are known; two of them cover a range.
    """
    places = np.clip(np.array(facing) * _COSINES, 0, _COSINES)
    first, last = np.floor(places[0]).astype(int), np.ceil(places[1]).astype(int)
    run = np.frexp(last - first + 1)[1] - 1
    least, most = _runs(index, polarised)
    starts = (run, first), (run, last - (1 << run) + 1)
    low, high = np.minimum(*(least[at] for at in starts)), np.maximum(*(most[at] for at in starts))
    return np.maximum(low - _BETWEEN, 0), high + _BETWEEN


@lru_cache(maxsize=64)
def _runs(index: tuple[Index, ...], polarised: tuple[bool, bool]) -> Interval:
    """The least and the most of `_mirrored` in runs of places (2^k, from each of them on), each (n, `_COSINES` + 1):
    nothing or the smaller of both reflectances, and the larger."""
    cosine, both = np.linspace(0, 1, _COSINES + 1), 0.0
    for n, k, share in index:
        both = both + share * np.array(fresnel(cosine, n, k)[:2])
    both = both if any(polarised) else both.mean(0, keepdims=True)
    both = both / 2 if polarised == (False, True) else both
    runs = [np.stack([both.min(0) * (not all(polarised)), both.max(0)])]
    for k in range(int(np.log2(_COSINES))):
        least, most = runs[-1]
        after = np.minimum(np.arange(_COSINES + 1) + (1 << k), _COSINES)
        runs.append(np.stack([np.minimum(least, least[after]), np.maximum(most, most[after])]))
    return tuple(np.stack(runs, 1))


def _plane(ops, half, to_light, to_sensor) -> Vector:
    """Unit normal of the plane of L and V; any direction across ``half`` where they coincide."""
    plane = cross(to_light, to_sensor)
    flat = dot(plane, plane) < ops.flat
    steep = abs(half[0]) > 0.7
    zero, one = 0.0 * half[2], 1.0 + 0.0 * half[2]
    spare = cross(half, (ops.select(steep, zero, one), ops.select(steep, one, zero), zero))
    return unit(ops, tuple(ops.select(flat, x, y) for x, y in zip(spare, plane, strict=True)))
