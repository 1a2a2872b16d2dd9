"""How much contrast lights give to edges at most, whatever sensor looks: bounds from above, light by light.

On a plane matt face the signal at p is K / |l - p|^3, K the light's height over the face times its reflectance and
power, so along a piece of an edge it is largest at the nearest place and smallest at the farthest. What lies behind an
edge, where one of its faces is turned away, is no brighter than such a face or the floor is anywhere under that light,
nor darker than it is anywhere if all of it is lit (`lit`); else it may be dark. A glossy face is brighter by no more
than its lobe can be for sensors near each other (`lobes`), and no darker than without it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from imaging.features.locator import MIN_CONTRAST
from imaging.geometry.visibility import hidden_spans, longest_span, turned
from imaging.light.appearance import floor_material, is_separable
from imaging.light.edge_sides import whites
from imaging.light.sheets import printed
from imaging.models.strong import ROUGH
from imaging.pictures import Pictures
from imaging.sensor import headroom, shot_noise
from planner.search.grid import by_light
from planner.search.lit import all_lit
from planner.search.lobes import Around, Lobes, Shining
from scenes import Edge, Noise, Scene, Solid
from scenes.materials.vectors import length

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
class Lit:
    """What L lights do to edges, whichever sensor looks.

    Attributes
    ----------
    scene : Scene
    shining : list of Shining
    edges : list of tuple
        Each with the ways in which it is looked at.
    sides : list of _Sides
    dark : list of tuple of ndarray of bool, shape (L,)
        Which lights leave some of each edge in shadow, and which all.
    beyond : _Shown
        Of what may be seen past edges.
    """

    scene: Scene
    shining: list[Shining]
    edges: list[tuple[Edge, list[Look]]]
    sides: list[_Sides]
    dark: list[tuple[np.ndarray, np.ndarray]]
    beyond: _Shown

    @classmethod
    def of(cls, scene: Scene, looks: dict[str, list[Look]], lights: np.ndarray) -> Lit:
        """For each edge, of which looks are given by its name, under lights (L, 2 F), degrees."""
        pictures = Pictures.of(scene, np.zeros(2), by_light(lights) if lights.shape[1] else ()).glanced
        standing = [np.broadcast_to(at, (len(lights), 3)) for at in pictures.lights_at]
        shining = [
            Shining(each.light, np.broadcast_to(each.at, (len(lights), 3)), each.power) for each in pictures.emitters
        ]
        things = {thing for ways in looks.values() for look in ways for thing in look.behind}
        shown = [_Shown.of(scene, each, things) for each in shining]
        fewest = shown[0].least if len(scene.lights) == 1 else np.zeros_like(shown[0].least)
        edges = [(scene.solid.edge(name), ways) for name, ways in looks.items()]
        return cls(
            scene=scene,
            shining=shining,
            edges=edges,
            sides=[_Sides.of(scene, edge, shining) for edge, _ in edges],
            dark=[_shadows(scene.bodies, edge, standing) for edge, _ in edges],
            beyond=_Shown(sum(each.most for each in shown), fewest),
        )

    def __len__(self) -> int:
        return len(self.shining[0].at)

    def some(self, lights: np.ndarray) -> Lit:
        """Some of the lights alone."""
        return replace(
            self,
            shining=[each._replace(at=each.at[lights]) for each in self.shining],
            sides=[each.some(lights) for each in self.sides],
            dark=[(some[lights], every[lights]) for some, every in self.dark],
            beyond=_Shown(self.beyond.most[lights], self.beyond.least[lights]),
        )

    @property
    def may_be_cut_off(self) -> bool:
        """Whether the end of the scale may cut off a level under any of the lights: of glossy faces nobody asks."""
        most = max(float(part.max(initial=0.0)) for part in (self.beyond.most, *(each.most for each in self.sides)))
        room = headroom(self.scene.noise)
        return bool(np.isfinite(room)) and (most > room or not self.scene.surfaces.is_diffuse)


@dataclass(frozen=True, eq=False)
class Brightest:
    """Bounds for lights and edges that some sensors look at.

    Attributes
    ----------
    lit : Lit
    lobes : Lobes
        Of those sensors.
    within_scale : bool
        Whether they hold only where no level is cut off at the end of the scale.
    pieces : int
        Of an edge, in which its lobes are bounded.
    """

    lit: Lit
    lobes: Lobes
    within_scale: bool = False
    pieces: int = PIECES
    _known: dict[tuple[int, int], tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    def of(self, e: int, way: int) -> tuple[np.ndarray, np.ndarray]:
        """Of the e-th edge, in one of the ways in which it is looked at.

        Returns
        -------
        ratio : ndarray, shape (L, PIECES + 1)
            The most squared contrast over the noise's variance in each piece, and last in the whole edge. 0 where there
            is so little of it that no sensor can measure the edge; far more than there can be where nothing is known: a
            shadow may leave a part of the edge only, or the end of the scale cut levels off.
        uneven : ndarray, shape (L,)
            How many times the least of an edge the most can be where the variance is not taken to first order
            (`ROUGH`).
        """
        if (e, way) not in self._known:
            self._known[e, way] = self._of(e, way)
        return self._known[e, way]

    def _of(self, e: int, way: int) -> tuple[np.ndarray, np.ndarray]:
        scene, (edge, looks), (shaded, lost) = self.lit.scene, self.lit.edges[e], self.lit.dark[e]
        room = headroom(scene.noise)
        gloss, past = self._gloss(edge), self._past(looks[way])
        most = room if self.within_scale else np.inf
        highest, least, level = self.lit.sides[e].contrast(scene, looks[way], self.lit.beyond, gloss, past, most)
        whole = highest.max(-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            spread = np.fmax(whole / least, 1.0)
        if not is_separable(scene):  # else all is taken to second order
            noise = scene.noise
            spread = np.minimum(spread, ROUGH * (1 + shot_noise(noise, np.minimum(level, room)) / noise.variance))
        doubtful = ~(level <= room) & (not self.within_scale)
        faint = lost | (~doubtful & (whole < MIN_CONTRAST**2))
        unknown = shaded | doubtful | ~np.isfinite(spread)
        ratio = np.concatenate([highest, whole[:, None]], -1)
        ratio = np.where(faint[:, None], 0.0, np.where(unknown[:, None], _BEYOND, ratio))
        return ratio.astype(np.float32), np.where(unknown, 1.0, spread).astype(np.float32)

    def _gloss(self, edge: Edge) -> tuple[np.ndarray, np.ndarray]:
        """The lowest and the highest signals of both faces' lobes in each piece, each (L, 2, PIECES)."""
        start, stop = self.lit.scene.solid.vertices[list(edge.ends)]
        count = self.pieces
        middles = start + (np.arange(count) + 0.5)[:, None] / count * (stop - start)
        where = Around(middles, np.full(count, length(stop - start) / (2 * count)))
        both = zip(*(self.lobes.of(face, where) for face in edge.faces), strict=True)
        least, most = (np.repeat(np.stack(np.broadcast_arrays(*each), 1), PIECES // count, -1) for each in both)
        return least, most

    def _past(self, look: Look) -> np.ndarray:
        """The highest signal of lobes seen past an edge, (L,) or (1,)."""
        middles, radii = _spheres(self.lit.scene.bodies)
        faces = [thing for thing in look.behind if 0 <= thing < len(radii)]
        parts = [self.lobes.of(face, Around(middles[[face]], radii[[face]]))[1][:, 0] for face in faces]
        return np.max(np.broadcast_arrays(np.zeros(1), *parts), 0)


def is_bounded(scene: Scene) -> bool:
    """Whether all light comes from points that stand where they are put, onto plane faces without print."""
    points = all(light.is_point and light.mount in ("free", "fixed") for light in scene.lights)
    plain = not printed(scene) and not scene.solid.curved
    return bool(points and plain and not scene.camera.is_dimmed and not scene.noise.excess)


class _Sides(NamedTuple):
    """Signals of both faces of an edge without their lobes: the most and the least in each piece (L, 2, PIECES), the
    least and the greatest difference of the first and the second (L, PIECES), and whether there is one light. Of
    several some may leave a place in shadow."""

    most: np.ndarray
    least: np.ndarray
    step: tuple[np.ndarray, np.ndarray]
    alone: bool

    @classmethod
    def of(cls, scene: Scene, edge: Edge, shining: list[Shining]) -> _Sides:
        strengths = [_strengths(scene, edge, each) for each in shining]
        cubes = zip(*(_cubes(scene.solid, edge, each.at) for each in shining), strict=True)
        near, far = ([k[:, :, None] / cube[:, None] for k, cube in zip(strengths, part, strict=True)] for part in cubes)
        most, alone = sum(near), len(scene.lights) == 1
        steps = [signal[:, 0] - signal[:, 1] for signal in (*near, *(far if alone else []))]
        if alone:
            return cls(most, far[0], (np.minimum(*steps), np.maximum(*steps)), alone)
        below, above = (sum(limit(step, 0.0) for step in steps) for limit in (np.minimum, np.maximum))
        return cls(most, np.zeros_like(most), (below, above), alone)

    def some(self, lights: np.ndarray) -> _Sides:
        """Of some lights."""
        below, above = self.step
        return _Sides(self.most[lights], self.least[lights], (below[lights], above[lights]), self.alone)

    def contrast(
        self, scene: Scene, look: Look, beyond: _Shown, gloss: tuple[np.ndarray, np.ndarray], past: np.ndarray,
        limit: float,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
        """Squared contrast over noise, the most in each piece (L, PIECES) and the least of all (L,), and the highest
        level (L,).

        Parameters
        ----------
        gloss : pair of ndarray, shape (L, 2, PIECES)
            The lowest and the highest signals that lobes add to both faces.
        past : ndarray, shape (L,)
            The highest that they add to what is seen past the edge.
        limit : float
            Signals above it are not asked about.
        """
        noise, least, level = scene.noise, self.least + gloss[0], self.most + gloss[1]
        if look.side is not None:
            other = beyond.most[:, list(look.behind)].max(-1) + past, beyond.least[:, list(look.behind)].min(-1)
            level = level[:, look.side]
            cut = (np.minimum(part, limit) for part in (level, least[:, look.side], *(p[:, None] for p in other)))
            most, fewest = _before(noise, *cut)
            return most, fewest.min(-1), np.maximum(level.max(-1), other[0])
        low, high = gloss[0], np.minimum(gloss[1], np.maximum(limit - self.least, 0.0))
        ways = [
            (self.step[1] + high[:, 0] - low[:, 1], high[:, 0] + low[:, 1]),
            (high[:, 1] - low[:, 0] - self.step[0], high[:, 1] + low[:, 0]),
        ]
        dark, ratios = self.least.sum(1), []
        for step, shine in ways:
            step = np.clip(step, 0, limit)
            ratios.append(_over_noise(noise, step, np.maximum(dark + shine, step)))
        apart = np.maximum(np.maximum(-ways[0][0], -ways[1][0]), 0.0)
        fewest = _over_noise(noise, apart, level.sum(1)).min(-1) * self.alone
        return np.maximum(*ratios), fewest, level.max((-1, -2))


class _Shown(NamedTuple):
    """The highest and the lowest signals (L, F + 2) of each face of the bodies, of the floor, and of darkness."""

    most: np.ndarray
    least: np.ndarray

    @classmethod
    def of(cls, scene: Scene, shining: Shining, things: set[int]) -> _Shown:
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


def _strengths(scene: Scene, edge: Edge, shining: Shining) -> np.ndarray:
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
