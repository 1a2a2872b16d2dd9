"""Which photograph of a board would most lower U of a measurand of a scene that the camera is calibrated for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import cv2
import numpy as np

import planner
from measure.boards.camera import CameraCalibration
from measure.boards.chessboard import Board
from measure.boards.next_pose import middle_of, next_board
from planner.budgeting.sources import LENS_MODE
from scenes import InvalidInput, Picture, Scene


@dataclass(frozen=True)
class Proposal:
    """The next photograph, and what it is worth.

    Attributes
    ----------
    measurand, unit : str
    U, U_then : float
        Expanded uncertainties (95 %) with the calibration as it is, and with the board of this pose.
    pose : tuple of float, 6
        Rotation vector (radians) and translation (unit of the squares) from board to camera.
    middle_px : (float, float)
        Where the board's middle is in the image.
    distance, tilt_deg : float
        Of its middle from the camera, and of its normal from the camera's axis.
    candidates : int
        From which it was chosen.
    """

    measurand: str
    unit: str
    U: float
    U_then: float
    pose: tuple[float, ...]
    middle_px: tuple[float, float]
    distance: float
    tilt_deg: float
    candidates: int

    @property
    def facts(self) -> dict[str, Any]:
        """As JSON has it."""
        return asdict(self)

    @property
    def text(self) -> str:
        """In a line."""
        x, y = self.middle_px
        return (
            f"next: a board whose middle is at {x:.0f}, {y:.0f} px, {self.distance:.4g} away, tilted by "
            f"{self.tilt_deg:.0f} degrees (pose {', '.join(f'{each:.4g}' for each in self.pose)}): "
            f"U of {self.measurand} {self.U:.3g} {self.unit} now, {self.U_then:.3g} {self.unit} then"
        )


def propose(
    found: CameraCalibration, boards: Sequence[Board], square_size: float, picture: Picture, name: str
) -> Proposal:
    """The proposal for a measurand of a picture whose scene takes what the calibration leaves open.

    Raises
    ------
    InvalidInput
        If the scene has no such measurand, or it cannot be measured.
    """
    names = [each.name for each in picture.scene.quantities]
    if name not in names:
        raise InvalidInput(f"--next must be one of {', '.join(names)}, got {name!r}")
    budget = planner.budget(picture.with_scene(_as_calibrated(picture.scene, found)))
    by_source = dict(zip((each.name for each in budget.sources), budget.sensitivities[names.index(name)], strict=True))
    if found.is_splined:
        slopes = np.array([slope for source, slope in by_source.items() if source.startswith(LENS_MODE)])
    else:
        slopes = found.errors.T @ [by_source[each] for each in found.names]
    told, now = next_board(found, boards, square_size, slopes), budget[name]
    freed = slopes @ slopes - told.variances[told.best]
    at = middle_of(told.pose, boards[0], square_size)
    image = found.model.seen(found.values, at[None])[0][0]
    normal = cv2.Rodrigues(told.pose[:3])[0][:, 2]
    return Proposal(
        measurand=name,
        unit=now.unit,
        U=float(now.U),
        U_then=float(now.k * np.sqrt(max(now.u**2 - freed, 0.0))),
        pose=tuple(map(float, told.pose)),
        middle_px=(float(image[0]), float(image[1])),
        distance=float(np.linalg.norm(at)),
        tilt_deg=float(np.degrees(np.arccos(np.clip(abs(normal[2]), 0.0, 1.0)))),
        candidates=len(told.poses),
    )


def _as_calibrated(scene: Scene, found: CameraCalibration) -> Scene:
    """The scene with what the calibration leaves open; of a splined lens with that lens, of which its errors are."""
    if not found.is_splined:
        return scene.with_(uncertainty={"covariance": found.for_budget})
    return scene.with_(
        camera={"lens": found.lens.spline}, uncertainty={"covariance": None, "lens_modes": found.lens_modes}
    )
