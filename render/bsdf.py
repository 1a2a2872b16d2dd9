"""The paper's reflectance as a Mitsuba BSDF, in Dr.Jit arithmetic: runs compiled under LLVM and CUDA, and in scalar."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

from render.reflectance import Index, Ops, brightness, polarised_across
from scenes import Material

NAME = "ice_torrance_sparrow"
_ROUNDING = 1e-6  # of a cosine, in single precision


@dataclass(frozen=True)
class Surface:
    """What the BSDF needs to know; positions and directions in space, cm.

    ``polarisation`` is the direction of polarisation of the light at ``light``, ``analyser`` what the polariser before
    the sensor at ``sensor`` passes; None without one. Light between two surfaces counts as unpolarised; light and
    sensor are known by their directions, within the angles (radians) that their sizes span.
    """

    material: Material
    index: tuple[Index, ...]
    sensor: tuple[float, float, float]
    light: tuple[float, float, float]
    polarisation: tuple[float, float, float] | None = None
    analyser: tuple[float, float, float] | None = None
    light_angle: float = 0.0
    sensor_angle: float = 0.0


_surfaces: list[Surface] = []  # Mitsuba's properties carry numbers only: a BSDF finds its Surface by place


def describe(mitsuba: Any, surface: Surface) -> dict:
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

    ops = Ops(dr.sqrt, dr.exp, dr.minimum, dr.maximum, dr.select)

    class TorranceSparrow(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.surface = _surfaces[int(props["surface"])]
            self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
            self.m_flags = self.m_components[0]

        def sample(self, ctx, si, sample1, sample2, active=True):
            wo = mi.warp.square_to_cosine_hemisphere(sample2)
            record = mi.BSDFSample3f()
            record.wo, record.pdf, record.eta = wo, mi.warp.square_to_cosine_hemisphere_pdf(wo), 1.0
            record.sampled_component = 0
            record.sampled_type = +mi.BSDFFlags.GlossyReflection
            active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (record.pdf > 0)
            return record, self.eval(ctx, si, wo, active) / record.pdf & active

        def eval(self, ctx, si, wo, active=True):
            known = self.surface
            lit, seen = (_towards(dr, mi, si, at) for at in (known.light, known.sensor))
            polarisation = None if known.polarisation is None else _local(dr, mi, si, known.polarisation, wo)
            analyser = None if known.analyser is None else _local(dr, mi, si, known.analyser, si.wi)
            from_light = dr.dot(lit, wo) > math.cos(known.light_angle) - _ROUNDING
            to_sensor = dr.dot(seen, si.wi) > math.cos(known.sensor_angle) - _ROUNDING
            value = self._value(wo, si.wi, None, None)
            if polarisation is not None:
                value = dr.select(from_light, self._value(wo, si.wi, polarisation, None), value)
            if analyser is not None:
                passed = self._value(wo, si.wi, None, analyser)
                if polarisation is not None:
                    passed = dr.select(from_light, self._value(wo, si.wi, polarisation, analyser), passed)
                value = dr.select(to_sensor, passed, value)
            return mi.Spectrum(value / math.pi) & active

        def _value(self, wo, wi, polarisation, analyser):
            known = self.surface
            up = (0.0 * wi.x, 0.0 * wi.x, 1.0 + 0.0 * wi.x)
            light, sensor = (wo.x, wo.y, wo.z), (wi.x, wi.y, wi.z)
            return brightness(ops, known.material, known.index, up, light, sensor, polarisation, analyser)

        def pdf(self, ctx, si, wo, active=True):
            above = (mi.Frame3f.cos_theta(si.wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0)
            return dr.select(above, mi.warp.square_to_cosine_hemisphere_pdf(wo), 0.0)

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def to_string(self):
            return f"TorranceSparrow[{self.surface}]"

    def _local(dr, mi, si, axis, beam):
        local = si.to_local(mi.Vector3f(*axis))
        return polarised_across(ops, (local.x, local.y, local.z), (beam.x, beam.y, beam.z))

    mi.register_bsdf(NAME, lambda props: TorranceSparrow(props))


def _towards(dr, mi, si, position):
    """Unit vector in the surface's frame towards a place in space."""
    return si.to_local(dr.normalize(mi.Point3f(*position) - si.p))
