"""Several lights that share a given total: where they stand, which are on, and with what share.

Light adds up: with c_l the contrast along an edge under light l alone with all of the total, it is sum_l share_l c_l
under all of them, and the variance of a line is the sum of a sensor's weights over squared contrasts
(`models.calibrated`, long edges). So one evaluation of each light's place tells of all their combinations. What no
mixture can exceed is the greatest contrast of any single place, which bounds a sensor from below: only sensors whose
bound is below the best value known are evaluated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from imaging.features.locator import MIN_CONTRAST
from imaging.features.measurand import measurands
from imaging.features.projected_edges import lines_alone
from imaging.geometry.projection import edge_points
from imaging.light.edge_sides import of_sides, side_signals
from imaging.models.along import NODE_WEIGHTS, EdgeNodes, place_nodes
from imaging.models.calibrated import line_slope, line_weight, long_edge, point_variance
from imaging.models.strong import ROUGH
from imaging.pictures import Pictures
from imaging.sensor import headroom
from planner.search.exhaustive import BestPair
from planner.search.grid import Grid, by_light
from planner.search.objective import Report, SearchProblem
from scenes import Scene

_STEP = 0.1  # between shares
Shares = tuple[tuple[float, ...], ...]


def with_shares(scene: Scene, shares: tuple[float, ...]) -> Scene:
    """The scene whose lights have shares of the sum of their intensities."""
    total = sum(light.intensity for light in scene.lights)
    lights = [light.model_copy(update={"intensity": s * total}) for light, s in zip(scene.lights, shares, strict=True)]
    return scene.lit_by(*lights)


def shares_of(scene: Scene) -> tuple[float, ...]:
    """Shares that a scene's lights have of the sum of their intensities."""
    total = sum(light.intensity for light in scene.lights)
    return tuple(light.intensity / total for light in scene.lights)


def shares_of_two(scene: Scene) -> tuple[tuple[float, float], ...]:
    """Shares of two lights in tenths; lights that are alike may change places, so the first has at most half."""
    one, two = (light.model_copy(update={"intensity": 1.0}) for light in scene.lights)
    count = round(1 / _STEP)
    most = count // 2 if one == two and one.mount == "free" else count
    return tuple((i / count, 1 - i / count) for i in range(most + 1))


_EXACT = 32  # sensors whose best combination is evaluated exactly
BETTER = 1 - 1e-9  # than which a value must be less to be better
_AT_ONCE = 1 << 21  # contrasts in memory
_ENDS = 0.85  # of a line's first-order variance, at most, is what its ends are trusted to leave, and less of ...
_UNEVEN = 2.0  # ... a short one: they are taken to take so many times as much as at even contrast


class Mixture(NamedTuple):
    """A setting of several lights: what is minimised, shares, sensor (2,) and lights (2 F,)."""

    value: float
    shares: tuple[float, ...]
    sensor: np.ndarray
    lights: np.ndarray


@dataclass(frozen=True, eq=False)
class Shared:
    """The best lights for each sensor.

    Attributes
    ----------
    scene : Scene
        Its lights with the best shares as their intensities.
    lights : ndarray, shape (S, 2 F)
        Poses of the free lights that are best for each sensor with these shares.
    found : BestPair
        The best sensor; its lights are those of the same number.
    alone : Mixture or None
        The best where one light has all; None where that was not asked.
    """

    scene: Scene
    lights: np.ndarray
    found: BestPair
    alone: Mixture | None


def applies(scene: Scene, model: str) -> bool:
    """Whether contrasts of single lights tell of mixtures: the calibrated model, straight edges, two lights, and a part
    whose place is known."""
    return scene.placement.is_known and model == "calibrated" and lines_alone(scene) and len(scene.lights) == 2


def best_lights(problem: SearchProblem, grid: Grid, shares: str, report: Report) -> Shared:
    """Several lights at once, or one after the other where their contrasts do not tell of mixtures.

    The ``best`` shares of two lights in tenths, else those that the scene gives.
    """
    scene = problem.scene
    mixed = shares_of_two(scene) if shares == "best" and len(scene.lights) == 2 else (shares_of(scene),)
    search = search_shared if applies(scene, problem.model) else by_turns
    return search(problem, grid.sensors, grid.lights, mixed, report)


