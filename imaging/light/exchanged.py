"""Light that faces send to each other, by radiosity: of an inner edge, a step, a pocket, an obstacle, the floor.

What faces see of each other does not depend on lights (`imaging.light.exchange`): where rays from a patch end the
lights' own light is asked for, and patches exchange it. What arrives on a face is gathered when it is asked for, by
rays from nodes of it: what they meet sends its share of the light that falls there, and of what its patch has from the
others. What walls of round through holes have from themselves has a closed form (`imaging.light.bore`), but others see
them as they see all faces.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from imaging.geometry.rays import first_face
from imaging.light.annulus import Annulus, measured_rims
from imaging.light.appearance import floor_material
from imaging.light.emitters import Emitter
from imaging.light.exchange import AT_ONCE, LIFT, MARGIN, NOT_TOLD, Exchange, Hits, Sheet, exchange_of, sheets
from imaging.light.irradiance import beam
from imaging.light.kept import kept
from imaging.light.nodes import Frame
from imaging.light.places import in_unit_square, middles_of, shifts, ways_about
from imaging.light.walls import Wall
from imaging.threads import each
from scenes import Scene, Solid
from scenes.parts.shading import normals_at

if TYPE_CHECKING:
    from scipy.interpolate import RectBivariateSpline

_FROM_PIECE = 32  # rays of a place that sends light on
_BOUNCES, _LEFT = 200, 1e-9  # at most, and part of the light that is left after the last one
_ROUGH_PATCHES = 4  # about a small face, whose light is then a mean of theirs
_REFLECTED = 128  # rays of a place that is asked what lit faces it sees
_TOGETHER = 16  # faces


@dataclass(frozen=True, eq=False)
class Exchanged:
    """Light that faces have from each other under given lights, irradiance in units of the signal of a white face.

    Attributes
    ----------
    scene : Scene
    emitters : tuple of Emitter
    exchange : Exchange
    arriving : ndarray, shape (p,)
        At the patches, from each other.
    """

    scene: Scene
    emitters: tuple[Emitter, ...]
    exchange: Exchange
    arriving: np.ndarray

    def at(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """What arrives at points (..., 3) on faces (...)."""
        found, small = np.zeros(faces.shape), self.exchange.small
        places = points.reshape(-1, 3)
        asked = list(self._asked(places, faces.ravel()))
        for told, (_, here, share) in zip(_told(self, [number for number, *_ in asked]), asked, strict=True):
            found.reshape(-1)[here] += share * told.at(places.take(here, 0))
        some = small[faces] & self.exchange.has[faces]
        if some.any():
            found[some] = self._by_patches[faces[some]]
        return found

    def _asked(self, points: np.ndarray, faces: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
        """Which annuli and faces tell the light at points (n, 3) on faces (n,): number, where, how much of it."""
        exchange, left = self.exchange, np.ones(len(points))
        for number, annulus in exchange.annuli.items():
            here = np.flatnonzero(faces == annulus.circle.face)
            share = np.minimum(annulus.share(points.take(here, 0)), left[here])
            here, share = here[share > 0], share[share > 0]
            left[here] -= share
            if here.size:
                yield number, here, share
        for face, here in _numbered(exchange.told_as(faces)):
            here = here[left[here] > 0]
            if here.size and face != NOT_TOLD:
                yield face, here, left[here]

    @cached_property
    def fine(self) -> Exchanged:
        """The same told at more nodes of plane faces: where shadows end on what they see, it changes within a cell."""
        return replace(self, exchange=self.exchange.fine)

    @cached_property
    def _by_patches(self) -> np.ndarray:
        """What arrives in the middles of all faces, (F,): a mean of what does at the patches about them."""
        solid, exchange = self.exchange.solid, self.exchange
        middles = middles_of(solid)
        away, near = exchange.nearest(middles, solid.normals, _ROUGH_PATCHES)
        weights = np.exp(-2 * (away**2 - away[:, :1] ** 2))
        return (weights * self.arriving[near]).sum(1) / weights.sum(1)

    def sent_at(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """What points (n, 3) within faces (n,) send on of what arrives there."""
        exchange, found, some = self.exchange, np.zeros(len(points)), np.flatnonzero(self.exchange.has[faces])
        shifted, size = shifts(len(some)), AT_ONCE // _FROM_PIECE  # in blocks, which bounds the memory
        for at in range(0, len(some), size):
            here = some[at : at + size]
            normals = normals_at(exchange.solid, faces[here], points[here])
            met = exchange.met(points[here], normals, _FROM_PIECE, shifted[at : at + size])
            found[here] = white_of(self.scene, faces[here]) * self.gathered(met, len(here), _FROM_PIECE)
        return found

    def gathered(self, met: Hits, count: int, rays: int | np.ndarray) -> np.ndarray:
        """What arrives at ``count`` points from what so many rays, int or (count,), from each of them met.

        Of several emitters each is asked for every so manieth ray.
        """
        direct = _direct(self.scene, self.emitters, self.exchange.solid, met)
        sent = white_of(self.scene, met.faces) * (direct + self.arriving[met.patches])
        return np.bincount(met.starts, sent, count) / rays


def _numbered(numbers: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """Each of the numbers (n,) and where it stands, in rising order."""
    order = np.argsort(numbers, kind="stable")
    starts = np.flatnonzero(np.append(numbers.size > 0, np.diff(numbers[order])))
    for here in np.split(order, starts[1:]):
        if here.size:
            yield int(numbers[here[0]]), here


@dataclass(frozen=True, eq=False)
class Told:
    """What arrives on a face, by places in the rectangle about it, or beside a rim."""

    frame: Frame | Annulus | Wall
    values: RectBivariateSpline

    def at(self, points: np.ndarray) -> np.ndarray:
        """At points (n, 3) of the face."""
        return self.values.ev(*self.frame.coordinates(points).T)


@kept(most=2048)
def _told(light: Exchanged, faces: list[int]) -> Iterator[Told]:
    """What arrives on faces."""
    for at in range(0, len(faces), _TOGETHER):
        found = sheets(light.exchange, faces[at : at + _TOGETHER])
        counts = np.array([sheet.u.size * sheet.v.size for sheet in found])
        met = Hits(*map(np.concatenate, zip(*(sheet.met for sheet in found), strict=True)))
        first = np.repeat(np.cumsum(counts) - counts, [len(sheet.met.starts) for sheet in found])
        rays = np.repeat([sheet.rays for sheet in found], counts)
        values = light.gathered(met._replace(starts=met.starts + first), counts.sum(), rays)
        yield from map(_spline, found, np.split(values, np.cumsum(counts)[:-1]))


def _spline(sheet: Sheet, values: np.ndarray) -> Told:
    """Of values (n,) at the nodes of a face."""
    from scipy.interpolate import RectBivariateSpline  # slow to load, and rarely needed

    places, values = [sheet.u, sheet.v], values.reshape(sheet.u.size, sheet.v.size)
    if sheet.frame.closed:
        places[0], values = np.arange(-3, sheet.u.size + 3), np.pad(values, ((3, 3), (0, 0)), "wrap")
    for axis, (size, count) in enumerate(zip(sheet.frame.size, values.shape, strict=True)):
        if count == 1:
            places[axis], values = np.array([0.0, size]), np.repeat(values, 2, axis)
    along, across = (min(3, n - 1) for n in values.shape)
    return Told(sheet.frame, RectBivariateSpline(*places, values, kx=along, ky=across))


@lru_cache(maxsize=32)  # a picture, and as many with an input moved
def exchanged(
    scene: Scene, emitters: tuple[Emitter, ...], roughly: bool = False, without: tuple[int, ...] = ()
) -> Exchanged | None:
    """What the faces of a scene's bodies and its floor send to each other under some emitters, some left out."""
    rims = () if roughly else measured_rims(scene)
    exchange = exchange_of(scene.bodies, scene.bright_floor, roughly, rims, without)
    if exchange is None:
        return None
    met = exchange.seen
    several = met._replace(rays=np.arange(len(met.rays)))  # of few rays from a place no emitter is asked for none
    lit = white_of(scene, met.faces) * _direct(scene, emitters, exchange.solid, several)
    whites = exchange.of_patches(white_of(scene, exchange.places.faces))
    once = exchange.of_patches(np.bincount(met.starts, lit, len(exchange.patches)) / exchange.rays)
    arriving = more = once
    for _ in range(_BOUNCES):
        more = exchange.between @ (whites * more)
        arriving = arriving + more
        if more.max() <= _LEFT * arriving.max():
            break
    return Exchanged(scene, emitters, exchange, arriving)


