"""The installation box: how far sensor and light may stand from their poses while U surely keeps what is asked."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.budgeting.budgets import budget
from planner.certifying.demand import Demand
from planner.certifying.pose_box import PoseBox
from planner.certifying.within import Pair, Told, Within
from planner.prediction import predict
from planner.search.objective import Report
from scenes import InvalidInput, Picture, Pose, Scene
from scenes.arrays import number
from scenes.status import WORST_FIRST, is_trusted

TUR = 4.0  # half the tolerance over U: what counts as precise enough
LARGEST = 30.0  # degrees: what is farther off is no error of installation
_LEAST = 1e-3 / LARGEST  # less is no box
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
    poses : PoseBox
        Those of which all is proved.
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
    poses: PoseBox
    k: float
    p: float
    limits: tuple[float, ...]
    U: tuple[float, ...]
    share: float
    limited_by: Limiting | None
    pairs: int

    @property
    def sensor_deg(self) -> float:
        """Largest error of the sensor along the meridian and, independently, along the circle of latitude."""
        return float(self.poses.off[0])

    @property
    def light_deg(self) -> float:
        """The same of the light."""
        return float(self.poses.off[1])

    @property
    def told(self) -> str:
        """In one sentence, without its end."""
        sensor, light = _down(self.sensor_deg), _down(self.light_deg)
        return (
            f"U is at most half the tolerance over {self.k:g} wherever the sensor stands within {sensor:g} degrees of "
            f"its pose and the light within {light:g} of its own"
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
    >>> box = installation_box(scenes.load("calibrated_rig"), (10, 60), (10, 25), k=7.6)
    >>> box.sensor_deg == box.light_deg > 0, box.U[0] <= box.limits[0], round(box.share, 2)
    (True, True, 0.99)
    """
    picture, k = Picture.of(scene, sensor, light), number(k, "k")
    if not k > 0:
        raise InvalidInput(f"k must be above 0, got {k:g}")
    if not 0 < number(p, "p") < 1:
        raise InvalidInput(f"p must be between 0 and 1, got {p:g}")
    limits = np.array([_half(quantity) for quantity in picture.scene.quantities]) / k
    demand = Demand.of(picture, limits, p)
    search = _Search.of(picture, demand, most, report or (lambda *_: None))
    if not demand.is_met(*search.whole.times(0.0).at(np.zeros((1, 4))))[0]:
        raise InvalidInput(f"poses must keep what is asked before any error for a box, got {_why(picture, demand)}")
    told = search.run()
    share = search.factor / search.too_large if search.against else 1.0
    return InstallationBox(
        picture, search.whole.times(search.factor), k, p, tuple(limits.tolist()),
        tuple((np.sqrt(told.most) * limits).tolist()), share, _limiting(picture.scene, demand, search.against),
        search.pairs,
    )  # fmt: skip


def _limiting(scene: Scene, demand: Demand, against: Pair | None) -> Limiting | None:
    if against is None:
        return None
    sensor, light = (Pose(*map(float, pose)) for pose in against)
    return Limiting(sensor, light, _why(Picture.of(scene, sensor, light), demand))


def _half(quantity) -> float:
    if quantity.tolerance is None:
        raise InvalidInput(f"tolerance must be given for each measurand for a box, got none for {quantity.name}")
    return quantity.tolerance.half


class _Search:
    """Of the largest box, so many times that of ``LARGEST``.

    Attributes
    ----------
    whole : PoseBox
    demand : Demand
    most : int
        Pairs of cells, of each box that is tried.
    factor, too_large : float
        Of the box that is proved, and of the least one that is known to hold a pose ``against`` it.
    pairs : int
        Pairs of cells that were bounded.
    """

    def __init__(self, whole: PoseBox, demand: Demand, most: int, report: Report) -> None:
        self.whole, self.demand, self.most, self.report = whole, demand, most, report
        self.factor, self.too_large, self.pairs = 0.0, np.inf, 0
        self.against: Pair | None = None

    @classmethod
    def of(cls, picture: Picture, demand: Demand, most: int, report: Report) -> _Search:
        """About a picture's poses, errors of both alike or as the scene has them."""
        said = (picture.scene.uncertainty.sensor_deg, picture.scene.uncertainty.light_deg)
        off = np.array([0.0 if told is None else told.u for told in said])
        off = off / off.max() if off.all() else np.ones(2)
        (light,) = (picture.lights[which] for which in picture.scene.free)
        return cls(PoseBox(np.array([*picture.sensor, *light], float), LARGEST * off), demand, most, report)

    def run(self) -> Told:
        """From what poses that are tried leave, down to what can be proved."""
        grid = np.array(list(product((-1.0, 0.0, 1.0), repeat=4)))
        self._bisect(np.concatenate([grid, np.random.default_rng(_SEED).uniform(-1, 1, (_TRIED, 4))]))
        shares = list(_SHARES)
        while shares and self.too_large > _LEAST:
            factor = min(shares.pop(0) * self.too_large, 1.0)
            told = Within(self.demand, *self.whole.times(factor).ranges).proved(self.most, self.report)
            self.pairs += told.pairs
            if told.proved:
                self.factor = factor
                return told
            if told.against:
                self._excluded(*(pose[None] for pose in told.against))
                shares = list(_SHARES)
        u2, _ = self.demand.at(*self.whole.times(0.0).at(np.zeros((1, 4))))
        return Told(True, 0, u2[0])

    def _excluded(self, sensors: np.ndarray, lights: np.ndarray) -> bool:
        """Whether one of poses (n, 2), (n, 2) does not keep the demand; boxes that hold it are then too large."""
        wrong = np.flatnonzero(~self.demand.is_met(sensors, lights))
        if not len(wrong):
            return False
        factors = self.whole.factors(sensors[wrong], lights[wrong])
        least = int(np.argmin(factors))
        if factors[least] < self.too_large:
            self.too_large, self.against = float(factors[least]), (sensors[wrong[least]], lights[wrong[least]])
        return True

    def _bisect(self, offsets: np.ndarray) -> None:
        """Between the largest box of which poses at all offsets keep the demand and one of which they do not."""
        low = 0.0
        for step in range(_STEPS):
            factor = 1.0 if step == 0 else (low + self.too_large) / 2
            if not self._excluded(*self.whole.times(factor).at(offsets)):
                low = factor
            if low >= min(self.too_large * (1 - 1e-3), 1.0):
                return


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
    return f"U of {worst.name} {U:.3g} {worst.unit}, {100 * (U / limit - 1):.2g} % above what is asked"


def _down(angle: float) -> float:
    """With three digits, and no larger: what is printed is proved, too.

    >>> _down(4.6299), _down(0.0)
    (4.62, 0.0)
    """
    if angle == 0:
        return 0.0
    digits = 2 - math.floor(math.log10(angle))
    return math.floor(angle * 10**digits) / 10**digits
