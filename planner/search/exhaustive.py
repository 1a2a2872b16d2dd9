"""The best of all sensor x light pairs, by branch and bound where there is a bound.

On a convex diffuse solid a lower bound of the variances of all pairs is one matrix product a quantity: an edge's
contrast is K / r (or K / r^3 with fall-off), where K depends on the light and on which faces the sensor sees, r on the
light and the place along the edge. For the paper's model the line's variance is a convex function of the weights
K^2 / r^2, so it lies above its tangent at equal weights, which is linear in 1 / r^2. The calibrated model is linear in
r^6 itself, and with shot noise in r^3, too. All are then, edge by edge, a sum of products (sensor) x (light).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from imaging.features.locator import MIN_USABLE
from imaging.features.measurand import Measurands, measurands
from imaging.features.projected_edges import image_fractions, lines_alone
from imaging.features.rim_sides import RIM_POINTS, seen_along
from imaging.geometry.projection import facing
from imaging.light.appearance import is_separable
from imaging.light.edge_sides import edge_distance2, of_sides, paper_step, side_strengths
from imaging.models.along import EdgeNodes, place_nodes
from imaging.models.calibrated import (
    SHORT,
    line_slope,
    line_weight,
    long_edge,
    point_products,
    point_variance,
    to_points,
)
from imaging.models.paper import PAPER_KAPPA2, PAPER_POINTS
from imaging.pictures import Pictures
from imaging.sensor import headroom, shot_noise
from planner.constraints import Constraints
from planner.search.objective import Aim, Report, SearchProblem, cut_off, minimised
from planner.search.pair_bounds import PairBounds, has_pair_bounds
from scenes import Circle, Scene

_ROWS = 256  # sensors at a time
_PAIRS = 1 << 16  # pairs evaluated exactly at a time
_SENSORS, _FIRST = 16, 8  # sensors that are settled at a time, and lights that are tried first with each
_LIGHTS = 1024  # evaluated with them at a time
DEAREST = 4.0  # times the least variance that is paid for trust: standard deviations are twice as large
_DEGREE = 7  # of the interpolation along an edge: exact for r^6, and about 1e-9 for the smooth functions here
_MARGIN = 3e-6  # relative; single precision in sums of about 30 terms of like size


@dataclass(frozen=True, eq=False)
class BestPair:
    """The best pair of a search.

    Attributes
    ----------
    sensor, light : int
        Indices into the poses searched; -1 where no pair can measure.
    variance : float
        What is minimised (`Aim`).
    pairs : int
        How many pairs were covered, and ...
    evaluated : int
        ... how many of them had to be evaluated one by one; the others are excluded by a lower bound.
    best_light : ndarray of int, shape (S,)
        For each sensor a light that is best or nearly so; -1 where none can measure.
    least : ndarray, shape (S,)
        Lower bound of the variance for each sensor (the variance itself where no bound exists).
    guaranteed : bool
        Whether no other pair of the grid is better, or ...
    within_scale : bool
        ... no other one whose levels the end of the scale does not cut off.
    """

    sensor: int
    light: int
    variance: float
    pairs: int
    evaluated: int
    best_light: np.ndarray
    least: np.ndarray
    guaranteed: bool
    within_scale: bool = False


def has_bound(scene: Scene, model: str) -> bool:
    """Whether the fast search applies: a separable scene, straight edges only, a known place, a linear sensor."""
    placed = scene.placement.is_known and not scene.noise.excess
    return placed and is_separable(scene) and lines_alone(scene) and model in ("paper", "calibrated")


def exhaustive(
    scene: Scene, sensors: np.ndarray, lights: np.ndarray, model: str, objective: str | Aim,
    constraints: Constraints | None = None, report: Report | None = None,
) -> BestPair:  # fmt: skip
    """Search all pairs of sensors (S, 2) and lights (L, 2 F), degrees; F lights are free: `best_pair`."""
    return best_pair(
        SearchProblem.of(scene, model, objective, constraints), sensors, lights, report or (lambda *_: None)
    )


def best_pair(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, report: Report) -> BestPair:
    """The best of all pairs of sensors (S, 2) and lights (L, 2 F), degrees; F lights are free.

    For a convex diffuse solid a rigorous lower bound of every pair is one matrix product; only pairs whose bound does
    not exceed the best variance known are evaluated. So it is, by a bound that is less near, of other parts of plane
    faces under points of light (`pair_bounds`). Otherwise every pair is evaluated.
    """
    search = _best_first if has_pair_bounds(problem.scene, problem.model) else _one_by_one
    search = _by_bound if has_bound(problem.scene, problem.model) else search
    return search(problem, sensors, lights, report)


def _by_bound(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, report: Report) -> BestPair:
    """Of all pairs; where the end of the scale cuts off levels by the best, of those by which no level is near it."""
    found = _bounded(problem, sensors, lights, report, within_scale=False)
    if found.sensor < 0 or not problem.cuts_off(sensors[found.sensor], lights[found.light]):
        return found
    within = _bounded(problem, sensors, lights, report, within_scale=True)
    return found if within.sensor < 0 else replace(within, within_scale=True)


def _bounded(
    problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, report: Report, *, within_scale: bool
) -> BestPair:
    table = separable(problem.scene, sensors, lights, problem.model, problem.objective, within_scale=within_scale)
    least, column = np.full(len(sensors), np.inf), np.full(len(sensors), -1)
    done, whole = 0, 2 * len(table.sensors)
    for rows, which, bound in _blocks(table, problem, sensors, lights):
        lowest = bound.argmin(1)
        least[table.sensors[rows]] = bound[np.arange(len(rows)), lowest]
        column[table.sensors[rows]] = which[lowest]
        done += len(rows)
        report("bounding all pairs", done, whole)
    column[~np.isfinite(least)] = -1
    order = np.argsort(least)[: max(256, len(least) // 64)]
    order = order[np.isfinite(least[order])]
    best = _better(_NONE, order, column[order], problem.values(sensors[order], lights[column[order]]))
    evaluated = len(order)
    for rows, which, bound in _blocks(table, problem, sensors, lights, least <= best[0]):
        hit = np.argwhere(bound <= best[0])
        for at in range(0, len(hit), _PAIRS):
            some = hit[at : at + _PAIRS]
            s, k = table.sensors[rows[some[:, 0]]], which[some[:, 1]]
            best = _better(best, s, k, problem.values(sensors[s], lights[k]))
        evaluated += len(hit)
        done += len(rows)
        report("evaluating what is left", done, whole)
    variance, *pair = best
    return BestPair(*pair, variance, len(sensors) * len(lights), evaluated, column, least, guaranteed=True)


def _blocks(
    table: Separable, problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, wanted: np.ndarray | None = None
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Blocks (rows into table.sensors, indices of lights, bounds) of all pairs, or of the wanted sensors only."""
    for which in range(len(table.strength)):
        rows, columns, matrix = table.of_class(which)
        if wanted is not None:
            rows = rows[wanted[table.sensors[rows]]]
        if not len(columns):
            continue
        for at in range(0, len(rows), _ROWS):
            block = rows[at : at + _ROWS]
            allowed = problem.feasible(sensors[table.sensors[block]][:, None], lights[columns][None])
            bound = table.rows(block, matrix)
            yield block, columns, bound if allowed.ndim == 0 else np.where(allowed, bound, np.inf)