def once_reflected(
    scene: Scene, emitters: tuple[Emitter, ...], points: np.ndarray, normals: np.ndarray, own: tuple[int, ...]
) -> np.ndarray:
    """Irradiance of points (n, 3) of unit normals by light that met one other face of the bodies, (n,).

    Each sees others by other rays; facets ``own`` of the surface that the points lie on are none.
    """
    bodies = scene.bodies
    ways = ways_about(normals, (in_unit_square(_REFLECTED) + shifts(len(points))[:, None]) % 1.0)
    starts = np.broadcast_to((points + LIFT * bodies.extent * normals)[:, None], ways.shape)
    face, t = first_face(bodies, starts, ways, own)
    point, ray = np.nonzero(face >= 0)
    met, faces = starts[point, ray] + t[point, ray, None] * ways[point, ray], face[point, ray]
    lit = sum(_arriving(scene, emitter, met, normals_at(bodies, faces, met)) for emitter in emitters)
    return np.bincount(point, white_of(scene, faces) * lit, len(points)) / _REFLECTED


def white_of(scene: Scene, faces: np.ndarray, *, analysed: bool = False) -> np.ndarray:
    """Diffuse reflectance of faces (...), the floor's number after the last of the bodies'; before an analyser half of
    it."""
    floor = scene.bright_floor
    materials = *scene.surfaces.materials, *(() if floor is None else (floor_material(floor),))
    white = np.array([material.diffuse(analysed) for material in materials] + [0.0])
    return white[np.append(scene.surfaces.kinds, len(scene.surfaces.materials))][faces]


