"""What carries sensor or part from picture to picture, and how it errs: a robot's hand, a linear stage, a turntable.

Each moves the sensor beside where it is said, as a rigid body: a shift and a rotation vector about the point that the
camera looks at. A stage or table that moves the part moves the sensor the other way, seen from the part. An error is
``own`` where each move of the carrier makes it anew, so that every picture has one of its own; else all pictures of one
station share it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from scenes.model import Model
from scenes.ranges import Coordinate, Spread

_AXES = ("right", "down", "forward")
Triple = tuple[Coordinate, Coordinate, Coordinate]
_Six = Annotated[tuple[Coordinate, ...], Field(min_length=6, max_length=6)]
Each = Spread | tuple[Spread, Spread, Spread]
_POSITIVE = 1e-9  # of the largest variance: less than none, but for rounding


@dataclass(frozen=True, eq=False)
class Place:
    """Where a sensor is said to stand.

    Attributes
    ----------
    eye : ndarray, shape (3,)
    axes : ndarray, shape (3, 3)
        Right, down and forward, in rows.
    look_at : ndarray, shape (3,)
    azimuth_deg : float
    """

    eye: np.ndarray
    axes: np.ndarray
    look_at: np.ndarray
    azimuth_deg: float

    def about(self, shift: np.ndarray, turn: np.ndarray, pivot: np.ndarray) -> np.ndarray:
        """A shift and a rotation vector (rad) about a pivot as those about `look_at`, (6,)."""
        return np.concatenate([shift + np.cross(turn, self.look_at - pivot), turn])


@dataclass(frozen=True)
class Error:
    """One independent error of a carrier, with its standard uncertainty.

    ``unit`` is ``length`` for the scene's.
    """

    name: str
    u: float
    unit: str
    own: bool = False


class HandEye(Model):
    """Where the camera sits on the robot's hand is not exact: the same error of the sensor, along and about its own
    axes, in all pictures."""

    shift: Each = 0.0
    """Along the sensor's right, down and forward; of each its own in a list of three [length]."""
    turn_deg: Each = 0.0
    """About these axes through the sensor, as ``shift`` [degrees]."""
    covariance: Annotated[tuple[_Six, ...], Field(min_length=6, max_length=6)] | None = None
    """In place of both: of shifts and turns together, as a calibration tells it [length and degrees, squared]."""

    @model_validator(mode="after")
    def _once(self) -> HandEye:
        if self.covariance is None:
            return self
        if any(_three(self.shift)) or any(_three(self.turn_deg)):
            raise ValueError("hand_eye.covariance must be without shift and turn_deg, got both")
        told = np.array(self.covariance)
        if not np.allclose(told, told.T, rtol=1e-6):
            raise ValueError("hand_eye.covariance must be symmetric, got one that is not")
        least, most = np.linalg.eigvalsh(told)[[0, -1]]
        if least < -_POSITIVE * most:
            raise ValueError(f"hand_eye.covariance must have no negative variance, got {least:g}")
        return self

    @property
    def errors(self) -> tuple[Error, ...]:
        if self.covariance is not None:
            return tuple(Error(f"hand_eye[{i}]", 1.0, "") for i in range(6))
        shifts = (Error(f"hand_eye.shift.{a}", u, "length") for a, u in zip(_AXES, _three(self.shift), strict=True))
        turns = (Error(f"hand_eye.turn_deg.{a}", u, "deg") for a, u in zip(_AXES, _three(self.turn_deg), strict=True))
        return (*shifts, *turns)

    def moves(self, place: Place) -> np.ndarray:
        """How the sensor is moved by a unit of each error, (6, k)."""
        axes, nothing = place.axes, np.zeros(3)
        own = [place.about(axis, nothing, place.eye) for axis in axes]
        own += [place.about(nothing, np.radians(axis), place.eye) for axis in axes]
        columns = np.stack(own, -1)
        if self.covariance is None:
            return columns
        sizes, directions = np.linalg.eigh(np.array(self.covariance))
        return columns @ (directions * np.sqrt(np.maximum(sizes, 0.0)))


