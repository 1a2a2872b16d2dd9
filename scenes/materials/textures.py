"""What is printed on faces of the object or how unevenly they reflect: factors of the diffuse reflectance."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Discriminator, Field, PrivateAttr, Tag, ValidationInfo, field_validator, model_validator

from scenes.errors import InvalidInput
from scenes.model import Model
from scenes.parts.solid import Solid
from scenes.ranges import Length, Positive
from scenes.selection import OnFaces, Point

CELLS = 8  # nodes of a statistical texture to a correlation length
MOST_NODES = 1 << 22  # of the texture of one face
_FEWEST = 8  # cells along a side
_SHARP = 32  # pixels that an image has at least each way, as far as its border is concerned
_OFF = 1e-3  # of the object's size: how far an image's corner may be off its face


class Rectangle(NamedTuple):
    """The smallest rectangle along a plane face's longest side: a corner (3,), unit axes (2, 3), lengths (2,)."""

    corner: np.ndarray
    axes: np.ndarray
    size: np.ndarray

    @classmethod
    def of(cls, solid: Solid, face: int) -> Rectangle:
        """About a face of a solid."""
        triangles, normal = solid.triangles[solid.triangle_faces == face], solid.normals[face]
        sides = (triangles - np.roll(triangles, 1, 1)).reshape(-1, 3)
        first = sides[np.linalg.norm(sides, axis=1).argmax()]
        axes = np.array([first, np.cross(normal, first)]) / np.linalg.norm(first)
        flat = triangles @ axes.T
        low, high = flat.min((0, 1)), flat.max((0, 1))
        return cls(low @ axes + normal * (normal @ triangles[0, 0]), axes, high - low)

    def nodes(self, step: float) -> tuple[int, int]:
        """How many nodes no further apart than ``step`` there are along the two sides, those at their ends included."""
        return tuple(int(max(np.ceil(side / step), _FEWEST)) + 1 for side in self.size)


class StatisticalTexture(OnFaces):
    """Uneven reflectance, another on every part: a Gaussian random field over each face, rolled from a seed.

    The diffuse reflectance is multiplied by 1 + contrast g, g of mean 0 and variance 1 with the autocorrelation
    exp(-(d / correlation)^2). Different faces and seeds have independent ones.
    """

    kind: Literal["statistical"]
    """A random field."""
    contrast: Annotated[float, Field(gt=0, le=0.2)]
    """Standard deviation over mean."""
    correlation: Length
    """Distance at which the autocorrelation has fallen to 1/e [length]."""
    seed: Annotated[int, Field(ge=0, lt=1 << 63)] = 0
    """Which part it is."""

    def check(self, solid: Solid, key: str) -> np.ndarray:
        """Indices of its faces; ValueError if they cannot be had (`OnFaces.chosen`) or take too many nodes."""
        found = self.chosen(solid, key)
        for face in found:
            check_nodes(solid, int(face), self.correlation / CELLS, f"{key}.correlation", CELLS)
        return found


class ImageTexture(Model):
    """A picture printed on a face: within its rectangle the diffuse reflectance is multiplied by level / white."""

    kind: Literal["image"]
    """A picture."""
    face: str
    """Name of the face; ``ice show`` lists them."""
    file: Path
    """PNG, TIFF, JPEG or .npy, relative to the scene's file."""
    origin: Point
    """Where its upper left corner is, on the face [length]."""
    direction: Point
    """Which way its rows run, left to right; of any length."""
    width: Length
    """Of the print, along ``direction`` [length]."""
    height: Length
    """Across it: downwards in the picture is to the right of ``direction``, seen from outside [length]."""
    white: Positive = 255.0
    """Level that leaves the face as bright as it is."""

    _levels: np.ndarray | None = PrivateAttr(None)

    def __hash__(self) -> int:
        return hash((self.face, self.file, self.origin, self.direction, self.width, self.height, self.white))

    def __eq__(self, other: object) -> bool:
        """A file that has changed is another texture."""
        same = isinstance(other, ImageTexture) and self.model_dump() == other.model_dump()
        return same and np.array_equal(self.levels, other.levels)

    @field_validator("file")
    @classmethod
    def _beside_the_scene(cls, file: Path, info: ValidationInfo) -> Path:
        return (info.context or {}).get("directory", Path()) / file

    @model_validator(mode="after")
    def _read(self) -> ImageTexture:
        from scenes.files.image import read  # loads OpenCV

        try:
            levels = read(self.file)
        except InvalidInput as error:
            reason = str(error).rpartition("got: ")[2]
            raise ValueError(f"file must be a readable image, got {self.file} ({reason})") from None
        if not (np.isfinite(levels).all() and levels.min() >= 0 and levels.max() <= 10 * self.white):
            raise ValueError(f"file must be of levels from 0 to 10 times white, got others in {self.file}")
        self._levels = levels
        return self

    @property
    def levels(self) -> np.ndarray:
        """The picture, shape (rows, columns)."""
        return self._levels

    @property
    def step(self) -> float:
        """Between nodes: half of the lesser side of a pixel, or less for a sharp border; scene units."""
        rows, columns = (max(count, _SHARP) for count in self.levels.shape)
        return min(self.width / columns, self.height / rows) / 2

    def check(self, solid: Solid, key: str) -> np.ndarray:
        """Index of its face, (1,); ValueError if there is no such face, or it is not on the face."""
        (face,) = OnFaces(faces=(self.face,)).chosen(solid, key)
        normal = solid.normals[face]
        if abs(normal @ np.array(self.origin) - solid.offsets[face]) > _OFF * solid.extent:
            raise ValueError(f"{key}.origin must be on face {self.face}, got {list(self.origin)}")
        length = np.linalg.norm(self.direction)
        if not (length > 0 and abs(normal @ np.array(self.direction)) <= _OFF * length):
            raise ValueError(f"{key}.direction must lie in face {self.face}, got {list(self.direction)}")
        check_nodes(solid, int(face), self.step, f"{key}.width", round(self.width / self.step))
        return np.array([face])


def check_nodes(solid: Solid, face: int, step: float, key: str, cells: int) -> None:
    """ValueError if a texture of a face would take too many nodes."""
    rectangle = Rectangle.of(solid, face)
    if np.prod(rectangle.size / step + 1.0) > MOST_NODES:
        least = cells * float(np.sqrt(rectangle.size.prod() / MOST_NODES)) * 1.1
        raise ValueError(f"{key} must be at least {least:.3g} on face {solid.face_names[face]}, got {cells * step:g}")


def _tag(value: Any) -> str:
    return value.get("kind", "") if isinstance(value, dict) else getattr(value, "kind", "")


Texture = Annotated[
    Annotated[StatisticalTexture, Tag("statistical")] | Annotated[ImageTexture, Tag("image")], Discriminator(_tag)
]


def check_textures(textures: tuple[StatisticalTexture | ImageTexture, ...], solid: Solid) -> None:
    """ValueError if a texture cannot be had, or a face has two."""
    owners: dict[int, int] = {}
    for i, texture in enumerate(textures):
        for face in texture.check(solid, f"textures[{i}]").tolist():
            if face in owners:
                got = f"{solid.face_names[face]!r}, which has textures[{owners[face]}]"
                raise ValueError(f"textures[{i}] must be on faces without a texture, got {got}")
            owners[face] = i
