"""Light in fine pixels as the image model has it, where pictures from one place are compared.

What lines of sight meet is the same whatever the light, and is looked for once: under another light only shadows are.
Light between faces, where patches tell it, has none of the noise of a difference of random rays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from imaging.geometry.lens import image_centre
from imaging.light.behind import Met, direct_light, met_at
from imaging.light.between import light_between
from imaging.light.emitters import is_point
from imaging.pictures import Pictures
from imaging.threads import each
from render.build import MANY_WAYS
from render.gathered import is_gathered
from scenes import Camera, Floor, Picture, Pose, Scene, Solid

_AT_ONCE = 1 << 14  # rays whose temporary arrays stay near to the processor
_GOLDEN = 0.618  # about: steps of a column of the lattice from one row to the next
_SHIFTS = np.array([0.7548776662466927, 0.5698402909980532])  # of one pixel to the next: they fill a square evenly


@dataclass(frozen=True)
class View:
    """What is seen in fine pixels.

    Attributes
    ----------
    bodies : Solid
    floor : Floor or None
    camera : Camera
    sensor : Pose
    supersample : int
        Fine pixels that divide a pixel, each way.
    start : tuple of int
        Row and column in the whole frame of an image's first fine pixel.
    width : int
        Fine pixels of a row of the image.
    """

    bodies: Solid
    floor: Floor | None
    camera: Camera
    sensor: Pose
    supersample: int
    start: tuple[int, int]
    width: int

    def met(self, pixels: np.ndarray, samples: int) -> Met:
        """By rays of fine pixels (n,), numbered row by row, so many of each; (n samples)."""
        parts = each(lambda part: self._met(pixels[part], samples), len(pixels), _AT_ONCE // samples)
        return Met(*map(np.concatenate, zip(*parts, strict=True)))

    def _met(self, pixels: np.ndarray, samples: int) -> Met:
        corners = np.stack(np.divmod(pixels, self.width), 1) + self.start
        places = (corners[:, None] + within(pixels, samples)).reshape(-1, 2)
        seen = places[:, ::-1] / self.supersample - 0.5
        image = seen - image_centre(self.camera)
        return met_at(self.bodies, self.floor, self.camera, np.array(list(self.sensor)), image)


def within(pixels: np.ndarray, samples: int) -> np.ndarray:
    """Where rays go through fine pixels with these numbers, (n, samples, 2), in parts of one.

    A lattice of rank 1 that is shifted from one to the next: rows and columns of a grid, the same in all, would put an
    edge along them half their distance off, 0.016 px of 8 rows of a quarter of a pixel.
    """
    order = np.arange(samples)
    turn = next(step for step in range(round(samples * _GOLDEN), samples + 2) if math.gcd(step, samples) == 1)
    lattice = (np.stack([order, turn * order], 1) + 0.5) / samples
    return (lattice + (pixels[:, None, None] + 1) * _SHIFTS) % 1.0


@dataclass(frozen=True, eq=False)
class Looked:
    """What rays of a view have met so far: by how many a pixel has, numbers of pixels in order and what theirs met."""

    view: View
    _known: dict[int, tuple[np.ndarray, Met]] = field(default_factory=dict)

    def met(self, pixels: np.ndarray, samples: int) -> Met:
        """As `View.met`, of numbers in order."""
        known = self._known.get(samples)
        if known is None:
            known = pixels, self.view.met(pixels, samples)
        new = np.setdiff1d(pixels, known[0], assume_unique=True)
        if new.size:
            met = zip(known[1], self.view.met(new, samples), strict=True)
            known = _sorted(np.append(known[0], new), Met(*map(np.concatenate, met)), samples)
        self._known[samples] = known
        if len(known[0]) == len(pixels):
            return known[1]
        return _some(known[1], np.searchsorted(known[0], pixels), samples)


def _sorted(pixels: np.ndarray, met: Met, samples: int) -> tuple[np.ndarray, Met]:
    """Fine pixels by their numbers, and what rays of each meet."""
    order = np.argsort(pixels)
    return pixels[order], _some(met, order, samples)


def _some(met: Met, which: np.ndarray, samples: int) -> Met:
    """What the rays of some fine pixels meet."""
    faces, points = met.faces.reshape(-1, samples), met.points.reshape(-1, samples, 3)
    return Met(faces.take(which, 0).ravel(), points.take(which, 0).reshape(-1, 3))


_looked = lru_cache(maxsize=1)(Looked)  # pictures that are compared follow each other


def forget() -> None:
    """Give back what rays have met: in the midst of large images it keeps memory from being used again, 0.4 GiB."""
    _looked.cache_clear()


def is_told(picture: Picture, active: frozenset[str]) -> bool:
    """Whether the image model has all light of some effects as a render has it: nothing of it is random."""
    return _is_bare(picture.scene) and active & MANY_WAYS <= {"interreflection"} and is_gathered(picture.scene)


def _is_bare(scene: Scene) -> bool:
    """Whether surfaces and lights are as a render has them, point by point."""
    round_or_printed = scene.solid.curved or scene.textures or scene.placement.board is not None
    return not round_or_printed and is_point(scene.lights)


@dataclass(frozen=True, eq=False)
class Modelled:
    """Light of one picture.

    Attributes
    ----------
    pictures : Pictures
        Of one, whose light is a point.
    view : View
    """

    pictures: Pictures
    view: View

    @classmethod
    def of(cls, picture: Picture, supersample: int, start: tuple[int, int], width: int) -> Modelled | None:
        """None where surfaces or a light of the model are not as a render has them, point by point."""
        scene = picture.scene
        if not _is_bare(scene):
            return None
        view = View(scene.bodies, scene.bright_floor, scene.camera, picture.sensor, supersample, start, width)
        return cls(Pictures.of(picture), view)

    @property
    def tells_between(self) -> bool:
        """Whether light that surfaces send to each other, too."""
        return is_gathered(self.pictures.scene)

    def between(self, marked: np.ndarray, samples: int) -> np.ndarray:
        """What surfaces send to each other in marked fine pixels, each the mean of so many rays, 0 elsewhere."""
        found = np.zeros(marked.shape)
        met = _looked(self.view).met(np.flatnonzero(marked), samples)
        light = each(lambda part: self._between(*(some[part] for some in met)), len(met.faces), _AT_ONCE)
        found[marked] = np.concatenate([np.zeros(0), *light]).reshape(-1, samples).mean(1)
        return found

    def _between(self, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
        found, some = np.zeros(faces.size), np.flatnonzero(faces >= 0)
        found[some] = light_between(self.pictures, points[some], faces[some], finely=True)
        return found

    def rendered(self, fine: np.ndarray, marked: np.ndarray, samples: int) -> np.ndarray:
        """The image itself, its marked fine pixels anew, each the mean of so many rays, a square number."""
        where = np.flatnonzero(marked)
        if not where.size:
            return fine
        faces, points = _looked(self.view).met(where, samples)
        light = each(lambda part: direct_light(self.pictures, Met(faces[part], points[part])), len(faces), _AT_ONCE)
        fine.flat[where] = np.concatenate(light).reshape(-1, samples).mean(1)
        return fine
