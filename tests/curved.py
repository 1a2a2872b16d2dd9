"""Surfaces of every kind for tests, and the same surfaces with one number changed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from scenes.parts.surfaces import Cone, Cylinder, Plane, Quadric, Sphere, Surface, Torus, axes_beside

AXIS = (0.3, -0.5, 0.8)
SURFACES: dict[str, Surface] = {
    "plane": Plane((1, 2, 3), AXIS),
    "cylinder": Cylinder((1, -2, 0.5), AXIS, 1.5, (-2, 3)),
    "cone": Cone((1, -2, 0.5), AXIS, 1.5, (-2, 3), half_angle_deg=12.0),
    "narrowing cone": Cone((1, -2, 0.5), AXIS, 1.5, (-2, 3), half_angle_deg=-25.0),
    "sphere": Sphere((1, -2, 0.5), 1.5),
    "torus": Torus((1, -2, 0.5), AXIS, 2.5, 0.7),
    "ellipsoid": Quadric([[1, 0.2, 0], [0.2, 2, -0.1], [0, -0.1, 0.7]], (0.3, -0.2, 0.1), -3.0),
    "one sheet": Quadric(np.diag([1.0, 1.5, -0.5]), (0, 0, 0), -1.0),
    "paraboloid": Quadric(np.diag([1.0, 0.5, 0.0]), (0, 0, 1.0), -2.0),
    "hollow cylinder": Cylinder((1, -2, 0.5), AXIS, 1.5, (-2, 3), hollow=True),
    "hollow cone": Cone((1, -2, 0.5), AXIS, 1.5, (-2, 3), hollow=True, half_angle_deg=12.0),
    "hollow sphere": Sphere((1, -2, 0.5), 1.5, hollow=True),
    "hollow torus": Torus((1, -2, 0.5), AXIS, 2.5, 0.7, hollow=True),
    "hollow quadric": Quadric(np.diag([1.0, 1.5, 0.5]), (0, 0.1, 0), -1.0, hollow=True),
}


def on(surface: Surface, rng: np.random.Generator, count: int) -> np.ndarray:
    """Points of a surface, where random lines through its neighbourhood meet it, shape (about count, 3)."""
    starts, ways = rng.normal(0, 2, (4 * count, 3)), rng.normal(size=(4 * count, 3))
    t = surface.intersections(starts, ways)
    lines, which = np.nonzero(np.isfinite(t))
    return (starts[lines] + t[lines, which][:, None] * ways[lines])[:count]


def tangents(normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Random unit tangents."""
    way = rng.normal(size=normals.shape)
    way -= (way * normals).sum(-1, keepdims=True) * normals
    return way / np.linalg.norm(way, axis=-1, keepdims=True)


def changed(surface: Surface, name: str, by: float) -> Surface:
    """The same surface with one parameter changed."""
    if isinstance(surface, Quadric):
        return _changed_quadric(surface, name, by)
    place = next(key for key in ("point", "centre") if hasattr(surface, key))
    if name in ("x", "y", "z"):
        return replace(surface, **{place: getattr(surface, place) + by * np.eye(3)["xyz".index(name)]})
    if name == "height":
        return replace(surface, point=surface.point + by * surface.normal)
    if name.startswith("tilt"):
        key = "normal" if isinstance(surface, Plane) else "axis"
        axis = getattr(surface, key)
        turned = math.cos(by) * axis + math.sin(by) * axes_beside(axis)[int(name[-1]) - 1]
        return replace(surface, **{key: turned})
    if name == "half_angle":
        return replace(surface, half_angle_deg=surface.half_angle_deg + math.degrees(by))
    return replace(surface, **{name: getattr(surface, name) + by})


def _changed_quadric(surface: Quadric, name: str, by: float) -> Quadric:
    form, linear, constant = surface.form.copy(), surface.linear.copy(), surface.constant
    if name == "one":
        constant += by
    elif len(name) == 1:
        linear["xyz".index(name)] += by
    else:
        i, j = ("xyz".index(letter) for letter in name)
        form[i, j] += by / 2
        form[j, i] += by / 2
    return Quadric(form, linear, constant, surface.hollow)


def area_points(surface: Surface, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Points (..., 3) of a surface of finite size, evenly by area as u, v (...) cover the unit square."""
    of = {Sphere: _on_sphere, Torus: _on_torus}.get(type(surface), _on_ruled)
    return of(surface, np.asarray(u, float), np.asarray(v, float))


def _on_sphere(one: Sphere, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    angle, height = 2 * np.pi * u, 2 * v - 1
    wide = np.sqrt(np.maximum(1 - height**2, 0.0))
    return one.centre + one.radius * np.stack([wide * np.cos(angle), wide * np.sin(angle), height], -1)


def _on_torus(one: Torus, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Around the tube by Kepler's equation."""
    wanted, ratio = 2 * np.pi * v, one.tube / one.radius
    over = wanted.copy()
    for _ in range(20):
        over = over - (over + ratio * np.sin(over) - wanted) / (1 + ratio * np.cos(over))
    across, beside = axes_beside(one.axis)
    angle = 2 * np.pi * u[..., None]
    radial = np.cos(angle) * across + np.sin(angle) * beside
    wide = one.radius + one.tube * np.cos(over)
    return one.centre + wide[..., None] * radial + (one.tube * np.sin(over))[..., None] * one.axis


def _on_ruled(one: Cylinder | Cone, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    low, high = one.ends
    start = one.radius + one.slope * low
    along = (high - low) * v
    if one.slope:
        end = one.radius + one.slope * high
        wide = np.sqrt(start**2 + v * (end - start) * (end + start))
        along = (wide - start) / one.slope
    across, beside = axes_beside(one.axis)
    angle = 2 * np.pi * u[..., None]
    radial = np.cos(angle) * across + np.sin(angle) * beside
    height = low + along
    return one.point + height[..., None] * one.axis + (one.radius + one.slope * height)[..., None] * radial
