"""What varying more than the poses gives: settings with a choice of polarisers, lamp and filter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.geometry.projection import direction
from planner.search.choices import Choice
from scenes import Pose, Scene

_APART = 15.0  # degrees: sensors, lights or polarisers of clearly different settings


@dataclass(frozen=True)
class Chosen:
    """A setting with its choice.

    Attributes
    ----------
    choice : Choice
    scene : Scene
        With that choice: ready to predict, render and measure.
    sensor, light : Pose
    variance : float
        What is minimised, as `Plan.variance`.
    status : str
        The worst of the measurands.
    exposure_time : float
        Over that of the scene's own choice.
    """

    choice: Choice
    scene: Scene
    sensor: Pose
    light: Pose
    variance: float
    status: str
    exposure_time: float


@dataclass(frozen=True)
class Varied:
    """What varying more than the poses gains.

    Attributes
    ----------
    vary : tuple of str
    hold : {"time", "white"}
        What is equal: exposure time, or the grey level of a white diffuse surface.
    fixed : Chosen
        The scene's own choice at its best poses: the plan's, after the same descent.
    same_poses : Chosen
        The best choice at those poses.
    best : Chosen
        Poses and choice together.
    evaluated : int
        Settings evaluated.
    guarantee : str
        What is known about the optimum.
    """

    vary: tuple[str, ...]
    hold: str
    fixed: Chosen
    same_poses: Chosen
    best: Chosen
    evaluated: int
    guarantee: str

    @property
    def gain(self) -> float:
        """Variance of the fixed choice over that of the best one, each at its own poses; never below 1."""
        return self.fixed.variance / self.best.variance

    @property
    def gain_same_poses(self) -> float:
        """The same at the poses of the fixed choice."""
        return self.fixed.variance / self.same_poses.variance


@dataclass(frozen=True, eq=False)
class Place:
    """A choice and poses (polar, azimuth) in degrees, with what is minimised there."""

    choice: Choice
    sensor: np.ndarray
    light: np.ndarray
    value: float

    @cached_property
    def _directions(self) -> np.ndarray:
        return direction(np.array([self.sensor, self.light]))

    def differs(self, other: Place) -> bool:
        """Whether anything of it is clearly apart from another's."""
        one, two = self.choice, other.choice
        return bool(
            (one.lamp, one.filter) != (two.lamp, two.filter)
            or _apart(one.analyser_deg, two.analyser_deg) >= _APART
            or _apart(one.polarisation_deg, two.polarisation_deg) >= _APART
            or (np.einsum("ij,ij->i", self._directions, other._directions) < np.cos(np.radians(_APART))).any()
        )


def _apart(a: float | None, b: float | None) -> float:
    """Angle between two polarisers, which are the same after half a turn; infinite if only one is there."""
    if a is None or b is None:
        return 0.0 if a is b else np.inf
    return abs((a - b + 90) % 180 - 90)
