"""Textures of faces as numbers on grids: factors of the diffuse reflectance, bilinear between their nodes.

Renderer and prediction take the same grids, so what one shows the other knows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from scenes import Scene, Solid
from scenes.materials.textures import CELLS, ImageTexture, Rectangle, StatisticalTexture

_REACH = 5.0  # standard deviations at which a Gaussian ends


@dataclass(frozen=True, eq=False)
class Sheet:
    """The texture of one face.

    Attributes
    ----------
    rectangle : Rectangle
        Where the grid lies: its first node at the corner, its last at the opposite one.
    values : ndarray, shape (rows, columns)
        Factors; columns run along the rectangle's first axis.
    field : Field or None
        How it is rolled, of a statistical texture.
    """

    rectangle: Rectangle
    values: np.ndarray
    field: Field | None = None

    def places(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the face as fractions (across, down) of the rectangle's sides, (..., 2)."""
        return (points - self.rectangle.corner) @ self.rectangle.axes.T / self.rectangle.size

    def nodes(self, points: np.ndarray) -> np.ndarray:
        """The same counted in nodes."""
        return self.places(points) * (np.array(self.values.shape[::-1]) - 1)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Factor at points (..., 3) of the face; beside the rectangle that of its rim."""
        column, row = np.moveaxis(self.nodes(points), -1, 0)
        return _between(self.values, row, column)


@dataclass(frozen=True)
class Field:
    """A Gaussian random field on a grid: white noise, filtered by a Gaussian of widths (rows, columns) in nodes."""

    contrast: float
    widths: tuple[float, float]

    @property
    def margin(self) -> tuple[int, int]:
        """Nodes beyond the grid that have a part in it."""
        return tuple(int(np.ceil(_REACH * width)) for width in self.widths)

    def filtered(self, grid: np.ndarray) -> np.ndarray:
        """Filtered so that white noise of variance 1 becomes a field of standard deviation ``contrast``."""
        from scipy.ndimage import gaussian_filter  # slow to load, and rarely needed

        gain = self.contrast * np.sqrt(4 * np.pi * np.prod(self.widths))
        return gain * gaussian_filter(grid, self.widths, mode="constant", truncate=_REACH)

    def rolled(self, shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
        """One realization, of mean 0."""
        (above, beside), (rows, columns) = self.margin, shape
        white = rng.standard_normal((rows + 2 * above, columns + 2 * beside))
        return self.filtered(white)[above : above + rows, beside : beside + columns]


def sheets(scene: Scene) -> dict[int, Sheet]:
    """The textures of a scene by the index of their face."""
    return _sheets(scene.textures, scene.solid) if scene.textures else {}


def printed(scene: Scene) -> dict[int, Sheet]:
    """Those that are the same on every part: images."""
    return {face: sheet for face, sheet in sheets(scene).items() if sheet.field is None}


@lru_cache(maxsize=8)
def _sheets(textures: tuple[StatisticalTexture | ImageTexture, ...], solid: Solid) -> dict[int, Sheet]:
    found = {}
    for number, texture in enumerate(textures):
        for face in texture.check(solid, f"textures[{number}]").tolist():
            rectangle = Rectangle.of(solid, face)
            if isinstance(texture, ImageTexture):
                found[face] = _of_image(texture, rectangle, solid.normals[face])
            else:
                found[face] = _of_field(texture, rectangle, np.random.default_rng([texture.seed, number, face]))
    return found


def _of_field(texture: StatisticalTexture, rectangle: Rectangle, rng: np.random.Generator) -> Sheet:
    """White noise filtered by exp(-2 (d / correlation)^2), whose autocorrelation is exp(-(d / correlation)^2)."""
    columns, rows = rectangle.nodes(texture.correlation / CELLS)
    width, height = rectangle.size / (columns - 1, rows - 1)
    field = Field(texture.contrast, (texture.correlation / 2 / height, texture.correlation / 2 / width))
    return Sheet(rectangle, 1 + field.rolled((rows, columns), rng), field)


def _of_image(texture: ImageTexture, rectangle: Rectangle, normal: np.ndarray) -> Sheet:
    """On a grid along the face with a step of half a pixel of the image, whose pixels' middles are interpolated."""
    columns, rows = rectangle.nodes(texture.step)
    across, down = (np.linspace(0, side, count) for side, count in zip(rectangle.size, (columns, rows), strict=True))
    points = rectangle.corner + across[:, None] * rectangle.axes[0] + down[:, None, None] * rectangle.axes[1]
    right = np.array(texture.direction) - normal * (normal @ np.array(texture.direction))
    right /= np.linalg.norm(right)
    away = points - np.array(texture.origin)
    u, v = away @ right / texture.width, away @ np.cross(right, normal) / texture.height
    inside = (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1)
    height, width = texture.levels.shape
    levels = _between(texture.levels, v * height - 0.5, u * width - 0.5)
    return Sheet(rectangle, np.where(inside, levels / texture.white, 1.0))


def _between(values: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """What lies between values (h, w) at rows and columns (...); beside them what is at their border."""
    from scipy.ndimage import map_coordinates  # slow to load, and rarely needed

    return map_coordinates(values, [row, column], order=1, mode="nearest")
