"""Rays of single fine pixels in a scalar variant of Mitsuba, which renders nothing but rectangles.

Small square tiles that hold the wanted pixels are looked at by a sensor each, all of them side by side on one film: a
call of the renderer takes as long as a thousand rays, making a sensor as long as some twenty: sensors of the next call
are made while rays are traced.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar

import numpy as np

from render.adaptive import MISSED, crossed, places
from render.gathered import Gathering
from render.sight import Sight

_SIDES = (1, 2, 4, 8, 16)  # of a tile, fine pixels: each twice the one before
_SENSOR = {"perspective": 20, "orthographic": 20, "thinlens": 200}  # rays that take as long as making a sensor
T = TypeVar("T")
Placed: TypeAlias = Callable[[int, int], list[Any]]  # a tile's row and column to transforms of sensors that look at it

_LUMINANCE = 0.212671, 0.715160, 0.072169  # of red, green and blue, as films of one colour have it

_AT_ONCE = 1024  # fine pixels along a film: single precision knows places on it to 1e-4 of one


@dataclass(frozen=True, eq=False)
class Tiles:
    """What single fine pixels are seen by.

    Attributes
    ----------
    mitsuba : module
        With a scalar variant set.
    scene : mitsuba.Scene
    view : dict
        Description of the sensor, its sampler among it.
    start : tuple of int
        Row and column in the sensor's whole frame of the first pixel of an image.
    sight : Sight, optional
        Of a telecentric camera.
    roughly : bool
        Whether its tiles may be large.
    gathering : Gathering, optional
        What adds to the image; the film of ``view`` has colours then.
    """

    mitsuba: Any
    scene: Any
    view: dict
    start: tuple[int, int]
    sight: Sight | None = None
    roughly: bool = False
    gathering: Gathering | None = None

    def refined(self, fine: np.ndarray, marked: np.ndarray, samples: int, seed: int) -> np.ndarray:
        """As `rendered`, and then those pixels again that turn out to be crossed as well."""
        first = self.rendered(fine, marked, samples, (seed, 0))
        missed = crossed(first, step=MISSED) & ~marked
        return self.rendered(first, missed, samples, (seed, 1))

    def rendered(self, fine: np.ndarray, marked: np.ndarray, samples: int, seed: tuple[int, int]) -> np.ndarray:
        """The image itself, its tiles that hold a marked fine pixel rendered again.

        Parameters
        ----------
        fine : ndarray
            The image as rendered so far, changed in place: that of a large camera is copied in a tenth of a second.
        marked : ndarray of bool
        samples : int
            Rays a fine pixel, a square number.
        seed : pair of int
            The same gives the same image, bit by bit, whatever the number of processor cores.
        """
        view = self.view
        lens, frame = view["type"] == "thinlens", np.array([view["film"]["height"], view["film"]["width"]])
        pupils, most = np.zeros((1, 2)), frame.min() if lens else max(_SIDES)
        if self.sight is not None:
            pupils, most = self.sight.pupils(samples), self.sight.widest(_SIDES, roughly=self.roughly)
        side = _side(marked, samples, _SENSOR[view["type"]] * len(pupils), most)
        corners, many = side * places(_held(marked, side)).T, max(_AT_ONCE // (side * len(pupils)), 1)
        if lens:  # its crop must lie in the frame
            corners = np.minimum(corners, frame - self.start - side)
        parts = [corners[first : first + many].tolist() for first in range(0, len(corners), many)]
        seeds = np.random.SeedSequence(seed).generate_state(len(parts)).tolist()
        sensors = (self._sensor(part, side, samples, pupils) for part in parts)
        strips = _meanwhile(self._strip, zip(sensors, seeds, strict=True))
        for part, strip in zip(parts, strips, strict=True):
            tiles = strip.reshape(side, len(part), len(pupils), side).mean(2)
            _put(fine, tiles.swapaxes(0, 1), np.array(part))
        return fine

    def _sensor(self, part: list[list[int]], side: int, samples: int, pupils: np.ndarray) -> Any:
        """What looks at tiles, at corners (row, column) of the image, side by side."""
        top, left = self.start
        placed = None if self.sight is None else self._placed(self.sight, pupils, side)
        corners = [(y + top, x + left) for y, x in part]
        return _side_by_side(self.mitsuba, self.view, corners, side, samples // len(pupils), placed)

    def _strip(self, sensor: Any, seed: int) -> np.ndarray:
        """The image of a film."""
        strip = _luminance(np.array(self.mitsuba.render(self.scene, sensor=sensor, seed=seed), float))
        return strip if self.gathering is None else strip + self.gathering.image(sensor, seed)

    def _placed(self, sight: Sight, pupils: np.ndarray, side: int) -> Placed:
        """Where each tile's sensors stand of a telecentric camera: one for each place on the aperture."""
        make = self.mitsuba.ScalarTransform4f
        return lambda y, x: [make(sight.to_world((x, y), (side, side), pupil)) for pupil in pupils]


