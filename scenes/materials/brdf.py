"""What every kind of material is: a bidirectional reflectance, the sum of a Lambertian part and a lobe."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple, Self

import numpy as np

from scenes.materials.vectors import NUMPY, Ops, Vector, across, components, dot
from scenes.model import Model

Interval = tuple[Any, Any]
Curves = Iterable[tuple[tuple[float, float], ...]]


class Index(NamedTuple):
    """Refractive index n, extinction k, and the share of the light that sees them."""

    n: float
    k: float
    share: float = 1.0


class Brdf(Model):
    """How a surface reflects light, the same in the image model and in the renderer.

    A new kind is a class in one file, made known by ``@MATERIALS.add(name)``: its fields and `lambertian`; `dull`,
    `lobe`, `lobe_range`, `lobe_reflectance`, `lobe_slope` and `matt` where it has a lobe; `dispersion`,
    `with_dispersion` and `indices` where that changes with the wavelength.
    """

    kind: str
    """Its kind's name."""

    @property
    def lambertian(self) -> float:
        """Reflectance of the Lambertian part, 0 to 1."""
        raise NotImplementedError

    @property
    def dull(self) -> str | None:
        """Why the lobe is exactly zero; None where it is not."""
        return "the surface is Lambertian"

    @property
    def is_diffuse(self) -> bool:
        """Whether the lobe is exactly zero."""
        return self.dull is not None

    @property
    def lobe_reflectance(self) -> float:
        """At most this part of the light is sent into the lobe, 0 to 1."""
        return 0.0

    @property
    def lobe_slope(self) -> float:
        """How far the lobe reaches, as rms slope of facets that mirror: tables of it are that fine."""
        return 1.0

    @property
    def dispersion(self) -> tuple[tuple[float, float, float], ...]:
        """What the lobe depends on by wavelength: rows [nm, n, k]; empty where it is the same at all."""
        return ()

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
        """What is added to `brightness` by the lobe where light and sensor stand before the surface; as written there.

        Written with ``ops`` and `scenes.materials.vectors`, it serves NumPy and the renderer alike.
        """
        raise NotImplementedError

    def lobe_range(
        self,
        index: tuple[Index, ...],
        lean: Interval,
        facing: Interval,
        light_cosine: Interval,
        sensor_cosine: Interval,
        polarised: tuple[bool, bool],
    ) -> Interval:
        """What `lobe` is not below, and what it is not above, of directions that are known to bounds; 0 and infinite of
        a kind that does not say.

        Parameters
        ----------
        lean : pair of array
            Angles between N and the half vector of L and V, radians, the least and the greatest.
        facing, light_cosine, sensor_cosine : pair of array
            Cosines between V and the half vector, N.L, and N.V, the least and the greatest.
        polarised : pair of bool
            Whether the light is, and whether there is an analyser.
        """
        none = np.zeros(np.shape(lean[0]))
        return none, none if self.is_diffuse else none + np.inf

    def matt(self) -> Self:
        """The same without a lobe, its Lambertian part as it is."""
        return self

    def dimmed(self, part: float) -> Self | None:
        """The same reflecting less by a part, at most 1, in all directions, more where it is negative, be it more than
        can be; None of a kind that does not say how."""
        return None

    def indices(self, curves: Curves = ()) -> tuple[Index, ...]:
        """What the lobe depends on at each wavelength that is seen, of light, filter and sensor of these curves."""
        return (Index(1.0, 0.0),)

    def with_dispersion(self, rows: tuple[tuple[float, float, float], ...]) -> Self:
        """The same with another dispersion, empty for none."""
        return self

    def diffuse(self, is_analysed: bool = False) -> float:
        """The Lambertian term over N.L; an analyser passes half of it."""
        return self.lambertian * (0.5 if is_analysed else 1.0)

    def brightness(
        self,
        index: tuple[Index, ...],
        normal: Vector,
        to_light: Vector,
        to_sensor: Vector,
        polarisation: Vector | None = None,
        analyser: Vector | None = None,
        ops: Ops = NUMPY,
    ) -> Any:
        """N.L (R_par J_par + R_perp J_perp), J_par + J_perp = 1 (eq. 1): 1 for a white diffuse surface facing it.

        Parameters
        ----------
        index : tuple of Index
            At each wavelength that the sensor weighs.
        normal, to_light, to_sensor : Vector
            Unit vectors N, L, V.
        polarisation : Vector, optional
            Direction of the light's polarisation (unit, perpendicular to L): J_perp = (polarisation . s)^2, s the
            normal of the plane of L and V. Unpolarised, J_par = J_perp = 1/2, when not given.
        analyser : Vector, optional
            Direction that the analyser passes (unit, perpendicular to V). The diffuse term is unpolarised: half of it
            passes. The two components of the specular term keep their phase, so they interfere in the analyser.

        Returns
        -------
        array
            0 where the surface faces away from the light or from the sensor.
        """
        nl, nv = dot(normal, to_light), dot(normal, to_sensor)
        total = self.diffuse(analyser is not None) * nl
        if not self.is_diffuse:
            total = total + self.lobe(index, normal, to_light, to_sensor, polarisation, analyser, ops)
        return ops.select((nl > 0) & (nv > 0), total, 0 * total)

    def reflected(
        self,
        index: tuple[Index, ...],
        normal: np.ndarray,
        to_light: np.ndarray,
        to_sensor: np.ndarray,
        polarisation: np.ndarray | None = None,
        analyser: np.ndarray | None = None,
    ) -> np.ndarray:
        """`brightness` for arrays of vectors (..., 3), which are broadcast; polarisers need not lie across the ray."""
        n, light, sensor = (components(v) for v in (normal, to_light, to_sensor))
        axes = [
            None if axis is None else across(components(axis), ray)
            for axis, ray in ((polarisation, light), (analyser, sensor))
        ]
        with np.errstate(all="ignore"):
            return np.asarray(self.brightness(index, n, light, sensor, *axes))
