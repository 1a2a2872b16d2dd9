"""How well a splined lens is known: independent errors of its focal length and displacements together."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from scenes.cameras.splined import Rows, Splined, on_plane
from scenes.errors import InvalidInput, describe
from scenes.files.door import read_json
from scenes.model import Model
from scenes.ranges import Coordinate

if TYPE_CHECKING:
    from scenes.cameras import Camera


class LensMode(Model):
    """One error of a splined lens, of variance 1 and independent of the others."""

    focal_px: Coordinate
    """By how much the focal length is off where the error is 1 [px]."""
    right: Rows
    """The same of the control points of the displacement to the right, as many as the lens has. Focal lengths."""
    down: Rows
    """The same of the displacement downwards."""

    def moved(self, lens: Splined, step: float) -> Splined:
        """A lens with so much of this error."""
        return lens.tried(right=_sum(lens.right, self.right, step), down=_sum(lens.down, self.down, step))

    def shifts(self, lens: Splined, points: np.ndarray) -> np.ndarray:
        """By how much such a lens records points (..., 2) of a pinhole's image elsewhere with this error, but for that
        of its focal length; both in focal lengths."""
        return lens.tried(right=self.right, down=self.down).bent(points) - on_plane(points, lens.plane)


def _sum(rows: Rows, more: Rows, step: float) -> Rows:
    return tuple(map(tuple, (np.array(rows) + step * np.array(more)).tolist()))


def of_file(value: Any, directory: Path) -> Any:
    """What the model takes, from the name of a JSON file with ``modes``, or from the modes themselves.

    Raises
    ------
    InvalidInput
        If the file cannot be read, or has none; the text names it.
    """
    if not isinstance(value, str | Path):
        return value
    path = directory / value
    document = read_json(path)
    modes = document.get("modes") if isinstance(document, dict) else None
    if not isinstance(modes, list):
        raise InvalidInput(f"{path}: modes must be a list, got {type(modes).__name__}")
    try:
        return tuple(LensMode.model_validate(each) for each in modes)
    except ValidationError as error:
        raise InvalidInput(f"{path}: {describe(error)}") from None


def check_lens_modes(camera: Camera, modes: tuple[LensMode, ...]) -> None:
    """See that errors are of the lens that a camera has.

    Raises
    ------
    ValueError
        If not.
    """
    if not modes:
        return
    lens = camera.lens
    if not isinstance(lens, Splined):
        raise ValueError(f"uncertainty.lens_modes must be left out unless camera.lens is splined, got {lens.kind}")
    wanted = np.shape(lens.right)
    for number, mode in enumerate(modes, 1):
        for name in ("right", "down"):
            rows = getattr(mode, name)
            if [len(row) for row in rows] != [wanted[1]] * wanted[0]:
                raise ValueError(
                    f"uncertainty.lens_modes must have {wanted[0]} rows of {wanted[1]} control points as the lens, got"
                    f" others in {name} of the {number}-th"
                )
