"""The sensor: noisy, perhaps digitised copies of a noise-free image."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.ndimage import binary_dilation

from imaging.colour import picture_of, picture_variance, raw, without_filters
from imaging.sensor import full_scale, shot_noise
from scenes import InvalidInput, Noise
from scenes.arrays import grey_levels, picture

TILE = 16  # px; large enough that making a tile's stream costs little, small enough to follow an edge


def expose(
    image: np.ndarray, noise: Noise, rng: np.random.Generator, count: int, where: np.ndarray | None = None
) -> np.ndarray:
    """Take ``count`` pictures of the same scene.

    The noise is drawn tile by tile, each tile from a stream of its own, so a pixel's noise does not depend on
    which other pixels are wanted: drawing only part of the image gives the numbers of the whole. Of a colour sensor the
    raw mosaic is drawn, digits and fixed pattern too, and the picture made of it.

    Parameters
    ----------
    image : ndarray, shape (height, width)
        Noise-free grey levels.
    noise : Noise
        Terms of the noise. Shot noise is drawn as the normal distribution that a Poisson one of more than about 20
        electrons is; the fixed pattern is the same in all pictures and in all calls.
    rng : numpy.random.Generator
        Two 64-bit numbers are taken from it as the key of all streams.
    count : int
        Number of pictures, at least 1.
    where : ndarray of bool, shape (height, width), optional
        Pixels whose noise is needed. Tiles without one keep their noise-free value.

    Returns
    -------
    ndarray of float64, shape (count, height, width)
        Grey levels; whole numbers from 0 to 2^bits - 1 if the noise has bits, but for a colour sensor's.

    Examples
    --------
    >>> pictures = expose(np.full((4, 4), 9.0), Noise(sigma=2.0, bits=8), np.random.default_rng(1), 1000)
    >>> pictures.shape, bool(abs(pictures.var() - (4 + 1 / 12)) < 0.2)
    ((1000, 4, 4), True)
    """
    if not isinstance(noise, Noise) or not isinstance(rng, np.random.Generator):
        raise InvalidInput("noise and rng must be a Noise and a numpy Generator, got something else")
    return Exposer(image, noise, where).take(rng, count)


class Exposer:
    """Takes pictures of one scene again and again: what they have in common is made once.

    Parameters
    ----------
    image, noise, where
        As of `expose`.
    """

    def __init__(self, image: np.ndarray, noise: Noise, where: np.ndarray | None = None) -> None:
        image = picture(image)
        if where is not None and not (
            isinstance(where, np.ndarray) and where.shape == image.shape and where.dtype == bool
        ):
            raise InvalidInput(f"where must be an array of bool, shape {image.shape}, got something else")
        self.noise, self._raw = noise, None
        image = np.asarray(image, float)
        if noise.colour is not None:
            near = where if where is None or not noise.colour.interpolates else binary_dilation(where, np.ones((3, 3)))
            self._raw = Exposer(raw(noise, image), without_filters(noise), near)
            return
        self._sigma = np.sqrt(noise.sigma**2 + shot_noise(noise, image - noise.dark_level))
        self._steady = image + fixed_pattern(image, noise)
        self._tiles = tuple(_tiles(image.shape, where))
        self._taken = np.empty((0, *image.shape))

    def take(self, rng: np.random.Generator, count: int, *, again: bool = False) -> np.ndarray:
        """``count`` pictures, as `expose` gives them; ``again`` in the same memory, where the former ones are no longer
        needed: only tiles with noise are written."""
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
            raise InvalidInput(f"count must be at least 1, got {count!r}")
        if self._raw is not None:
            return picture_of(self.noise, self._raw.take(rng, count, again=again))
        pictures = self._room(count) if again else self._filled(count)
        key = rng.integers(2**64, size=2, dtype=np.uint64)
        rows, columns = _shared(self.noise, key, count, self._steady.shape)
        streams = _Streams(key)
        for index, tile in self._tiles:
            block = streams[0, index].standard_normal((count, *self._steady[tile].shape))
            block *= self._sigma[tile]
            block += self._steady[tile]
            if self.noise.is_shared:
                block += rows[:, tile[0], None] + columns[:, None, tile[1]]
            pictures[(slice(None), *tile)] = digitised(block, self.noise)
        return pictures

    def _room(self, count: int) -> np.ndarray:
        """Of what was taken before, made when more are asked for than ever."""
        if count > len(self._taken):
            self._taken = self._filled(count)
        return self._taken[:count]

    def _filled(self, count: int) -> np.ndarray:
        """Pictures without noise."""
        pictures = np.empty((count, *self._steady.shape))
        pictures[:] = digitised(self._steady.copy(), self.noise)
        return pictures


class _Streams:
    """Streams of one key by two numbers, one at a time: to place one takes a tenth of the time of making one."""

    def __init__(self, key: np.ndarray) -> None:
        self._bits = np.random.Philox(key=key)
        self._start = self._bits.state

    def __getitem__(self, numbers: tuple[int, int]) -> np.random.Generator:
        self._start["state"]["counter"] = np.array([0, 0, *numbers], np.uint64)
        self._bits.state = self._start
        return np.random.Generator(self._bits)


def _tiles(shape: tuple[int, int], where: np.ndarray | None) -> Iterator[tuple[int, tuple[slice, slice]]]:
    """Numbers and places of the tiles in which a pixel is wanted."""
    height, width = shape
    across = -(-width // TILE)
    for index in range(across * -(-height // TILE)):
        top, left = TILE * (index // across), TILE * (index % across)
        tile = np.s_[top : top + TILE, left : left + TILE]
        if where is None or where[tile].any():
            yield index, tile


def _shared(noise: Noise, key: np.ndarray, count: int, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """What rows (count, height) and columns (count, width) have in common, grey levels, from a stream of its own."""
    stream = _Streams(key)[1, 0]
    rows, columns = (stream.standard_normal((count, size)) if noise.is_shared else np.zeros((0, 0)) for size in shape)
    return noise.row_sigma * rows, noise.column_sigma * columns


def digitised(levels: np.ndarray, noise: Noise) -> np.ndarray:
    """Grey levels as the sensor writes them: rounded and cut off at both ends of the scale; changed in place."""
    return levels if noise.bits is None else np.clip(np.rint(levels, out=levels), 0, full_scale(noise), out=levels)


def variance(image: np.ndarray, noise: Noise) -> np.ndarray:
    """Variance over repeated pictures (not sigma) of each pixel, squared grey levels, shape as the image."""
    return picture_variance(noise, grey_levels(image))


def fixed_pattern(image: np.ndarray, noise: Noise) -> np.ndarray:
    """What one camera's pixels add to a noise-free image, grey levels: offset (DSNU) and part of the signal (PRNU)."""
    if noise.prnu == 0 and noise.dsnu == 0:
        return np.zeros(image.shape)
    offset, share = np.random.default_rng(noise.pattern_seed).standard_normal((2, *image.shape))
    return noise.dsnu * offset + noise.prnu * share * np.maximum(image - noise.dark_level, 0.0)
