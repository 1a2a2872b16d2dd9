"""What a mosaic of colour filters makes of a picture: raw levels, the picture made of them, and its noise."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from imaging.sensor import Levels, recorded
from scenes import Noise
from scenes.cameras.colour import Colour

_PLACES = tuple(np.ndindex(2, 2))


def without_filters(noise: Noise) -> Noise:
    """The noise of a raw pixel, by its raw level."""
    return noise.model_copy(update={"colour": None})


def raw(noise: Noise, levels: np.ndarray) -> np.ndarray:
    """Noise-free raw levels (..., height, width) of what a grey sensor of the strongest response would show."""
    return noise.dark_level + _shares(noise.colour, levels.shape[-2:]) * (levels - noise.dark_level)


def picture_of(noise: Noise, levels: np.ndarray) -> np.ndarray:
    """The picture (..., height, width) that is made of raw levels: balanced, and demosaiced where that is asked for.

    At the border the mosaic goes on as its mirror image, which keeps its pattern.
    """
    colour, dark = noise.colour, noise.dark_level
    if not colour.interpolates:
        return dark + (levels - dark) / _shares(colour, levels.shape[-2:])
    height, width = levels.shape[-2:]
    wide = np.pad(levels - dark, [(0, 0)] * (levels.ndim - 2) + [(1, 1), (1, 1)], mode="reflect")
    found = np.full(levels.shape, dark, float)
    for row, column in _PLACES:
        part = found[..., row::2, column::2]
        for (dy, dx), weight in np.ndenumerate(colour.kernels[row, column]):
            if weight:
                part += weight * wide[..., row + dy : height + dy : 2, column + dx : width + dx : 2]
    return found


def seen(noise: Noise, levels: np.ndarray) -> Levels:
    """What is recorded of a noise-free picture (..., height, width), and the variance of each raw pixel's noise.

    The level is that of the picture; the variance is of raw pixels once they are balanced, grey levels^2, which are
    independent. Without colour filters both are those of `imaging.sensor.recorded`.
    """
    if noise.colour is None:
        return recorded(noise, levels)
    found = recorded(without_filters(noise), raw(noise, levels))
    shares = _shares(noise.colour, levels.shape[-2:])
    return Levels(picture_of(noise, found.level), found.noise_variance / shares**2)


def raw_variance(noise: Noise, levels: np.ndarray, pixels: np.ndarray, width: int) -> np.ndarray:
    """Variance of raw pixels, once balanced, at picture levels (..., P) of pixels (P,), flat indices."""
    y, x = np.divmod(pixels, width)
    share = noise.colour.shares[y % 2, x % 2]
    level = noise.dark_level + share * (levels - noise.dark_level)
    return recorded(without_filters(noise), level).noise_variance / share**2


def by_raw(colour: Colour, pixels: np.ndarray, shape: tuple[int, int]) -> tuple[sparse.csr_array, np.ndarray]:
    """Derivative of pixels (P,) of a picture by balanced raw pixels, (P, Q), and their flat indices (Q,), in order.

    Parameters
    ----------
    colour : Colour
    pixels : ndarray of int, shape (P,)
        Flat indices.
    shape : tuple of int
        (height, width) of the picture.
    """
    (y, x), number = np.divmod(pixels, shape[1]), np.arange(len(pixels))
    kernel = (colour.kernels * _tiled(colour.shares))[y % 2, x % 2]
    rows, columns, values = [], [], []
    for dy, dx in np.ndindex(3, 3):
        weight = kernel[:, dy, dx]
        used = weight != 0
        there = [
            _mirrored(place[used] + step - 1, size) for place, step, size in zip((y, x), (dy, dx), shape, strict=True)
        ]
        rows.append(number[used])
        columns.append(there[0] * shape[1] + there[1])
        values.append(weight[used])
    found, place = np.unique(np.concatenate(columns), return_inverse=True)
    taken = sparse.coo_array((np.concatenate(values), (np.concatenate(rows), place)), (len(pixels), len(found)))
    return taken.tocsr(), found


def rows_by_raw(noise: Noise, rows: sparse.csr_array, shape: tuple[int, int]) -> sparse.csr_array:
    """Derivatives (k, height * width) by a picture's pixels as those by balanced raw pixels, of the same shape."""
    if noise.colour is None or not noise.colour.interpolates:
        return rows
    used = np.unique(rows.indices)
    taken, found = by_raw(noise.colour, used, shape)
    made = (sparse.csr_array(rows[:, used]) @ taken).tocoo()
    return sparse.csr_array((made.data, (made.coords[0], found[made.coords[1]])), rows.shape)


def picture_variance(noise: Noise, levels: np.ndarray) -> np.ndarray:
    """Variance over repeated pictures of each pixel of a picture (height, width) of noise-free levels."""
    found = seen(noise, levels).noise_variance + noise.row_sigma**2 + noise.column_sigma**2
    if noise.colour is None or not noise.colour.interpolates:
        return found
    taken, used = by_raw(noise.colour, np.arange(levels.size), levels.shape)
    return (taken.power(2) @ np.broadcast_to(found, levels.shape).ravel()[used]).reshape(levels.shape)


def _shares(colour: Colour, shape: tuple[int, ...]) -> np.ndarray:
    height, width = shape
    return np.tile(colour.shares, ((height + 1) // 2, (width + 1) // 2))[:height, :width]


def _tiled(shares: np.ndarray) -> np.ndarray:
    """Response of the pixels beside those of each place of the pattern, (2, 2, 3, 3)."""
    steps = np.arange(-1, 2)
    return np.array([[shares[np.ix_((row + steps) % 2, (column + steps) % 2)] for column in (0, 1)] for row in (0, 1)])


def _mirrored(place: np.ndarray, size: int) -> np.ndarray:
    """Indices within 0 .. size - 1, mirrored at the outermost pixels."""
    return (size - 1) - np.abs((size - 1) - np.abs(place))