def search_shared(
    problem: SearchProblem, sensors: np.ndarray, places: np.ndarray, shares: Shares, report: Report
) -> Shared:
    """Search all sensors (S, 2), all places (L, 2) of each free light, and shares of two lights.

    Places that a light may not have beside a sensor are left out one by one (`Constraints.pairs`).
    """
    seen = _Contrasts(problem, places)
    bounds = np.array([seen.bound(sensor) for sensor in sensors])
    order = np.argsort(bounds)
    best, chosen, alone = np.inf, shares[0], None
    for done, s in enumerate(order.tolist()):
        report("weighing lights", done + 1, 2 * len(sensors))
        if not bounds[s] <= best:
            break
        known = seen.of_sensor(sensors[s])
        for share in shares:
            value, lights = seen.best(known, share)
            if max(share) == 1 and np.isfinite(value) and (alone is None or value < alone.value):
                alone = Mixture(value, share, sensors[s], lights)
            if value < best * BETTER:
                best, chosen = value, share
    lights, least = np.zeros((len(sensors), 2 * len(problem.scene.free))), np.full(len(sensors), np.inf)
    for done, s in enumerate(order.tolist()):
        report("weighing lights", len(sensors) + done + 1, 2 * len(sensors))
        if not np.isfinite(bounds[s]):
            break
        if bounds[s] <= 16 * best:  # beyond there is no candidate
            least[s], lights[s] = seen.best(seen.of_sensor(sensors[s]), chosen)
    first = np.argsort(least)[:_EXACT]
    first = first[np.isfinite(least[first])]
    mixed = replace(problem, scene=with_shares(problem.scene, chosen))
    if len(first):
        least[first] = mixed.values(sensors[first], lights[first])
    return _shared(mixed.scene, lights, least, (len(sensors) * seen.combinations, len(first), True), alone)


def _shared(
    scene: Scene, lights: np.ndarray, least: np.ndarray, known: tuple[int, int, bool], alone: Mixture | None
) -> Shared:
    """The result, from pairs, how many of them were evaluated, and whether none is better."""
    best, (pairs, evaluated, guaranteed) = int(least.argmin()), known
    which = np.where(np.isfinite(least), np.arange(len(least)), -1)
    found = BestPair(best, best, float(least[best]), pairs, evaluated, which, least, guaranteed)
    return Shared(scene, lights, found, alone)


