"""Limbs where the eye is near or far, the surface nearly plane, or its equation of low rank, against 50 digits."""

from __future__ import annotations

import numpy as np

from imaging.contours import limb
from scenes import Camera, Telecentric
from scenes.parts.surfaces import Cone, Cylinder, Quadric, Sphere, Surface, Torus
from validation.hard.case import Answer, Case, Reference
from validation.hard.precise import mp, mpf

_AXIS = (1.0, 0.0, 0.0)  # across the line of sight of a sensor above
_FOCAL = 2000.0


def cases() -> list[Case]:
    """All cases of limbs."""
    found = []
    for name, distance in (
        ("eye 1e-9 radii over it", 2.0 * (1 + 1e-9)),
        ("eye 1e-4 radii over it", 2.0 * (1 + 1e-4)),
        ("eye 1e3 radii away", 2e3),
        ("eye 1e6 radii away", 2e6),
    ):
        found.append(_half_width(f"sphere, {name}", Sphere((0, 0, 0), 2.0), distance))
        found.append(_half_width(f"cylinder, {name}", Cylinder((0, 0, 0), _AXIS, 2.0, (-1, 1)), distance))
        ball = Quadric(np.eye(3), (0, 0, 0), -4.0)
        found.append(_half_width(f"sphere as an equation, {name}", ball, distance))
        pipe = Quadric(np.diag([0.0, 1, 1]), (0, 0, 0), -4.0)
        found.append(_half_width(f"cylinder as an equation, {name}", pipe, distance))
    for angle in (0.0, 1e-9, -1e-9, 0.1, -5.0):
        for kind, surface in (
            ("sphere", Sphere((0, 0, 0), 2.0)), ("cylinder", Cylinder((0, 0, 0), _AXIS, 2.0, (-1, 1))),
            ("sphere as an equation", Quadric(np.eye(3), (0, 0, 0), -4.0)),
        ):  # fmt: skip
            found.append(_telecentric(f"{kind}, chief rays of {angle:g} deg", surface, angle))
    for angle in (1e-12, 1e-6):
        found.append(
            _half_width(
                f"cone of {angle:g} deg", Cone((0, 0, 0), _AXIS, 2.0, (-1e-9, 1e-9), half_angle_deg=angle), 30.0
            )
        )
    found.append(_half_width("torus with a thin tube", Torus((0, 0, 0), (0, 0, 1), 1.0, 1e-9), 30.0, radius=1.0 + 1e-9))
    for name, surface in (
        ("eye on a sphere", Sphere((0, 0, 0), 30.0)),
        ("eye 1e-13 radii over a sphere", Quadric(np.eye(3), (0, 0, 0), -900.0 * (1 - 2e-13))),
    ):
        found.append(_refused(name, surface, "tangent"))
    found.append(_refused("eye in a sphere", Sphere((0, 0, 0), 31.0), "inside"))
    found.append(_refused("two planes", Quadric(np.diag([1.0, -1, 0]), (0, 0, 0), 0.0), "degenerate"))
    found.append(_refused("a plane and 1e-14 of bend", Quadric(1e-14 * np.eye(3), (0, 0, 1), -1.0), "tangent"))
    found.append(_refused("an equation without real points", Quadric(np.eye(3), (0, 0, 0), 4.0), "none"))
    return found


def _half_width(name: str, surface: Surface, distance: float, radius: float = 2.0) -> Case:
    """How far the limb's image is from that of the axis, px: f r / sqrt(L^2 - r^2)."""
    camera = Camera(width=640, height=480, focal_px=_FOCAL, distance=distance)
    thin = isinstance(surface, Torus)

    def ours() -> Answer:
        found = limb(surface, (0.0, 0.0), camera, np.linspace(0.0, 1.0, 9))
        if not found.strands:
            return Answer(None, found.status)
        across = [np.linalg.norm(s.at[:, : 2 if thin or _is_ball(surface) else 1], axis=1) for s in found.strands]
        return Answer(float(np.concatenate(across).max()), found.status)

    def reference() -> Reference:
        far, size = mpf(distance), mpf(radius)
        if isinstance(surface, Torus):  # of the tube's circle: its limb is that of the tangent from the axis' point
            middle, tube = mpf(surface.radius), mpf(surface.tube)
            tilt = mp.asin(tube / mp.hypot(middle, far)) + mp.atan(middle / far)
            return Reference.precise(_FOCAL * mp.tan(tilt), 4.0)
        rest = (far - size) * (far + size)
        return Reference.precise(_FOCAL * size / mp.sqrt(rest), 1 + 2 * far**2 / rest)

    refusals = ("tangent",) if isinstance(surface, Quadric) and distance < 2.1 else ()
    return Case("limb", name, "half width px", ours, reference, refusals)


def _telecentric(name: str, surface: Surface, angle: float) -> Case:
    """The same before a telecentric camera, px: k r / sqrt(1 - t^2 r^2), k px a unit, t the tangent over the field."""
    camera = Telecentric(
        kind="telecentric", width=640, height=480, focal_px=_FOCAL, distance=30.0, magnification=1.0,
        telecentricity_deg=angle,
    )  # fmt: skip

    def ours() -> Answer:
        found = limb(surface, (0.0, 0.0), camera, np.linspace(0.0, 1.0, 9))
        across = [np.linalg.norm(s.at[:, : 2 if _is_ball(surface) else 1], axis=1) for s in found.strands]
        return Answer(float(np.concatenate(across).max()) if across else None, found.status)

    def reference() -> Reference:
        scale = mpf(_FOCAL) / 30
        lean = mp.tan(mpf(angle) * mp.pi / 180) / (400 / scale)
        return Reference.precise(scale * 2 / mp.sqrt(1 - (2 * lean) ** 2), 4.0)

    return Case("limb", name, "half width px", ours, reference)


def _is_ball(surface: Surface) -> bool:
    return isinstance(surface, Sphere) or (isinstance(surface, Quadric) and surface.form[0, 0] != 0)


def _refused(name: str, surface: Surface, status: str) -> Case:
    """An eye 30 over the origin that sees no limb."""
    camera = Camera(width=640, height=480, focal_px=_FOCAL, distance=30.0)

    def ours() -> Answer:
        found = limb(surface, (0.0, 0.0), camera)
        return Answer(None if not found.strands else float(found.strands[0].at[0, 0]), found.status)

    return Case("limb", name, "status", ours, lambda: Reference(None, "rule", reason=status))
