"""Settings glanced at, all of a grid, and those of them that were looked at closely."""

from __future__ import annotations

import numpy as np

from imaging.geometry.projection import direction
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.prediction import Prediction, predict
from planner.search.aim import Aim
from planner.search.constraints import Constraints
from planner.search.exhaustive import Report
from planner.search.subsets import Information
from scenes import Scene
from scenes.status import is_trusted

_ALIKE = 15.0  # degrees: beside a picture with clutter, what is clutter there is taken to be so until it is looked at
_AT_A_TIME = 20_000  # pairs


def information(variances: np.ndarray, aim: Aim) -> np.ndarray:
    """1 / (share x variance) of variances (..., M); 0 where infinite."""
    with np.errstate(divide="ignore"):
        return np.where(np.isfinite(variances), 1 / (variances * aim.shares), 0.0)


def glanced(
    scene: Scene, sensors: np.ndarray, lights: np.ndarray, model: str, aim: Aim, constraints: Constraints,
    report: Report,
) -> np.ndarray:  # fmt: skip
    """What every pair of sensors (S, 2) and lights (L, 2) tells of each quantity, shape (S, L, M); 0 if not allowed."""
    told = np.empty((len(sensors), len(lights), len(scene.quantities)))
    evaluate, size = variance_model(model), max(1, _AT_A_TIME // len(lights))
    for at in range(0, len(sensors), size):
        part = sensors[at : at + size]
        told[at : at + size] = information(
            evaluate(Pictures.of(scene, part[:, None], lights[None])).variances_object, aim
        )
        if constraints.on_pairs:
            allowed = constraints.pairs(scene, part[:, None], lights[None])
            told[at : at + size] *= allowed[..., None]
        report("pairs", min(at + size, len(sensors)), len(sensors))
    return told


class Pool:
    """Settings to choose from, rows of ``poses``; grows when a descent finds one beside them.

    Parameters
    ----------
    scene, model, aim
    poses : ndarray, shape (P, 4)
        Sensor and light, each polar angle and azimuth, degrees.
    told : ndarray, shape (P, M)
        What a glance tells (`information`).
    """

    def __init__(self, scene: Scene, model: str, aim: Aim, poses: np.ndarray, told: np.ndarray) -> None:
        self.scene, self.model, self.aim = scene, model, aim
        self.poses, self.told = poses, told
        self.closely: dict[int, Prediction] = {}  # of the rows looked at closely

    def look(self, row: int) -> None:
        """Look closely at a row, if it has not been done."""
        if row not in self.closely:
            sensor, light = (tuple(map(float, self.poses[row, part])) for part in (slice(0, 2), slice(2, 4)))
            self.closely[row] = predict(self.scene, sensor, light, self.model)

    def add(self, sensor: np.ndarray, light: np.ndarray, told: np.ndarray) -> int:
        """A further row; its number."""
        self.poses = np.concatenate([self.poses, np.concatenate([sensor, light])[None]])
        self.told = np.concatenate([self.told, told[None]])
        return len(self.poses) - 1

    @property
    def seen(self) -> np.ndarray:
        """Rows looked at closely, in their order."""
        return np.array(sorted(self.closely), int)

    def known(self) -> Information:
        """What the rows `seen` tell."""
        told = [self.closely[row].measurands for row in self.seen]
        values = information(np.array([[each.variance_object for each in row] for row in told]), self.aim)
        fine = np.array([[is_trusted(each.status) for each in row] for row in told])
        return Information(np.where(fine, values, 0.0), np.where(fine, 0.0, values), self.aim.over)

    def expected(self) -> Information:
        """What all rows tell: as seen closely, else as glanced at, cluttered as the nearest row that was seen is."""
        cluttered = np.zeros(self.told.shape, bool)
        seen = self.seen
        if len(seen):
            known = self.known()
            sensors, lights = direction(self.poses[:, :2]), direction(self.poses[:, 2:])
            cosine = np.minimum(sensors @ sensors[seen].T, lights @ lights[seen].T)
            nearest = cosine.argmax(1)
            beside = cosine[np.arange(len(cosine)), nearest] > np.cos(np.radians(_ALIKE))
            cluttered = (known.clutter > 0)[nearest] & beside[:, None]
        ok, clutter = np.where(cluttered, 0.0, self.told), np.where(cluttered, self.told, 0.0)
        if len(seen):
            ok[seen], clutter[seen] = known.ok, known.clutter
        return Information(ok, clutter, self.aim.over)