class Stage(Model):
    """A linear stage that moves the sensor along a line, or the part against it."""

    along: Triple = (1.0, 0.0, 0.0)
    """Direction of travel."""
    zero: Triple = (0.0, 0.0, 0.0)
    """Where the sensor stands at the reading 0, or any place beside [length]."""
    scale: Spread = 0.0
    """Of what it travels, as a part of it: the same in all pictures."""
    positioning: Spread = 0.0
    """Of its reading, anew with each move [length]."""
    straightness: Spread = 0.0
    """Across its travel, in both directions, anew with each move [length]."""

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Stage:
        if not np.linalg.norm(self.along) > 0:
            raise ValueError("stage.along must be a direction, got (0, 0, 0)")
        return self

    @property
    def errors(self) -> tuple[Error, ...]:
        return (
            Error("stage.scale", self.scale, ""),
            Error("stage.positioning", self.positioning, "length", own=True),
            *(Error(f"stage.straightness.{i}", self.straightness, "length", own=True) for i in (1, 2)),
        )

    def moves(self, place: Place) -> np.ndarray:
        """How the sensor is moved by a unit of each error, (6, k)."""
        travel = np.array(self.along) / np.linalg.norm(self.along)
        across = np.linalg.svd(travel[None])[2][1:]
        shifts = [travel * (travel @ (place.eye - np.array(self.zero))), travel, *across]
        return np.concatenate([np.stack(shifts, -1), np.zeros((3, len(shifts)))])


class Turntable(Model):
    """A table that turns the part about the axis along z through the point that the camera looks at: the sensor's
    azimuth in the scene is its angle."""

    zero_deg: float = 0.0
    """The sensor's azimuth at the table's angle 0 [degrees]."""
    axis_shift: Spread = 0.0
    """Of the axis' place, along x and y: the same in all pictures [length]."""
    axis_tilt_deg: Spread = 0.0
    """Of its direction, about x and y [degrees]."""
    angle_deg: Spread = 0.0
    """Of the table's angle, anew with each move [degrees]."""

    @property
    def errors(self) -> tuple[Error, ...]:
        return (
            *(Error(f"turntable.axis_shift.{axis}", self.axis_shift, "length") for axis in "xy"),
            *(Error(f"turntable.axis_tilt_deg.{axis}", self.axis_tilt_deg, "deg") for axis in "xy"),
            Error("turntable.angle_deg", self.angle_deg, "deg", own=True),
        )

    def moves(self, place: Place) -> np.ndarray:
        """How the sensor is moved by a unit of each error, (6, k): what a turn about one axis differs from that about
        another by, (1 - R) times the axis' error."""
        angle = np.radians(place.azimuth_deg - self.zero_deg)
        cos, sin = np.cos(angle), np.sin(angle)
        left = np.eye(3) - np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        nothing = np.zeros(3)
        columns = [np.concatenate([left[:, i], nothing]) for i in range(2)]
        columns += [np.concatenate([nothing, np.radians(turn)]) for turn in (left[:, 0], left[:, 1], [0.0, 0.0, 1.0])]
        return np.stack(columns, -1)


Carrier = HandEye | Stage | Turntable


def moved(carriers: Sequence[Carrier], place: Place, *, own: bool) -> np.ndarray:
    """How the sensor is moved by one standard uncertainty of each error that pictures share, or have of their own,
    (6, k)."""
    found = [np.zeros((6, 0))]
    for carrier in carriers:
        moves = carrier.moves(place)
        found += [moves[:, i : i + 1] * e.u for i, e in enumerate(carrier.errors) if e.own == own and e.u > 0]
    return np.concatenate(found, -1)


def _three(told: Each) -> tuple[float, float, float]:
    return told if isinstance(told, tuple) else (told,) * 3