def _one_by_one(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, report: Report) -> BestPair:
    least, column = (np.full((2, len(sensors)), value) for value in (np.inf, -1))  # of all pairs, and of those within
    seeing = np.flatnonzero(_seeing(problem.scene, sensors))
    for part, errors, allowed in problem.table(sensors[seeing], lights, report):
        values = np.where(allowed, minimised(errors, problem.objective), np.inf)
        for k, some in enumerate((values, np.where(cut_off(errors), np.inf, values))):
            column[k, seeing[part]] = some.argmin(1)
            least[k, seeing[part]] = some.min(1)
    pairs = len(sensors) * len(lights)
    return _chosen(least, column, pairs, pairs)


def _chosen(least: np.ndarray, column: np.ndarray, pairs: int, evaluated: int) -> BestPair:
    """The best pair from what each sensor can do, and by which light: with all, and with those within the scale, which
    are taken if there are any; (2, S) each."""
    within = bool(np.isfinite(least[1]).any())
    spared = within and bool((least[1] > least[0]).any())
    column, least = column[int(within)].astype(int), least[int(within)]
    column[~np.isfinite(least)] = -1
    variance, *pair = _better(_NONE, np.arange(len(least)), column, least)
    return BestPair(*pair, variance, pairs, evaluated, column, least, guaranteed=True, within_scale=spared)


