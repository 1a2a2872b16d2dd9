"""Which faces of the object are meant: by name, or by where they are."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from scenes.model import Model
from scenes.parts.solid import Solid
from scenes.ranges import Coordinate

Point = tuple[Coordinate, Coordinate, Coordinate]
_SIDES = {
    "top": (0, 0, 1), "bottom": (0, 0, -1), "front": (0, -1, 0), "back": (0, 1, 0), "left": (-1, 0, 0),
    "right": (1, 0, 0),
}  # fmt: skip
_SLACK = 1e-6  # of the object's size: how far a vertex may stand out of a box


class Where(Model):
    """Faces by the direction they look in, by a box that holds them, or by both."""

    normal: Point | None = None
    """Outward normal, of any length."""
    within_deg: Annotated[float, Field(ge=0, le=180)] = 1.0
    """How far a face's own may be from it [degrees]."""
    box: tuple[Point, Point] | None = None
    """Corners of least and of largest x, y and z; all vertices of a face must lie within [length]."""

    def holds(self, solid: Solid) -> np.ndarray:
        """Which faces are meant, bool, shape (F,)."""
        found = np.ones(len(solid.faces), bool)
        if self.normal is not None:
            normal = np.array(self.normal)
            away = np.linalg.norm(np.cross(solid.normals, normal), axis=1), solid.normals @ normal
            found &= np.degrees(np.arctan2(*away)) <= self.within_deg + 1e-6
        if self.box is not None:
            low, high = np.array(self.box) + _SLACK * solid.extent * np.array([[-1], [1]])
            inside = ((solid.vertices >= low) & (solid.vertices <= high)).all(1)
            found &= np.array([inside[list(face)].all() for face in solid.faces])
        return found


class OnFaces(Model):
    """What is on some faces of the object."""

    faces: tuple[str, ...] = ()
    """Names of faces; ``ice show`` lists them."""
    where: str | Where | None = None
    """Instead of names: a side of the object (top, bottom, front, back, left, right: faces that look that way within 1
    degree), or a table."""

    def chosen(self, solid: Solid, key: str) -> np.ndarray:
        """Indices of the faces that are meant.

        Raises
        ------
        ValueError
            If a face is unknown or named twice, or no face is meant; ``key`` is that of the record.
        """
        if bool(self.faces) == (self.where is not None):
            raise ValueError(
                f"{key}.faces or {key}.where must be given, not both, got {'both' if self.faces else 'none'}"
            )
        if self.where is not None:
            return self._by_place(solid, key)
        for i, name in enumerate(self.faces):
            if name not in solid.face_names:
                known = ", ".join(solid.face_names[:24]) + (", ..." if len(solid.face_names) > 24 else "")
                raise ValueError(f"{key}.faces[{i}] must be one of {known}, got {name!r}")
            if name in self.faces[:i]:
                raise ValueError(f"{key}.faces must be different faces, got {name!r} twice")
        return np.array([solid.face_names.index(name) for name in self.faces])

    def _by_place(self, solid: Solid, key: str) -> np.ndarray:
        if isinstance(self.where, str) and self.where not in _SIDES:
            raise ValueError(f"{key}.where must be one of {', '.join(_SIDES)}, or a table, got {self.where!r}")
        where = Where(normal=_SIDES[self.where]) if isinstance(self.where, str) else self.where
        if where.normal is None and where.box is None:
            raise ValueError(f"{key}.where must be a side, or have a normal or a box, got neither")
        if where.normal is not None and not np.any(where.normal):
            raise ValueError(f"{key}.where.normal must be a direction, got {list(where.normal)}")
        if where.box is not None and not np.all(np.array(where.box[0]) < where.box[1]):
            raise ValueError(f"{key}.where.box must be of rising corners, got {[list(each) for each in where.box]}")
        found = np.flatnonzero(where.holds(solid))
        if not found.size:
            raise ValueError(f"{key}.where must hold a face of the object, got none")
        return found
