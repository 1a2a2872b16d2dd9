"""A material's reflectance as a Mitsuba BSDF, in Dr.Jit arithmetic: compiled under LLVM and CUDA, or scalar."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from render.texture import Face, bitmap
from scenes import Brdf
from scenes.materials.brdf import Index
from scenes.materials.vectors import Ops, across

NAME = "ice_brdf"
_ROUNDING = 1e-6  # of a cosine, in single precision


class PolarisedLight(NamedTuple):
    """A polarised light: its place (scene units), its direction of polarisation, and the angle (rad) that it spans."""

    at: tuple[float, float, float]
    polarisation: tuple[float, float, float]
    angle: float


@dataclass(frozen=True)
class Interaction:
    """What the BSDF needs to know; positions and directions in space, scene units.

    ``analyser`` is what the polariser before the sensor at ``sensor`` passes; None without one. Light between two
    surfaces counts as unpolarised; lamps and sensor are known by their directions, within the angles that they span,
    the sensor within ``sensor_angle`` (rad); sensor and its share of perspective are those of a
    `scenes.viewpoint.Viewpoint`.
    ``texture`` has factors of the diffuse reflectance.
    """

    material: Brdf
    index: tuple[Index, ...]
    sensor: tuple[float, float, float]
    sensor_angle: float
    lamps: tuple[PolarisedLight, ...] = ()
    analyser: tuple[float, float, float] | None = None
    texture: Face | None = None
    sensor_share: float = 1.0


_surfaces: list[Interaction] = []  # Mitsuba's properties carry numbers only: a BSDF finds its surface by place


def describe(mitsuba: Any, surface: Interaction) -> dict:
    """Mitsuba's description of the BSDF for a surface."""
    _register(mitsuba.variant())
    if surface not in _surfaces:
        _surfaces.append(surface)
    return {"type": NAME, "surface": _surfaces.index(surface)}


@functools.cache
def _register(variant: str) -> None:
    """Make the BSDF's class for the active variant; Mitsuba keeps one registration a variant."""
    import drjit as dr
    import mitsuba as mi

    ops = Ops(dr.sqrt, dr.exp, dr.log, dr.minimum, dr.maximum, dr.select, tiny=1e-30, flat=1e-10)

    class Reflecting(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.surface = _surfaces[int(props["surface"])]
            known = self.surface.texture
            self.texture = None if known is None else mi.load_dict(bitmap(mi, known.values))
            self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
            self.m_flags = self.m_components[0]

        def sample(self, ctx, si, sample1, sample2, active=True):
            wo = mi.warp.square_to_cosine_hemisphere(sample2)
            record = mi.BSDFSample3f()
            record.wo, record.pdf, record.eta = wo, mi.warp.square_to_cosine_hemisphere_pdf(wo), 1.0
            record.sampled_component = 0
            record.sampled_type = +mi.BSDFFlags.GlossyReflection
            active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (record.pdf > 0)
            return record, self.eval(ctx, si, wo, active) / dr.maximum(record.pdf, 1e-30) & active

        def eval(self, ctx, si, wo, active=True):
            known = self.surface
            analyser = None if known.analyser is None else _local(si, known.analyser, si.wi)
            to_sensor = _along(dr, mi, si, known.sensor, si.wi, known.sensor_angle, known.sensor_share)
            factor = 1.0 if self.texture is None else self.texture.eval_1(si, active)
            value = self._seen(wo, si.wi, None, analyser, to_sensor, factor)
            for lamp in known.lamps:
                polarisation = _local(si, lamp.polarisation, wo)
                lit = self._seen(wo, si.wi, polarisation, analyser, to_sensor, factor)
                value = dr.select(_along(dr, mi, si, lamp.at, wo, lamp.angle), lit, value)
            return mi.Spectrum(value / math.pi) & active

        def _seen(self, wo, wi, polarisation, analyser, to_sensor, factor):
            """The sensor looks through the analyser, other surfaces do not."""
            value = self._value(wo, wi, polarisation, None, factor)
            if analyser is None:
                return value
            return dr.select(to_sensor, self._value(wo, wi, polarisation, analyser, factor), value)

        def _value(self, wo, wi, polarisation, analyser, factor):
            known = self.surface
            up = (0.0 * wi.x, 0.0 * wi.x, 1.0 + 0.0 * wi.x)
            light, sensor = (wo.x, wo.y, wo.z), (wi.x, wi.y, wi.z)
            value = known.material.brightness(known.index, up, light, sensor, polarisation, analyser, ops)
            if self.texture is None:
                return value
            matt = (factor - 1) * known.material.diffuse(analyser is not None) * wo.z
            return value + dr.select((wo.z > 0) & (wi.z > 0), matt, 0.0)

        def pdf(self, ctx, si, wo, active=True):
            above = (mi.Frame3f.cos_theta(si.wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0)
            return dr.select(above, mi.warp.square_to_cosine_hemisphere_pdf(wo), 0.0)

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def to_string(self):
            return f"Reflecting[{self.surface}]"

    def _local(si, axis, beam):
        local = si.to_local(mi.Vector3f(*axis))
        return across((local.x, local.y, local.z), (beam.x, beam.y, beam.z), ops)

    mi.register_bsdf(NAME, lambda props: Reflecting(props))


def _along(dr, mi, si, position, way, angle: float, share: float = 1.0):
    """Whether a way in the surface's frame leads to a place in space, within an angle."""
    towards = si.to_local(dr.normalize(mi.Point3f(*position) - share * si.p))
    return dr.dot(towards, way) > math.cos(angle) - _ROUNDING