def _direct(scene: Scene, emitters: tuple[Emitter, ...], solid: Solid, met: Hits) -> np.ndarray:
    """Irradiance from emitters where rays end, (k,); of several each is asked for every so manieth ray."""

    def of(part: slice) -> np.ndarray:
        return _direct_of_few(scene, emitters, solid, Hits(*(values[part] for values in met)))

    return np.concatenate([np.zeros(0), *each(of, len(met.points), AT_ONCE)])  # in blocks, which bounds the memory


def _direct_of_few(scene: Scene, emitters: tuple[Emitter, ...], solid: Solid, met: Hits) -> np.ndarray:
    found, several = np.zeros(len(met.points)), len(emitters)
    for k, emitter in enumerate(emitters):
        asked = met.rays % several == k
        normals = normals_at(solid, met.faces[asked], met.points[asked])
        found[asked] = several * _arriving(scene, emitter, met.points[asked], normals)
    return found


def _arriving(scene: Scene, emitter: Emitter, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Irradiance of points (n, 3) of unit normals by one emitter, 0 in shadow."""
    arriving = beam(emitter, points)
    found = arriving.strength * np.maximum(np.einsum("ni,ni->n", arriving.to_light, normals), 0)
    turned = np.flatnonzero(found)
    start, at = points[turned] + LIFT * scene.bodies.extent * normals[turned], np.array(emitter.at)
    blocker, t = first_face(scene.bodies, np.broadcast_to(at, start.shape), start - at, (), margin=MARGIN)
    found[turned[(blocker >= 0) & (t < 1)]] = 0.0
    return found
