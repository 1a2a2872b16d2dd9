"""The planner's formulas at 50 digits, one point at a time, and their condition numbers: a reference by mpmath.

Nothing here is shared with the planner but the input: vertices, faces and edges of the object, poses, and settings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

from mpmath import MPContext

from scenes import Scene
from validation.hard.case import Reference

DIGITS = 50
mp = MPContext()  # a context of its own: nobody else's precision changes
mp.dps = DIGITS
mpf = mp.mpf
_STEP = 20  # digits: relative step of the derivatives
MIN_CONTRAST, MIN_USABLE, CLEARANCE, EDGE_ON = 5, 2, mpf("3.5"), mpf("1e-12")  # the planner's documented rules
FEWEST, SPACING = 9, 2  # edge points, and the smoothing scales between them: the same
STEP = mpf("0.5")  # px between places across an edge: the same


@dataclass(frozen=True)
class Inputs:
    """All numbers that a user or a file gives, which are therefore known to one rounding only."""

    sensor: tuple
    light: tuple
    distances: tuple
    vertices: tuple

    @classmethod
    def of(cls, scene: Scene, sensor, light) -> Inputs:
        """Exactly the floating-point numbers of a scene and a setting."""
        exact = [tuple(mpf(float(x)) for x in values) for values in (sensor, light)]
        distances = mpf(scene.camera.distance), mpf(scene.lights[0].distance)
        vertices = tuple(tuple(mpf(x) for x in row) for row in scene.solid.vertices.tolist())
        return cls(*exact, distances, vertices)

    def nudged(self) -> list[Inputs]:
        """The same with one number after the other relatively larger by 1e-20."""
        factor, found = 1 + mpf(10) ** -_STEP, []
        for name in ("sensor", "light", "distances"):
            values = getattr(self, name)
            found += [
                replace(self, **{name: values[:i] + (values[i] * factor,) + values[i + 1 :]})
                for i in range(len(values))
                if values[i]
            ]
        for v, row in enumerate(self.vertices):
            for i in range(3):
                if row[i]:
                    moved = row[:i] + (row[i] * factor,) + row[i + 1 :]
                    found.append(replace(self, vertices=self.vertices[:v] + (moved,) + self.vertices[v + 1 :]))
        return found


def condition(function: Callable[[Inputs], mpf | str], inputs: Inputs) -> float:
    """Sum over the inputs of |x df/dx| / |f|; infinite where a nudge of the inputs leaves no value."""
    value = function(inputs)
    moved = [function(other) for other in inputs.nudged()]
    if not value or any(isinstance(other, str) for other in (value, *moved)):
        return float("inf")
    return float(sum(abs(other / value - 1) for other in moved) * mpf(10) ** _STEP)


def condition_of(function: Callable[[list], mpf], numbers: list) -> float:
    """The same for a function of a list of numbers."""
    value, total = function(numbers), mpf(0)
    for i, number in enumerate(numbers):
        if number:
            moved = [*numbers[:i], number * (1 + mpf(10) ** -_STEP), *numbers[i + 1 :]]
            total += abs(function(moved) / value - 1)
    return float(total * mpf(10) ** _STEP)


def reference(function: Callable[[list], mpf], numbers: Iterable[float]) -> Reference:
    """The value of a function of exactly these floating-point numbers, and its condition."""
    exact = [mpf(float(x)) for x in numbers]
    return Reference.precise(function(exact), condition_of(function, exact))


def dot(a, b):
    return mp.fdot(zip(a, b, strict=True))


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    size = mp.sqrt(dot(a, a))
    return tuple(x / size for x in a)


@lru_cache(maxsize=64)
def axes(pose):
    """Away from the object, right and down of a sensor at a pose in degrees."""
    p, a = (mp.radians(angle) for angle in pose)  # ty: ignore[missing-attribute]
    out = (mp.sin(p) * mp.cos(a), mp.sin(p) * mp.sin(a), mp.cos(p))
    return out, (-mp.sin(a), mp.cos(a), mpf(0)), (mp.cos(p) * mp.cos(a), mp.cos(p) * mp.sin(a), -mp.sin(p))


def image_of(point, inputs: Inputs, focal):
    """Image of a point, px from the image's middle."""
    out, right, down = axes(inputs.sensor)
    depth = inputs.distances[0] - dot(point, out)
    return (focal * dot(point, right) / depth, focal * dot(point, down) / depth)