def _best_first(problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, report: Report) -> BestPair:
    """As pair by pair, but for pairs that bounds exclude: of sensors beyond `DEAREST` the least is a bound."""
    bounds = PairBounds.of(problem, sensors, lights)
    least, column = np.full((2, len(sensors)), np.inf), np.full((2, len(sensors)), -1)
    for part, bound in bounds.blocks(np.arange(len(sensors)), 0.0):
        least[:, part], column[:, part] = bound.min(1), bound.argmin(1)
    order, evaluated = np.argsort(least[0], kind="stable"), 0
    order = order[np.isfinite(least[0, order])]
    for at in range(0, len(order), _SENSORS):
        far = DEAREST * least[1, order[:at]].min(initial=np.inf)
        rows = order[at : at + _SENSORS]
        if not least[1, rows[0]] <= far:
            break
        told, asked = _settled(problem, sensors[rows], lights, bounds.rows(rows, far), far)
        least[:, rows], column[:, rows] = told.min(-1), told.argmin(-1)
        evaluated += asked
        report("evaluating pairs", at + len(rows), len(order))
    report("evaluating pairs", len(order), len(order))
    return _chosen(least, column, len(sensors) * len(lights), evaluated)


def _settled(
    problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, bound: np.ndarray, far: float
) -> tuple[np.ndarray, int]:
    """What is minimised by sensors (n, 2) and lights, of all pairs and of those within the scale, (2, n, L): evaluated
    where a bound is neither above the least of its sensor nor ``far``, else the bound; and how many were evaluated.

    Lights that are asked for with one of the sensors are evaluated with all, which takes less time than pairs do.
    """
    told, asked = np.stack([bound, bound]).astype(float), np.zeros(bound.shape[1], bool)
    first = np.argpartition(bound, min(_FIRST, bound.shape[1] - 1), 1)[:, :_FIRST]
    wanted = np.zeros(bound.shape, bool)
    np.put_along_axis(wanted, first, True, 1)
    for _ in range(2):
        some = np.flatnonzero((wanted & (bound <= far) & np.isfinite(bound)).any(0) & ~asked)
        for at in range(0, len(some), _LIGHTS):
            columns = some[at : at + _LIGHTS]
            errors = problem.errors(sensors[:, None], lights[None, columns])
            values = np.where(np.isfinite(bound[:, columns]), minimised(errors, problem.objective), np.inf)
            told[:, :, columns] = values, np.where(cut_off(errors), np.inf, values)
        asked[some] = True
        known = np.where(asked, told[1], np.inf).min(1, keepdims=True)
        wanted = bound <= known
    return told, int(asked.sum() * len(sensors))


def _seeing(scene: Scene, sensors: np.ndarray) -> np.ndarray:
    """Which sensors (S, 2) see something of every edge and circle that is needed, bool (S,): the others measure with no
    light at all."""
    pictures = Pictures.of(scene, sensors)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        known = measurands(pictures)
        needed = known.depends().any(0)
        edges = len(known.view.names)
        seen = (known.view.visible | ~needed[:edges]).all(-1)
        for name, asked in zip(known.circles, needed[edges:], strict=True):
            circle = scene.solid.round(name)
            if asked and isinstance(circle, Circle):
                seen &= seen_along(pictures, circle, circle.angles(RIM_POINTS)).any(-1)
    return seen


