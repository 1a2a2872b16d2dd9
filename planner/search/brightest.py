"""How much contrast lights give to edges at most, whatever sensor looks: bounds from above, light by light.

On a plane matt face the signal at p is K / |l - p|^3, K the light's height over the face times its reflectance and
power, so along a piece of an edge it is largest at the nearest place and smallest at the farthest. What lies behind an
edge, where one of its faces is turned away, is no brighter than such a face or the floor is anywhere under that light,
nor darker than it is anywhere if all of it is lit (`lit`); else it may be dark.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from imaging.features.locator import MIN_CONTRAST
from imaging.geometry.visibility import hidden_spans, longest_span, turned
from imaging.light.behind import floor_material
from imaging.light.edge_sides import whites
from imaging.light.sheets import printed
from imaging.models.strong import ROUGH
from imaging.pictures import Pictures
from imaging.sensor import headroom, shot_noise
from planner.search.grid import by_light
from planner.search.lit import all_lit
from scenes import Edge, Noise, Scene, Solid

PIECES = 16  # of an edge, each with a bound of its own
_BEYOND = 1e20  # squared contrast over noise that none has, where nothing is known


class Look(NamedTuple):
    """What a sensor sees beside an edge.

    Attributes
    ----------
    side : int or None
        Which of the edge's faces is seen alone; None where both are.
    behind : tuple of int
        What may be seen past the other one (`things_behind`); -1 for darkness.
    """

    side: int | None = None
    behind: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Brightest:
    """Bounds for L lights and an edge that is looked at in K ways.

    Attributes
    ----------
    ratio : ndarray, shape (K, L, PIECES + 1)
        The most squared contrast over the noise's variance in each piece, and last in the whole edge. 0 where there is
        so little of it that no sensor can measure the edge; far more than there can be where nothing is known: a shadow
        may leave a part of the edge only, or the end of the scale cut levels off.
    uneven : ndarray, shape (K, L)
        How many times the least of an edge the most can be where the variance is not taken to first order (`ROUGH`).
    """

    ratio: np.ndarray
    uneven: np.ndarray


def brightest(scene: Scene, looks: dict[str, list[Look]], lights: np.ndarray) -> list[Brightest]:
    """For each edge, of which looks are given by its name, under lights (L, 2 F), degrees."""
    pictures = Pictures.of(scene, np.zeros(2), by_light(lights) if lights.shape[1] else ()).glanced
    standing = [np.broadcast_to(at, (len(lights), 3)) for at in pictures.lights_at]
    shining = [_Shining(np.broadcast_to(each.at, (len(lights), 3)), each.power) for each in pictures.emitters]
    things = {thing for ways in looks.values() for look in ways for thing in look.behind}
    shown = [_Shown.of(scene, each, things) for each in shining]
    fewest = shown[0].least if len(scene.lights) == 1 else np.zeros_like(shown[0].least)
    beyond = _Shown(sum(each.most for each in shown), fewest)
    edges = [(scene.solid.edge(name), ways) for name, ways in looks.items()]
    shadows = [_shadows(scene.bodies, edge, standing) for edge, _ in edges]
    return [
        _of_edge(scene, ways, _Sides.of(scene, edge, shining), beyond, *dark)
        for (edge, ways), dark in zip(edges, shadows, strict=True)
    ]


def is_bounded(scene: Scene) -> bool:
    """Whether all light comes from points that stand where they are put, onto matt faces without print."""
    points = all(light.is_point and light.mount in ("free", "fixed") for light in scene.lights)
    matt = scene.surfaces.is_diffuse and not printed(scene) and not scene.solid.curved
    return bool(points and matt and not scene.camera.is_dimmed and not scene.noise.excess)


class _Shining(NamedTuple):
    """A light's places (L, 3), scene units, and its power (`Emitter`)."""

    at: np.ndarray
    power: float


