"""Photographs of one pose, and the pixels that tell of the part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from imaging.blurred.arrangement import arrangement_of, near_pixels
from imaging.geometry.projection import project
from imaging.pictures import Pictures
from scenes import InvalidInput
from scenes.arrays import picture as checked

_MARGIN = 12.0  # px beside the object's image that tell the level of darkness; six blurs more
_BLOCK = 4  # px
_TILE, _FEWEST = 16, 200  # px; squares away from edges, at least
_MOST = 200_000  # pixels, of which a model takes some 0.3 s
_ALIKE = 1.5  # of the variance of white noise


@dataclass(frozen=True, eq=False)
class Shots:
    """Repeated photographs of one pose.

    Attributes
    ----------
    mean : ndarray, shape (height, width)
    count : int
    scatter : ndarray, shape (height, width), optional
        Variance of each pixel over the repetitions; None of a single photograph.
    members : tuple of int
        Which of the photographs.
    """

    mean: np.ndarray
    count: int
    scatter: np.ndarray | None
    members: tuple[int, ...]

    @classmethod
    def of(cls, images: list[np.ndarray], members: tuple[int, ...]) -> Shots:
        """From photographs of one shape."""
        chosen = np.stack([images[i] for i in members])
        scatter = chosen.var(0, ddof=1) if len(members) > 1 else None
        return cls(chosen.mean(0), len(members), scatter, members)

    def coarse(self, shrink: int, smooth: float) -> np.ndarray:
        """The mean of ``shrink`` x ``shrink`` pixels each, then under a Gaussian of ``smooth`` such px."""
        height, width = (size // shrink for size in self.mean.shape)
        whole = self.mean[: height * shrink, : width * shrink].reshape(height, shrink, width, shrink).mean((1, 3))
        return gaussian_filter(whole, smooth, mode="nearest") if smooth > 0 else whole


def grouped(images: list[np.ndarray]) -> list[Shots]:
    """Photographs by pose: those that differ by white noise alone are repetitions.

    Two photographs are of one pose where the means of blocks of 4 x 4 pixels have differences whose variance is at most
    1.5 times what noise that is independent from pixel to pixel would make it. A part that has moved changes the blocks
    at its edges by more.

    Raises
    ------
    InvalidInput
        If there are none, or they are not of one size.
    """
    images = [checked(image, "photograph") for image in images]
    if not images or len({image.shape for image in images}) > 1:
        shapes = ", ".join(f"{w} x {h}" for h, w in dict.fromkeys(image.shape for image in images)) or "none"
        raise InvalidInput(f"photographs must be of one size, got {shapes}")
    groups: list[list[int]] = []
    for i, image in enumerate(images):
        like = next((group for group in groups if _alike(images[group[0]], image)), None)
        groups.append([i]) if like is None else like.append(i)
    return [Shots.of(images, tuple(group)) for group in groups]


def _alike(a: np.ndarray, b: np.ndarray) -> bool:
    difference = b - a
    height, width = (size // _BLOCK * _BLOCK for size in difference.shape)
    blocks = difference[:height, :width].reshape(height // _BLOCK, _BLOCK, width // _BLOCK, _BLOCK)
    slow = blocks.mean((1, 3))
    fast = (blocks - slow[:, None, :, None]).var() * _BLOCK**2 / (_BLOCK**2 - 1)
    return float(np.mean(slow**2)) * _BLOCK**2 <= _ALIKE * fast


@dataclass(frozen=True, eq=False)
class Pixels:
    """Pixels (P,) that tell of the part: T rectangles of one size.

    Attributes
    ----------
    x, y : ndarray of int, shape (P,)
        Rectangle by rectangle, in rows, from left to right.
    shape : tuple of int
        T, height, width.
    """

    x: np.ndarray
    y: np.ndarray
    shape: tuple[int, int, int]

    @classmethod
    def around(cls, pictures: Pictures, most: int = _MOST) -> Pixels:
        """The window that holds the object's image and a margin.

        Of one with more than ``most`` pixels, squares of 16 x 16: all at edges, and of the others as many as that
        leaves room for, evenly.
        """
        (left, top), (right, bottom) = _window(pictures)
        if (right - left) * (bottom - top) <= most or min(right - left, bottom - top) < _TILE:
            y, x = np.mgrid[top:bottom, left:right]
            return cls(x.ravel(), y.ravel(), (1, *x.shape))
        return cls._tiled(*_tiles(pictures, (left, top), (right, bottom), most))

    @classmethod
    def _tiled(cls, tops: np.ndarray, lefts: np.ndarray) -> Pixels:
        steps = np.arange(_TILE)
        y = np.broadcast_to((tops[:, None] + steps)[:, :, None], (tops.size, _TILE, _TILE))
        x = np.broadcast_to((lefts[:, None] + steps)[:, None, :], (tops.size, _TILE, _TILE))
        return cls(x.ravel(), y.ravel(), x.shape)

    def of(self, image: np.ndarray) -> np.ndarray:
        """Their values in an image, (P,)."""
        return image[self.y, self.x]


def _window(pictures: Pictures) -> tuple[np.ndarray, np.ndarray]:
    """First and past the last (x, y) of the object's image with its margin, within the photograph."""
    camera = pictures.scene.camera
    corners = project(pictures.scene.solid.vertices, pictures.sensors, camera)
    corners = corners[np.isfinite(corners).all(1)]
    if not len(corners):
        raise InvalidInput("sensor must see the object, got a pose from which it lies behind")
    margin, size = _MARGIN + 6 * camera.most_blur_px, np.array([camera.width, camera.height])
    low = np.clip(np.floor(corners.min(0) - margin), 0, size - 1).astype(int)
    return low, np.clip(np.ceil(corners.max(0) + margin) + 1, low + 1, size).astype(int)


def _tiles(pictures: Pictures, low, high, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Tops and lefts of the squares."""
    across, down = ((high[i] - low[i]) // _TILE for i in (0, 1))
    camera, arrangement = pictures.scene.camera, arrangement_of(pictures)
    reach = 6 * camera.most_blur_px + 3
    y, x = near_pixels(arrangement, (camera.height, camera.width), reach, arrangement.pieces)
    column, row = (x - low[0]) // _TILE, (y - low[1]) // _TILE
    good = (column >= 0) & (column < across) & (row >= 0) & (row < down)
    edges = np.unique(row[good] * across + column[good])
    rest = np.setdiff1d(np.arange(across * down), edges)
    room = max(most // _TILE**2 - edges.size, _FEWEST)
    chosen = np.concatenate([edges, rest[:: max(-(-rest.size // room), 1)]])
    return low[1] + _TILE * (chosen // across), low[0] + _TILE * (chosen % across)
