"""The installation box: how far sensor and light may stand from their poses while U surely keeps what is asked."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.budgeting.budgets import budget
from planner.certifying.demand import Demand
from planner.certifying.within import Ranges, Told, Within
from planner.prediction import predict
from planner.search.objective import Report
from scenes import InvalidInput, Picture, Pose, Scene
from scenes.arrays import number
from scenes.status import WORST_FIRST, is_trusted

TUR = 4.0  # half the tolerance over U: what counts as precise enough
LARGEST = 30.0  # degrees: what is farther off is no error of installation
_LEAST = 1e-3  # degrees: less is no box
MOST_PAIRS = 50_000  # of cells, of each box that is tried: some seconds
_SHARES = (0.99, 0.97, 0.94, 0.88, 0.75, 0.5, 0.25, 0.1)  # of the least errors known to be too large, tried in turn
_TRIED = 200  # poses of a box that is tried, beside its corners and middles
_STEPS = 16  # of bisection
_SEED = 1


@dataclass(frozen=True)
class Limiting:
    """A pose that does not keep what is asked.

    Attributes
    ----------
    sensor, light : Pose
    why : str
        What is wrong there.
    """

    sensor: Pose
    light: Pose
    why: str


@dataclass(frozen=True)
class InstallationBox:
    """How far sensor and light may stand from their poses, all at once, so that U surely keeps what is asked.

    Attributes
    ----------
    picture : Picture
        With the poses in the middle.
    sensor_deg, light_deg : float
        Largest errors along the meridian and along the circle of latitude, each to both sides. Beside a pole the box
        holds all azimuths.
    k : float
        U is asked to be at most half of each tolerance zone over this.
    p : float
        Coverage probability of U.
    limits, U : tuple of float
        Of each measurand the largest U that may be, and what no U of the box is above, the scene's unit.
    share : float
        The errors over the least ones that are known to be too large; 1 where none are up to `LARGEST`.
    limited_by : Limiting or None
        A pose with these.
    pairs : int
        Pairs of cells of poses that were bounded.
    """

    picture: Picture
    sensor_deg: float
    light_deg: float
    k: float
    p: float
    limits: tuple[float, ...]
    U: tuple[float, ...]
    share: float
    limited_by: Limiting | None
    pairs: int

    @property
    def told(self) -> str:
        """In one sentence, without its end."""
        return (
            f"U is at most half the tolerance over {self.k:g} wherever the sensor stands within {self.sensor_deg:.3g} "
            f"and the light within {self.light_deg:.3g} degrees of these poses"
        )


def installation_box(
    scene: Scene | Picture,
    sensor: Any = None,
    light: Any = None,
    *,
    k: float = TUR,
    p: float = 0.95,
    most: int = MOST_PAIRS,
    report: Report | None = None,
) -> InstallationBox:
    """The largest errors of the poses of sensor and light within which U is proved to be small enough.

    U is that of `planner.budget` with the variances of the ``calibrated`` model, which what `measure.best_estimator`
    takes in such scenes is below. Everywhere in the box it is within its limit, and edges are seen, long enough, lit
    and within the sensor's scale: all of it is proved by upper bounds in cells of both poses (as `planner.certified`
    proves lower ones). The distances of sensor and light are the scene's. The errors of both are alike, or where
    ``[uncertainty]`` has ``sensor_deg`` and ``light_deg`` as these.

    Parameters
    ----------
    scene : Scene or Picture
    sensor, light : Pose or pair of float
        Polar angle and azimuth, degrees; not with a picture, which has its own.
    k : float
        Half of each tolerance zone over U.
    p : float
        Coverage probability of U.
    most : int
        Pairs of cells, of each box that is tried.

    Raises
    ------
    InvalidInput
        If there are no bounds of such a scene, a measurand has no tolerance, or U is too large at the poses themselves.

    Examples
    --------
    >>> import scenes
    >>> task1 = scenes.load("task1")
    >>> asked = task1.with_(task=task1.task.with_(tolerance=0.15))
    >>> box = installation_box(asked, (30, 135), (15, 315), k=2)
    >>> box.sensor_deg == box.light_deg, box.share > 0.9
    (True, True)
    """
    picture, k = Picture.of(scene, sensor, light), number(k, "k")
    if not k > 0:
        raise InvalidInput(f"k must be above 0, got {k:g}")
    if not 0 < number(p, "p") < 1:
        raise InvalidInput(f"p must be between 0 and 1, got {p:g}")
    limits = np.array([_half(quantity) for quantity in picture.scene.quantities]) / k
    search = _Search(picture, Demand.of(picture, limits, p), most, report or (lambda *_: None))
    told = search.run()
    U = np.sqrt(told.most) * limits
    shape, size, least = search.shape * search.size, search.size, search.too_large
    return InstallationBox(
        picture, float(shape[0]), float(shape[1]), k, p, tuple(limits.tolist()), tuple(U.tolist()),
        size / least if np.isfinite(least) else 1.0, search.limiting(), search.pairs,
    )  # fmt: skip


def _half(quantity) -> float:
    if quantity.tolerance is None:
        raise InvalidInput(f"tolerance must be given for each measurand for a box, got none for {quantity.name}")
    return quantity.tolerance.half


@dataclass
class _Search:
    """Of the largest box: by its size, degrees, of which ``shape`` makes both errors."""

    picture: Picture
    demand: Demand
    most: int
    report: Report
    too_large: float = np.inf
    against: np.ndarray | None = None
    size: float = 0.0
    pairs: int = 0

    def __post_init__(self) -> None:
        said = self.picture.scene.uncertainty
        ratio = [1.0 if told is None or told.u == 0 else told.u for told in (said.sensor_deg, said.light_deg)]
        ratio = [1.0, 1.0] if said.sensor_deg is None or said.light_deg is None else ratio
        self.shape = np.array(ratio) / max(ratio)
        (light,) = (self.picture.lights[which] for which in self.picture.scene.free)
        self.middle = np.array([*self.picture.sensor, *light], float)

    def run(self) -> Told:
        """From what poses that are tried leave, down to what can be proved."""
        self._check_middle()
        grid = np.array(list(product((-1.0, 0.0, 1.0), repeat=4)))
        self._bisect(np.concatenate([grid, np.random.default_rng(_SEED).uniform(-1, 1, (_TRIED, 4))]))
        steps = list(_SHARES)
        while steps and self.too_large > _LEAST:
            size = min(steps.pop(0) * self.too_large, LARGEST)
            told = Within(self.demand, *self.ranges(size)).proved(self.most, self.report)
            self.pairs += told.pairs
            if told.proved:
                self.size = size
                return told
            if told.against:
                self._excluded(np.concatenate(told.against)[None])
                steps = list(_SHARES)
        return Told(True, 0, self.demand.at(*self._split(self.middle[None]))[0][0])

    def ranges(self, size: float) -> tuple[Ranges, Ranges]:
        """Polar angles and azimuths of sensor and light of a box, degrees."""
        return self._range(0, size), self._range(1, size)

    def limiting(self) -> Limiting | None:
        """The pose that is known to be too far off, and why."""
        if self.against is None:
            return None
        sensor, light = (Pose(*map(float, self.against[part])) for part in (slice(0, 2), slice(2, 4)))
        return Limiting(sensor, light, _why(Picture.of(self.picture.scene, sensor, light), self.demand))

    def _range(self, role: int, size: float) -> Ranges:
        polar, azimuth = self.middle[2 * role : 2 * role + 2]
        off = size * self.shape[role]
        low, high = max(polar - off, 0.0), min(polar + off, 180.0)
        around = 180.0 if low == 0 or high == 180 else min(off / np.sin(np.radians(polar)), 180.0)
        return (low, high), (azimuth - around, azimuth + around)

    def _size(self, pose: np.ndarray) -> float:
        """The size of the least box that holds a pose (4,)."""
        found = []
        for role, off in enumerate(self.shape):
            polar, azimuth = self.middle[2 * role : 2 * role + 2]
            along, around = np.abs(pose[2 * role : 2 * role + 2] - [polar, azimuth])
            pole = min(polar, 180 - polar)
            found.append(max(along, min(around * np.sin(np.radians(polar)), pole)) / off)
        return float(max(found))

    def _at(self, offsets: np.ndarray, size: float) -> np.ndarray:
        """Poses (n, 4) of a box at offsets (n, 4) from -1 to 1."""
        ends = np.array(self.ranges(size)).reshape(4, 2)
        return ends[:, 0] + (offsets + 1) / 2 * (ends[:, 1] - ends[:, 0])

    def _split(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return poses[:, :2], poses[:, 2:]

    def _excluded(self, poses: np.ndarray) -> bool:
        """Whether one of poses (n, 4) does not keep the demand; boxes that hold it are then known to be too large."""
        wrong = poses[~self.demand.is_met(*self._split(poses))]
        if not len(wrong):
            return False
        sizes = [self._size(pose) for pose in wrong]
        least = int(np.argmin(sizes))
        if sizes[least] < self.too_large:
            self.too_large, self.against = sizes[least], wrong[least]
        return True

    def _bisect(self, offsets: np.ndarray) -> None:
        low = 0.0
        for step in range(_STEPS):
            size = LARGEST if step == 0 else (low + self.too_large) / 2
            if not self._excluded(self._at(offsets, size)):
                low = size
            if low >= min(self.too_large * (1 - 1e-3), LARGEST):
                return

    def _check_middle(self) -> None:
        if not self.demand.is_met(*self._split(self.middle[None]))[0]:
            raise InvalidInput(
                f"poses must keep what is asked before any error for a box, got {_why(self.picture, self.demand)}"
            )


def _why(picture: Picture, demand: Demand) -> str:
    """What is wrong in a picture: a status, or a U that is too large."""
    (light,) = (picture.lights[which] for which in picture.scene.free)
    poses = (np.array([list(pose)], float) for pose in (picture.sensor, light))
    for rank, each in zip(demand.at(*poses)[1][0], predict(picture).measurands, strict=True):
        if not is_trusted(WORST_FIRST[rank]):
            return f"{each.name} {WORST_FIRST[rank]}" + (f" ({each.reason})" if each.reason else "")
    noise = variance_model("calibrated")(Pictures.of(picture)).variances_object
    found = budget(picture, variances=noise, biased=False)
    U, limit, worst = max(((each.U, limit, each) for each, limit in zip(found, demand.limits, strict=True)),
                          key=lambda one: one[0] / one[1])  # fmt: skip
    return f"U of {worst.name} {U:.3g} {worst.unit}, above {limit:.3g}"