def _of_edge(
    scene: Scene, looks: list[Look], sides: _Sides, beyond: _Shown, shaded: np.ndarray, lost: np.ndarray
) -> Brightest:
    """Of one edge, and what may be behind it; ``shaded`` and ``lost`` (L,) say which lights leave some of it in shadow,
    and which all."""
    ratios, spreads = [], []
    for look in looks:
        highest, least, level = sides.contrast(scene, look, beyond)
        whole = highest.max(-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            spread = np.fmax(whole / least, 1.0)
        spread = np.minimum(spread, ROUGH) if scene.noise.gain == 0 else spread
        doubtful = level > headroom(scene.noise)
        faint = lost | (~doubtful & (whole < MIN_CONTRAST**2))
        unknown = shaded | doubtful | ~np.isfinite(spread)
        ratio = np.concatenate([highest, whole[:, None]], -1)
        ratios.append(np.where(faint[:, None], 0.0, np.where(unknown[:, None], _BEYOND, ratio)))
        spreads.append(np.where(unknown, 1.0, spread))
    return Brightest(np.array(ratios, np.float32), np.array(spreads, np.float32))


class _Sides(NamedTuple):
    """Signals on both sides of an edge: the most and the least in each piece (L, 2, PIECES), the largest contrast of
    both faces at the nearest and at the farthest places (L, PIECES), and whether there is one light."""

    most: np.ndarray
    least: np.ndarray
    near: np.ndarray
    far: np.ndarray
    alone: bool

    @classmethod
    def of(cls, scene: Scene, edge: Edge, shining: list[_Shining]) -> _Sides:
        strengths = [_strengths(scene, edge, each) for each in shining]
        cubes = zip(*(_cubes(scene.solid, edge, each.at) for each in shining), strict=True)
        signals = [[k[:, :, None] / cube[:, None] for k, cube in zip(strengths, part, strict=True)] for part in cubes]
        alone = len(scene.lights) == 1
        return cls(*(sum(part) for part in signals), *(_step(part) for part in signals), alone)

    def contrast(self, scene: Scene, look: Look, beyond: _Shown) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Squared contrast over noise, the most in each piece (L, PIECES) and the least of all (L,), and the highest
        level (L,). Of several lights some may leave a place in shadow, of which nothing is known but the most."""
        noise = scene.noise
        if look.side is None:
            sums = (self.most.sum(1), self.least.sum(1)) if self.alone else (self.near, self.far)
            high, low = (_over_noise(noise, *each) for each in zip((self.near, self.far), sums, strict=True))
            return high, low.min(-1) * self.alone, self.most.max((-1, -2))
        own = self.most[:, look.side], self.least[:, look.side] * self.alone
        other = beyond.most[:, list(look.behind)].max(-1), beyond.least[:, list(look.behind)].min(-1)
        most, least = _before(noise, *own, *(part[:, None] for part in other))
        return most, least.min(-1), np.maximum(own[0].max(-1), other[0])


class _Shown(NamedTuple):
    """The highest and the lowest signals (L, F + 2) of each face of the bodies, of the floor, and of darkness."""

    most: np.ndarray
    least: np.ndarray

    @classmethod
    def of(cls, scene: Scene, shining: _Shining, things: set[int]) -> _Shown:
        """Of all of them the highest, of some ``things`` the lowest; where a place may be in shadow it is 0."""
        bodies, at, white = scene.bodies, shining.at, whites(scene)
        middles, radii = _spheres(bodies)
        away = np.linalg.norm(at[:, None] - middles, axis=-1)
        height = np.maximum(at @ bodies.normals.T - bodies.offsets, 0.0)
        nearest = np.maximum(away - radii, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            most = np.where(bodies.plane, height / np.maximum(nearest, height) ** 3, 1 / nearest**2) * white
        most = np.concatenate([np.where(np.isnan(most), 0.0, most), _of_floor(scene, at[:, 2])[:, None]], -1)
        least = np.zeros((len(at), len(white) + 2))
        for face in (thing for thing in things if 0 <= thing < len(white) and bodies.plane[thing]):
            farthest = away[:, face] + radii[face]
            least[:, face] = np.where(all_lit(bodies, face, at), white[face] * height[:, face] / farthest**3, 0.0)
        return cls(shining.power * np.pad(most, ((0, 0), (0, 1))), shining.power * least)


def _step(each: list[np.ndarray]) -> np.ndarray:
    """The largest contrast of both faces, (L, PIECES), of signals (L, 2, PIECES) by lights of which some may be off."""
    steps = [signal[:, 0] - signal[:, 1] for signal in each]
    return np.maximum(sum(np.maximum(step, 0.0) for step in steps), sum(np.maximum(-step, 0.0) for step in steps))


def _strengths(scene: Scene, edge: Edge, shining: _Shining) -> np.ndarray:
    """K of both faces, (L, 2)."""
    faces, bodies = list(edge.faces), scene.bodies
    height = shining.at @ bodies.normals[faces].T - bodies.offsets[faces]
    return np.where(turned(bodies, edge, shining.at), height * whites(scene)[faces] * shining.power, 0.0)


def _before(
    noise: Noise, high: np.ndarray, low: np.ndarray, most: np.ndarray, least: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The most and the least squared contrast over noise of what has signals from ``low`` to ``high`` before what has
    ``least`` to ``most``."""
    over = _over_noise(noise, np.maximum(high - least, 0.0), high + least)
    under = _over_noise(noise, np.maximum(most - low, 0.0), most + low)
    apart = np.maximum(low - most, 0.0), np.maximum(least - high, 0.0)
    nearest = np.maximum(
        _over_noise(noise, apart[0], low + most), _over_noise(noise, apart[1], least + high)
    )  # one of them is 0
    return np.maximum(over, under), nearest


def _over_noise(noise: Noise, step: np.ndarray, total: np.ndarray) -> np.ndarray:
    """Squared contrast over the noise's variance, of a contrast and the sum of both sides' signals."""
    return step**2 / (noise.variance + shot_noise(noise, total / 2))


def _cubes(solid: Solid, edge: Edge, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cubes of the least and the largest distance of lights from pieces of an edge, scene units^3, (L, PIECES)."""
    start, stop = solid.vertices[list(edge.ends)]
    along, borders = stop - start, np.linspace(0, 1, PIECES + 1)
    foot = (at - start) @ along / (along @ along)
    aside2 = np.square(at - start - foot[:, None] * along).sum(-1)
    away = borders - foot[:, None]
    ends = np.stack([away[:, :-1], away[:, 1:]])
    over = (ends[0] < 0) & (ends[1] > 0)
    nearest = np.where(over, 0.0, np.abs(ends).min(0))
    return tuple((aside2[:, None] + each**2 * (along @ along)) ** 1.5 for each in (nearest, np.abs(ends).max(0)))


def _shadows(bodies: Solid, edge: Edge, lights_at: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Which lights leave a part of the edge in shadow, and whether a lone one leaves all of it, bool (L,)."""
    shaded = np.zeros(len(lights_at[0]), bool)
    for at in lights_at:
        spans = hidden_spans(bodies, edge, at)
        shaded |= (spans[..., 0] < spans[..., 1]).any(-1)
    if len(lights_at) > 1:
        return shaded, np.zeros_like(shaded)
    return shaded, (longest_span(bodies, edge, lights_at[0]) == 0).all(-1)


def _of_floor(scene: Scene, height: np.ndarray) -> np.ndarray:
    """The highest signal (L,) of the floor under lights of unit power so high (L,); 0 without one."""
    if scene.bright_floor is None:
        return np.zeros(len(height))
    white = scene.camera.exposure * floor_material(scene.floor).diffuse(scene.camera.analyser_deg is not None)
    over = np.maximum(height - scene.floor.height, 0.0)
    return np.where(over > 0, white / np.where(over > 0, over, 1.0) ** 2, 0.0)


@lru_cache(maxsize=8)
def _spheres(bodies: Solid) -> tuple[np.ndarray, np.ndarray]:
    """Middles (F, 3) and radii (F,) of spheres that hold the faces."""
    middles, radii = np.empty((len(bodies.faces), 3)), np.empty(len(bodies.faces))
    for face in range(len(bodies.faces)):
        corners = bodies.triangles[bodies.triangle_faces == face].reshape(-1, 3)
        middles[face] = (corners.min(0) + corners.max(0)) / 2
        radii[face] = np.linalg.norm(corners - middles[face], axis=1).max()
    return middles, radii