class _Contrasts:
    """Contrasts of a scene's edges under each light alone, from each of its places."""

    def __init__(self, problem: SearchProblem, places: np.ndarray) -> None:
        self.problem, self.scene, self.aim = problem, problem.scene, problem.objective
        scene = problem.scene
        total = sum(light.intensity for light in scene.lights)
        whole = [light.model_copy(update={"intensity": total}) for light in scene.lights]
        self.lone = [scene.lit_by(light) for light in whole]
        self.places = [places if light.mount == "free" else np.zeros((1, 0)) for light in scene.lights]
        self.combinations = int(np.prod([len(each) for each in self.places]))

    def of_sensor(self, sensor: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]] | None:
        """Weights (2, M, E, n) of 1 / C^2, and signals (L, E, 2, n) under each light; None where nothing is seen."""
        alone = Pictures(self.scene, sensor, tuple(np.zeros(2) for _ in self.scene.lights))
        known = measurands(alone)
        if not known.view.visible.all():
            return None
        nodes = place_nodes(alone, known.view, known.view.framed)
        gradient = known.gradient if self.aim.unit == "image" else known.gradient_object
        offset, tilt = known.of_lines(gradient)
        weights = [self._weights(nodes, a, b) for a, b in zip(offset, tilt, strict=True)]
        points = edge_points(self.scene.solid, known.view.names, nodes.spatial)
        return np.stack(weights, 1), [
            self._signals(scene, sensor, places, known.view.names, points)
            for scene, places in zip(self.lone, self.places, strict=True)
        ]

    def _weights(self, nodes: EdgeNodes, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Of 1 / C^2 at the nodes, (2, E, n): of a long edge, and to first order, which is never negative."""
        scale = self.scene.locator.scale_px
        weight, point = line_weight(nodes, a, b), point_variance(nodes, scale)
        whole = long_edge(nodes, weight, line_slope(nodes, a, b), scale)
        inside = np.concatenate([[0], NODE_WEIGHTS, [0]]) * nodes.length / 2
        return np.stack([whole, 2 * np.sqrt(np.pi) * scale / nodes.along * inside * weight**2]) * point

    def _signals(self, scene: Scene, sensor, places, names, points) -> np.ndarray:
        """Under one light from its places; NaN where it may not stand."""
        pictures = Pictures.of(scene, np.broadcast_to(sensor, (len(places), 2)), by_light(places))
        found = side_signals(pictures, names, np.broadcast_to(points, (len(places), *points.shape)))
        if places.shape[1]:
            allowed = self.problem.constraints.pairs(scene, sensor, places)
            found = np.where(allowed[:, None, None, None], found, np.nan)
        return found

    def bound(self, sensor: np.ndarray) -> float:
        """What no mixture of the lights can be below."""
        known = self.of_sensor(sensor)
        if known is None:
            return np.inf
        weights, signals = known
        with np.errstate(all="ignore"):
            most = [np.nanmax(np.abs(part[..., 0, :] - part[..., 1, :]), 0, initial=0.0) for part in signals]
            ratio = self.scene.noise.variance / np.maximum(*most) ** 2
            first = np.where(weights[1] > 0, weights[1] * ratio, 0.0).sum(-1)
            left = 1 - _UNEVEN * (1 - weights[0].sum(-1) / weights[1].sum(-1))
            least = float(self.aim(np.where(first > 0, np.clip(left, 0, _ENDS) * first, 0.0).sum(-1)))
        return least if np.isfinite(least) else np.inf

    def best(self, known: tuple | None, share: tuple[float, float]) -> tuple[float, np.ndarray]:
        """The least of what is minimised under mixtures with these shares, and the free lights' poses (2 F,).

        ``known`` is what `of_sensor` gives of the sensor.
        """
        if known is None:
            return np.inf, np.zeros(2 * len(self.scene.free))
        value, at = np.inf, (0, 0)
        for rows, mixed in _mixtures(*known[1], share):
            with np.errstate(all="ignore"):
                squared, noise = self._contrast(mixed)
                values = self.aim(_variances(known[0], squared, noise))
            k = np.unravel_index(values.argmin(), values.shape)
            if values[k] < value:
                value, at = float(values[k]), (rows + int(k[0]), int(k[1]))
        if min(share) == 0 and len(self.scene.free) == 2:
            at = (max(at), max(at))  # one that is off stands where the other does
        chosen = [places[i] for places, i in zip(self.places, at, strict=True)]
        return value, np.concatenate(chosen)

    def _contrast(self, mixed: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
        """Squared recorded contrast and noise of signals (..., E, 2, n)."""
        noise = self.scene.noise
        if noise.gain == 0 and not np.nanmax(mixed, initial=0.0) > headroom(noise):
            return (mixed[..., 0, :] - mixed[..., 1, :]) ** 2, noise.variance
        found = of_sides(self.scene, np.where(np.isnan(mixed), 0.0, mixed))
        return np.where(np.isnan(mixed[..., 0, :]), 0.0, found.squared), found.noise_variance


def _variances(weights: np.ndarray, squared: np.ndarray, noise: np.ndarray | float) -> np.ndarray:
    """Of quantities, (..., M), from weights (2, M, E, n) and squared contrasts (..., E, n); infinite if too faint.

    To first order where the contrast changes much along an edge, as `calibrated` takes it.
    """
    inner, ratio = squared[..., 1:-1], noise / squared
    ratio[..., [0, -1]] = np.where(np.isfinite(ratio[..., [0, -1]]), ratio[..., [0, -1]], 0.0)
    whole = np.einsum("men,...en->...em", weights[0], ratio)
    first = np.einsum("men,...en->...em", weights[1][..., 1:-1], ratio[..., 1:-1])
    rough = squared.max(-1) > ROUGH * squared.min(-1)
    faint = (inner / noise if np.ndim(noise) == 0 else inner / noise[..., 1:-1]).mean(-1) < MIN_CONTRAST**2
    each = np.where(rough[..., None] | (whole < 0), first, whole)
    values = np.where(faint[..., None], np.inf, each).sum(-2)
    return np.where(np.isnan(values), np.inf, values)


def _mixtures(one: np.ndarray, two: np.ndarray, share: tuple[float, float]) -> Iterator[tuple[int, np.ndarray]]:
    """First row and signals (rows, L', E, 2, n) of all combinations of two lights, some at a time."""
    size = max(1, _AT_ONCE // max(two.size, 1))
    if share[1] == 0:  # one that is off may stand anywhere
        yield 0, one[:, None]
        return
    if share[0] == 0:
        yield 0, two[None]
        return
    for first in range(0, len(one), size):
        yield first, share[0] * one[first : first + size, None] + share[1] * two


def by_turns(problem: SearchProblem, sensors: np.ndarray, places: np.ndarray, shares: Shares, report: Report) -> Shared:
    """Coordinate search: the sensor, each free light and the shares in turn take the best of all their candidates.

    No guarantee, for whatever a mixture of contrasts does not tell of. Begins from the best of a coarse sample with all
    lights at one place: with the first and the last of the shares, and those in the middle.
    """
    starts = dict.fromkeys((shares[0], shares[len(shares) // 2], shares[-1]))
    turns = _Turns(problem, sensors, places if problem.scene.free else np.zeros((1, 0)), shares)
    ends = []
    for done, share in enumerate(starts):
        report("turning poses", done, len(starts))
        ends.append(turns.run(share))
    report("turning poses", len(starts), len(starts))
    best = min(ends, key=_value)
    alone = [end for end in turns.alone if np.isfinite(end.value)]
    lights, mixed = np.tile(best.lights, (len(sensors), 1)), turns.mixed(best.shares)
    least, count = mixed.feasible_values(sensors, lights), turns.evaluated
    return _shared(mixed.scene, lights, least, (count, count, False), min(alone, key=_value) if alone else None)


def _value(setting: Mixture) -> float:
    return setting.value


class _Turns:
    """Moves one thing at a time; remembers where one light had all."""

    def __init__(self, problem: SearchProblem, sensors: np.ndarray, places: np.ndarray, shares: Shares) -> None:
        self.problem, self.sensors, self.places, self.shares = problem, sensors, places, shares
        self.evaluated, self.alone = 0, []

    def mixed(self, share: tuple[float, ...]) -> SearchProblem:
        return replace(self.problem, scene=with_shares(self.problem.scene, share))

    def _best(self, share: tuple[float, ...], sensors: np.ndarray, lights: np.ndarray) -> Mixture:
        """The best of pairs (n, 2), (n, 2 F)."""
        self.evaluated += len(sensors)
        values = self.mixed(share).feasible_values(sensors, lights)
        at = int(values.argmin())
        return Mixture(float(values[at]), share, sensors[at], lights[at])

    def run(self, share: tuple[float, ...]) -> Mixture:
        """Where it stops."""
        some = [poses[:: max(1, len(poses) // 40)] for poses in (self.sensors, self.places)]
        sensors = np.repeat(some[0], len(some[1]), 0)
        lights = np.tile(some[1], (len(some[0]), max(1, len(self.problem.scene.free))))
        here, before = self._best(share, sensors, lights), np.inf
        while here.value < before:
            before = here.value
            for role in range(len(self.problem.scene.free) + 1):
                here = _better(here, self._moved(here, role))
            for other in self.shares:
                here = _better(here, self._best(other, here.sensor[None], here.lights[None]))
            if max(here.shares) == 1 and len(here.shares) > 1:
                self.alone.append(here)
        return here

    def _moved(self, here: Mixture, role: int) -> Mixture:
        """With the sensor (0) or a free light (1, ...) at the best of its candidates."""
        tried = self.sensors if role == 0 else self.places
        sensors, lights = np.tile(here.sensor, (len(tried), 1)), np.tile(here.lights, (len(tried), 1))
        (sensors if role == 0 else lights[:, 2 * role - 2 : 2 * role])[:] = tried
        return self._best(here.shares, sensors, lights)


def _better(one: Mixture, other: Mixture) -> Mixture:
    """The other where it is clearly better."""
    return other if other.value < one.value * BETTER else one