_NONE = np.inf, -1, -1


def _better(best: tuple[float, int, int], sensors: np.ndarray, lights: np.ndarray, values: np.ndarray):
    """The best pair known (value, sensor, light), or the best of some others where that is better."""
    if not len(values) or not values.min() < best[0]:
        return best
    k = int(values.argmin())
    return float(values[k]), int(sensors[k]), int(lights[k])


@dataclass(frozen=True, eq=False)
class Separable:
    """Lower bound of what is minimised: the most, or the sum, over the quantities m of the sums over k of
    sensor_part[s, m, k] light_part[l, k] strength[class of s, l, kind of k].

    Attributes
    ----------
    sensors : ndarray of int, shape (S,)
        Indices of the sensors that can measure at all.
    classes : ndarray of int, shape (S,)
        Which set of faces each of them sees.
    sensor_part : ndarray, shape (S, M, E, k)
        Weighted with the share of each quantity in what is minimised.
    light_part : ndarray, shape (L, E, k)
        The k are in equal parts of the kinds of strength.
    strength : ndarray, shape (classes, L, E, kinds)
        What an edge's contrast makes of them; 0 where there is none.
    aim : Aim
        What is minimised.
    """

    sensors: np.ndarray
    classes: np.ndarray
    sensor_part: np.ndarray
    light_part: np.ndarray
    strength: np.ndarray
    aim: Aim

    def of_class(self, which: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Indices of sensors (into `sensors`) and lights that see contrast on all edges, and the lights' matrix."""
        strength = self.strength[which]
        lights = np.flatnonzero((strength[..., 0] > 0).all(-1))
        part = self.light_part[lights].reshape(*strength[lights].shape, -1) * strength[lights][..., None]
        part = part.reshape(len(lights), -1)
        return np.flatnonzero(self.classes == which), lights, np.ascontiguousarray(part.T, np.float32)

    def rows(self, which: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """Bound for some sensors (indices into `sensors`) and the matrix of `of_class`, single precision."""
        part = self.sensor_part[which].astype(np.float32)
        bounds = (part[:, m].reshape(len(part), -1) @ lights for m in range(part.shape[1]))
        return self.aim.joined(bounds)


def separable(
    scene: Scene, sensors: np.ndarray, lights: np.ndarray, model: str, aim: Aim | str, *, within_scale: bool = False
) -> Separable:
    """Set up the bound for a separable scene and quantities of straight edges.

    Parameters
    ----------
    sensors, lights : ndarray, shape (n, 2), (m, 2)
        Poses, degrees.
    model : {"paper", "calibrated"}
    aim : Aim, or objective of one quantity
    within_scale : bool
        Whether lights that bring a level near the end of the scale are left out.
    """
    pictures, aim = Pictures.of(scene, sensors), Aim.of(scene.quantities, aim)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        known = measurands(pictures)
        make = _paper if model == "paper" else _calibrated
        gradient = known.gradient if aim.unit == "image" else known.gradient_object
        sensor_part, good = make(pictures, known, *known.of_lines(gradient))
        sensor_part = sensor_part * aim.shares[:, None, None]
    good &= known.view.visible.all(-1) & np.isfinite(sensor_part).all((-1, -2, -3))
    light_part = _light_part(scene, known.view.names, lights, model)
    slack = 1 - _MARGIN * np.sign(sensor_part * light_part.mean(0))  # less where it adds, more where it takes away
    seen = facing(scene.solid, pictures.viewpoint[good])
    kinds, classes = np.unique(seen, axis=0, return_inverse=True)
    first = [int(np.flatnonzero(good)[np.argmax(classes == k)]) for k in range(len(kinds))]
    strength = [_strengths(scene, known.view.names, sensors[k], lights, model, within_scale) for k in first]
    return Separable(
        np.flatnonzero(good), classes.ravel(), (sensor_part * slack)[good], light_part, np.array(strength), aim
    )  # fmt: skip


def _strengths(
    scene: Scene, names: tuple[str, ...], sensor: np.ndarray, lights: np.ndarray, model: str, within_scale: bool
) -> np.ndarray:
    """1 / K^2 of each edge and, for the calibrated model, (K_1 + K_2) / K^2 / 2: shape (L, E, 1 or 2), 0 for none.

    With K_1 / r^3 and K_2 / r^3 the sides' signals, K their difference, the noise over the squared contrast is
    sigma^2 r^6 / K^2 + gain (K_1 + K_2) / 2 r^3 / K^2, times what the end of the scale makes of it.
    """
    pictures = Pictures.of(scene, sensor, lights)
    with np.errstate(divide="ignore", invalid="ignore"):
        if model == "paper":
            inverse = 1 / paper_step(pictures, names)[..., None] ** 2
        else:
            sides = side_strengths(pictures, names)
            kinds = [np.ones(sides.shape[:-1]), sides.sum(-1) / 2][: 2 if scene.noise.gain > 0 else 1]
            inverse = np.stack(kinds, -1) / (sides[..., :1] - sides[..., 1:]) ** 2
            r2 = edge_distance2(pictures, names, np.linspace(0, 1, 9))
            inverse *= _cut_off(scene, sides, r2, within_scale)[..., None]
    return np.where(np.isfinite(inverse).all(-1, keepdims=True), inverse, 0.0)


def _cut_off(scene: Scene, sides: np.ndarray, r2: np.ndarray, within_scale: bool) -> np.ndarray:
    """Least factor by which the end of the scale changes noise over squared contrast along an edge, (L, E); 1 mostly.

    The factor is smooth along an edge: 9 points and 2 % to spare. Infinite ``within_scale`` of what is near the end.
    """
    hot = sides.max(-1) > 0.99 * headroom(scene.noise) * r2.min(-1) ** 1.5
    if within_scale:
        return np.where(hot, np.inf, 1.0)
    factor = np.ones(hot.shape)
    signals = sides[hot][..., None] / r2[hot][:, None] ** 1.5
    found = of_sides(scene, signals)
    plain = (scene.noise.variance + shot_noise(scene.noise, signals.mean(-2))) / (signals[:, 0] - signals[:, 1]) ** 2
    ratio = found.noise_variance / found.squared / plain
    factor[hot] = 0.98 * np.where(np.isfinite(ratio), ratio, np.inf).min(-1, initial=np.inf)
    return np.minimum(factor, 1.0)


def _nodes() -> np.ndarray:
    """Chebyshev points on 0 to 1."""
    return (1 - np.cos(np.pi * (np.arange(_DEGREE) + 0.5) / _DEGREE)) / 2


def _lagrange(at: np.ndarray) -> np.ndarray:
    """Lagrange's polynomials of the nodes at fractions (...), shape (..., _DEGREE)."""
    nodes = _nodes()
    parts = [np.prod([(at - m) / (n - m) for m in nodes if m != n], axis=0) for n in nodes]
    return np.stack(parts, -1)


def _light_part(scene: Scene, names: tuple[str, ...], lights: np.ndarray, model: str) -> np.ndarray:
    """What an edge's bound takes from the light, shape (L, E, k)."""
    pictures = Pictures.of(scene, np.zeros(2), lights)
    if model == "paper":
        points = np.linspace(0, 1, PAPER_POINTS)
        inverse = 1 / edge_distance2(pictures, names, points)
        mean = inverse.mean(-1, keepdims=True)
        smooth = (inverse / mean**2) @ _lagrange(points)
        return np.concatenate([1 / mean, smooth], -1)
    cubes = edge_distance2(pictures, names, np.linspace(0, 1, 33)) ** 1.5
    nodes = edge_distance2(pictures, names, _nodes())
    gain = scene.noise.shot_gain
    dark = [np.ptp(cubes, axis=-1)[..., None] ** 2, nodes**3]
    shot = [gain * np.ptp(np.sqrt(cubes), axis=-1)[..., None] ** 2, gain * nodes**1.5] if gain > 0 else []
    return np.concatenate(dark + shot, -1)


def _paper(pictures: Pictures, known: Measurands, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tangent at equal weights: 2 sum h^2 - sum h^2 w, h the weight of each point's error in A d + B theta."""
    scene, sensors = pictures.scene, pictures.sensors
    names, lengths = known.view.names, known.view.lengths[..., None]
    fractions = np.linspace(0, 1, PAPER_POINTS)
    part = np.empty((*a.shape, _DEGREE + 1))
    for at in range(0, len(sensors), 1024):
        s = slice(at, at + 1024)
        points = lengths[s] * image_fractions(scene, names, sensors[s], fractions)
        places = lengths[s] * image_fractions(scene, names, sensors[s], _nodes())
        for m in range(a.shape[1]):
            influence = _influence(points, a[s, m], b[s, m], points)
            nodes = _influence(places, a[s, m], b[s, m], points)
            missed = np.abs(influence - nodes @ _lagrange(fractions).T).max(-1)
            part[s, m, :, 0] = 2 * influence.sum(-1) - 1.5 * PAPER_POINTS * missed
            part[s, m, :, 1:] = -nodes
    return part * PAPER_KAPPA2 * scene.noise.sigma**2, (lengths > 0).all((-1, -2))


def _influence(u: np.ndarray, a: np.ndarray, b: np.ndarray, points: np.ndarray) -> np.ndarray:
    """h^2 of A d + B theta at places u (px) for the unweighted line through ``points`` (px)."""
    mean = points.mean(-1, keepdims=True)
    a, b = a[..., None], b[..., None]
    return (a / points.shape[-1] + (b - a * mean) * (u - mean) / ((points - mean) ** 2).sum(-1, keepdims=True)) ** 2


def _calibrated(pictures: Pictures, known: Measurands, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of r^6 and of r^3 at the interpolation's nodes; the first of each takes the square of its range.

    r^3 itself is no polynomial of the place: what the interpolation misses of it is 1e-9.
    """
    scene, scale = pictures.scene, pictures.scene.locator.scale_px
    nodes = place_nodes(pictures, known.view, known.view.framed)
    good = (nodes.length[..., 0] >= MIN_USABLE).all(-1)
    per_point = point_variance(nodes, scale) * np.ones(1)
    part = np.stack([_coefficients(nodes, a[:, m], b[:, m], per_point, scale, good) for m in range(a.shape[1])], 1)
    dark = scene.noise.variance * part
    return np.concatenate([dark, part], -1) if scene.noise.gain > 0 else dark, good


def _coefficients(
    nodes: EdgeNodes, a: np.ndarray, b: np.ndarray, per_point, scale: float, good: np.ndarray
) -> np.ndarray:
    """Those of r^6 for A d + B theta of each edge at unit noise, shape (S, E, 1 + _DEGREE)."""
    weight, slope = (make(nodes, a, b) for make in (line_weight, line_slope))
    factor = long_edge(nodes, weight, slope, scale) * per_point
    extra = np.zeros_like(nodes.length)
    short = good & np.isfinite(nodes.length[..., 0]).all(-1) & (nodes.length[..., 0] < SHORT * scale).any(-1)
    crowd, spare = _short((weight * np.sqrt(per_point))[short], nodes.length[short], scale)
    is_short = nodes.length[short] < SHORT * scale
    factor[short] = np.where(is_short, crowd, factor[short])
    extra[short] = np.where(is_short, -spare, 0.0)
    values = np.einsum("...j,...jk->...k", factor, _lagrange(nodes.spatial))
    return np.concatenate([extra, values], -1)


def _short(g: np.ndarray, length: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Short edges: r^3 r'^3 = (r^6 + r'^6) / 2 - (r^3 - r'^3)^2 / 2; coefficients of r^6, and the most of the rest."""
    products = point_products(g, length, scale)
    return products.sum(-1) @ to_points(), np.abs(products).sum((-1, -2))[..., None] / 2