def _meanwhile(made: Callable[..., T], given: Iterable[tuple[Any, ...]]) -> Iterator[T]:
    """What is made of each of what is given, in a thread of its own, while the next is found; never two at once."""
    with ThreadPoolExecutor(1) as beside:
        last = None
        for each in given:
            next_one = beside.submit(made, *each)
            if last is not None:
                yield last.result()
            last = next_one
        if last is not None:
            yield last.result()


def _luminance(film: np.ndarray) -> np.ndarray:
    """Image (height, width) of a film (height, width, 1 or 3)."""
    return film[:, :, 0] if film.shape[2] == 1 else film @ _LUMINANCE


def _put(fine: np.ndarray, tiles: np.ndarray, corners: np.ndarray) -> None:
    """Tiles (n, side, side) into the image, at corners (row, column) there (n, 2); what lies beside it is left out."""
    along = np.arange(tiles.shape[1])
    rows, columns = corners[:, :1] + along, corners[:, 1:] + along
    rows, columns = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    inside = (rows >= 0) & (rows < fine.shape[0]) & (columns >= 0) & (columns < fine.shape[1])
    fine[rows[inside], columns[inside]] = tiles[inside]


def _held(marked: np.ndarray, side: int) -> np.ndarray:
    """Which square tiles, of a side that is a power of two, hold a marked pixel.

    >>> _held(np.array([[0, 0, 1], [0, 0, 0]], bool), 2)
    array([[False,  True]])
    """
    while side > 1:
        marked, side = _halved(marked), side // 2
    return marked


def _halved(marked: np.ndarray) -> np.ndarray:
    """Which squares of two by two hold a marked pixel, by pairs of bytes: masks of large images are asked often."""
    padded = np.pad(marked, [(0, size % 2) for size in marked.shape])
    rows = padded[::2] | padded[1::2]
    return rows.view(np.uint16) != 0


def _side(marked: np.ndarray, samples: int, sensor: int, most: int) -> int:
    """Side, at most ``most``, of tiles that take the least time, where making a sensor takes as long as some rays."""
    held, taken = marked, {}
    for side in _SIDES:
        held = _halved(held) if side > 1 else held
        taken[side] = int(np.count_nonzero(held)) * (sensor + side * side * samples)
    return min((side for side in _SIDES if side <= most), key=taken.__getitem__)


def _side_by_side(
    mitsuba: Any, view: dict, corners: list[tuple[int, int]], side: int, samples: int, placed: Placed | None = None
) -> Any:
    """One sensor whose film holds the tiles of the whole frame at some corners (row, column) from left to right.

    Where ``placed`` says where several sensors look at a tile, their images stand beside each other.
    """
    make, frame = mitsuba.PluginManager.instance().create_object, view["film"]
    film = {key: value for key, value in frame.items() if not key.startswith("crop")}
    row = mitsuba.Properties("batch")
    views = [None for _ in corners] if placed is None else [way for corner in corners for way in placed(*corner)]
    row["film"] = mitsuba.load_dict({**film, "width": side * len(views), "height": side})
    row["sampler"] = mitsuba.load_dict({**view["sampler"], "sample_count": samples})
    one = mitsuba.Properties(view["type"])
    for key in view.keys() - {"type", "film", "sampler"}:
        one[key] = view[key]
    one["sampler"], one["film"] = row["sampler"], mitsuba.load_dict({**film, "width": side, "height": side})
    lens, sensors = view["type"] == "thinlens", []
    for i, way in enumerate(views if placed is not None else ()):
        one["to_world"] = way
        row[f"tile{i:04}"] = make(one)
    if placed is not None:
        return make(row)
    if not lens:
        one["fov"] = 2 * math.degrees(math.atan(math.tan(math.radians(view["fov"] / 2)) * side / frame["width"]))
    for i, (y, x) in enumerate(corners):
        if lens:
            one["film"] = mitsuba.load_dict(film)
        else:  # its whole film is the tile; offsets are in parts of the film
            one["principal_point_offset_x"] = (x - frame["width"] / 2) / side + 0.5
            one["principal_point_offset_y"] = (y - frame["height"] / 2) / side + 0.5
        sensors.append(make(one))
        row[f"tile{i:04}"] = sensors[-1]
    made = make(row)
    for sensor, corner in zip(sensors if lens else (), corners, strict=False):
        _crop(mitsuba, sensor, frame, corner, side)  # only now, for the row has given each film its own size
    return made


def _crop(mitsuba: Any, sensor: Any, frame: dict, corner: tuple[int, int], side: int) -> None:
    """Make a sensor see a tile of its frame, where its lens has an aperture: that kind has no principal point."""
    values = mitsuba.traverse(sensor.film())
    values["size"] = frame["width"], frame["height"]
    values.update()
    values["crop_offset"], values["crop_size"] = corner[::-1], (side, side)
    values.update()
    sensor.parameters_changed()