def place(pose, distance):
    return tuple(distance * x for x in axes(pose)[0])


def face_normal(vertices, face):
    """Outward normal of a plane face from the fan of its boundary."""
    first, total = vertices[face[0]], (mpf(0),) * 3
    for i in range(1, len(face) - 1):
        part = cross(minus(vertices[face[i]], first), minus(vertices[face[i + 1]], vertices[face[i]]))
        total = tuple(x + y for x, y in zip(total, part, strict=True))
    return unit(total)


def fresnel(cosine, n, k):
    """Mean Fresnel reflectance of unpolarised light at a surface of index n - ik, by the complex equations."""
    if n == 1 and k == 0:
        return mpf(0)
    index = mp.mpc(n, -k)
    inside = mp.sqrt(index**2 - (1 - cosine**2))
    across = (cosine - inside) / (cosine + inside)
    along = (index**2 * cosine - inside) / (index**2 * cosine + inside)
    return (abs(across) ** 2 + abs(along) ** 2) / 2


def brightness(material, normal, to_light, to_sensor):
    """The paper's reflectance times N.L (its eq. 1 and section 2), unit vectors; 0 where turned away."""
    nl, nv = dot(normal, to_light), dot(normal, to_sensor)
    if nl <= 0 or nv <= 0:
        return mpf(0)
    s = mpf(material.specular_fraction)
    diffuse = (1 - s) * mpf(material.diffuse_reflectance) * nl
    if material.is_diffuse:
        return diffuse
    half = unit(tuple(x + y for x, y in zip(to_light, to_sensor, strict=True)))
    nh, vh = dot(normal, half), dot(to_sensor, half)
    m = mpf(material.roughness)
    slopes = mp.exp(-(1 - nh**2) / (nh * m) ** 2) / (m**2 * nh**4)
    masking = min(mpf(1), 2 * nh * nv / vh, 2 * nh * nl / vh)
    # N.L K with K = D G / (pi N.L N.V)
    index = mpf(material.refractive_index), mpf(material.extinction)
    return diffuse + s * slopes * masking / (mp.pi * nv) * fresnel(vh, *index)


@dataclass(frozen=True)
class View:
    """The two positions and all faces' normals, of one setting."""

    eye: tuple
    lamp: tuple
    normals: tuple
    seen: tuple

    @classmethod
    def of(cls, scene: Scene, inputs: Inputs) -> View:
        eye, lamp = place(inputs.sensor, inputs.distances[0]), place(inputs.light, inputs.distances[1])
        normals = tuple(face_normal(inputs.vertices, face) for face in scene.solid.faces)
        seen = tuple(
            dot(n, minus(eye, inputs.vertices[face[0]])) > EDGE_ON * inputs.distances[0]
            for n, face in zip(normals, scene.solid.faces, strict=True)
        )
        return cls(eye, lamp, normals, seen)


def contrast(scene: Scene, view: View, faces, point, fall_off: bool):
    """Difference of the two faces' grey levels at a point of their edge on a convex solid (eq. 10), with its sign."""
    away = minus(view.lamp, point)
    distance2 = dot(away, away)
    to_light, to_sensor = unit(away), unit(minus(view.eye, point))
    levels = [
        brightness(scene.material, view.normals[f], to_light, to_sensor) if view.seen[f] else mpf(0) for f in faces
    ]
    difference = mpf(scene.camera.exposure) * (levels[0] - levels[1])
    return difference * mpf(scene.lights[0].distance) ** 2 / distance2 if fall_off else difference
