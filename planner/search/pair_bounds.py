"""A lower bound of the variances of all pairs of sensor and lights where things hide and shade each other.

With R the squared contrast over the noise's variance, a line through points of variances 1 / R has at least the
variance N^2 / sum(z^2 R), N = sum(z^2), z the weights that they have at even contrast (Cauchy and Schwarz), be it
through a part of the points only. What a sensor sees says z, and what lies behind an edge; lights say no more than
how large R can be in pieces of the edge (`brightest`), and the sum is one matrix product for an edge and a quantity.
What correlated errors take off at an edge's ends is taken off with it, as often as the contrast may be less there
than elsewhere.

Circles, forms and extremes add nothing to the bound, nor does an edge that a light leaves partly in shadow. Taken for
granted is that the variance of no edge is negative.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.features.locator import MIN_USABLE, correlation, lacking
from imaging.features.measurand import Measurands, measurands
from imaging.features.projected_edges import straight
from imaging.geometry.projection import edge_points
from imaging.geometry.visibility import turned
from imaging.light.appearance import has_background
from imaging.light.behind import things_behind
from imaging.models.along import NODE_WEIGHTS, EdgeNodes, place_nodes
from imaging.models.calibrated import POINT_WEIGHTS, POINTS, SHORT, line_slope, line_weight, point_variance, to_points
from imaging.pictures import Pictures
from planner.search.brightest import PIECES, Brightest, Lit, Look, is_bounded
from planner.search.lobes import Lobes, together
from planner.search.objective import Aim, SearchProblem
from scenes import Edge, Scene
from scenes.measurands.form import forms_of
from scenes.measurands.kinds import MEASURANDS

_ROWS = 256  # sensors at a time
_WAYS = 16  # of what is past an edge's face that are told apart; all others are one
_APART, _NEAR = 0.2, 0.04  # between directions of sensors that are taken together, each way: roughly, and once more
_PARTS = 4  # of an edge, where its gloss is looked at once more
_MARGIN = 1e-5  # relative; single precision in sums of some 20 terms of one sign


@dataclass(frozen=True, eq=False)
class PairBounds:
    """Lower bounds of what is minimised for S sensors and L lights.

    Attributes
    ----------
    problem : SearchProblem
    poses : tuple of ndarray, shape (S, 2), (L, 2 F)
        Sensors and lights, degrees.
    lit : Lit
        What the lights do to edges.
    group : ndarray of int, shape (S,)
        Sensors that glossy faces are looked at by from nearly the same side (`together`).
    measures : ndarray of bool, shape (S,)
        Which sensors see all edges that are needed; the others measure under no light.
    needs : ndarray of bool, shape (M, E)
        Which edges each quantity needs.
    look : ndarray of int, shape (S, E)
        In which of the ways each edge is looked at.
    amount : ndarray, shape (S, M, E)
        What each edge adds at a ratio of 1, with the quantity's share in what is minimised.
    weights : ndarray, shape (S, M, E, PIECES + 1)
        By how much each piece's ratio counts, 1 together.
    loss : ndarray, shape (S, M, E)
        What is lost of it for each time that the ratio is uneven, less the first.
    within_scale : bool
        Whether they hold only of pairs by which no level is cut off at the end of the scale.
    """

    problem: SearchProblem
    poses: tuple[np.ndarray, np.ndarray]
    lit: Lit
    group: np.ndarray
    measures: np.ndarray
    needs: np.ndarray
    look: np.ndarray
    amount: np.ndarray
    weights: np.ndarray
    loss: np.ndarray
    within_scale: bool = False

    @classmethod
    def of(
        cls, problem: SearchProblem, sensors: np.ndarray, lights: np.ndarray, *, within_scale: bool = False
    ) -> PairBounds:
        """Of sensors (S, 2) and lights (L, 2 F), degrees."""
        scene, aim = problem.scene, problem.objective
        pictures = Pictures.of(scene, sensors)
        with np.errstate(all="ignore"):
            known = measurands(pictures)
            nodes = place_nodes(pictures, known.view, known.view.framed)
            parts = [_of_line(nodes, a, b, scene.locator.scale_px) for a, b in _pulls(known, aim)]
        amount, weights, loss = (np.stack(each, 1) for each in zip(*parts, strict=True))
        amount = amount * (aim.shares * _is_linear(scene))[:, None] * (1 - _MARGIN)
        good = np.isfinite(amount) & np.isfinite(loss) & np.isfinite(weights).all(-1) & (amount > 0)
        amount, loss = np.where(good, amount, 0.0), np.where(good, loss, 0.0)
        weights = np.where(good[..., None], weights, 1 / (PIECES + 1))
        needs = known.depends()[:, : len(known.view.names)]
        seen = known.view.visible & (nodes.length[..., 0] >= MIN_USABLE)
        looks, look = _looks(pictures, known.view.names, nodes.spatial)
        return cls(
            problem=problem,
            poses=(sensors, lights),
            lit=Lit.of(scene, looks, lights),
            group=together(scene, sensors, _APART),
            measures=(seen | ~needs.any(0)).all(-1),
            needs=needs,
            look=look,
            amount=amount.astype(np.float32),
            weights=weights.astype(np.float32),
            loss=loss.astype(np.float32),
            within_scale=within_scale,
        )

    def blocks(self, which: np.ndarray, below: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Some of the sensors ``which`` at a time, and their `rows`."""
        which = which[np.argsort(self.group[which], kind="stable")]
        for at in range(0, len(which), _ROWS):
            yield which[at : at + _ROWS], self.rows(which[at : at + _ROWS], below)

    def rows(self, which: np.ndarray, below: float) -> np.ndarray:
        """Bounds of some sensors with all lights, (n, L); infinite where nothing can be measured, or is not allowed.

        Where gloss counts, rough ones of sensors together, and nearer ones of those pairs of which they are below a
        number.
        """
        sensors, lights = self.poses
        found = np.full((len(which), len(lights)), np.inf, np.float32)
        sees = np.flatnonzero(self.measures[which])
        for group in np.unique(self.group[which[sees]]):
            some = sees[self.group[which[sees]] == group]
            found[some] = self._together(which[some], below)
        return np.where(self.problem.feasible(sensors[which, None], lights[None]), found, np.inf)

    def _together(self, which: np.ndarray, below: float) -> np.ndarray:
        """Of some sensors of one group, (n, L)."""
        if self._matt is not None:
            return self._joined(which, self._matt)
        found = self._joined(which, self._seen(which, self.lit, 1))
        left = found < below
        nearer = together(self.lit.scene, self.poses[0][which], _NEAR)
        for group in np.unique(nearer[left.any(1)]):
            rows = np.flatnonzero((nearer == group) & left.any(1))
            lights = np.flatnonzero(left[rows].any(0))
            seen = self._seen(which[rows], self.lit.some(lights), _PARTS)
            pairs = np.ix_(rows, lights)
            found[pairs] = np.maximum(found[pairs], self._joined(which[rows], seen))
        return found

    @cached_property
    def _matt(self) -> Brightest | None:
        """What all sensors see at most; None where that depends on where they stand."""
        matt = self.lit.scene.surfaces.is_diffuse
        return self._seen(np.zeros(1, int), self.lit, 1) if matt else None

    def _seen(self, which: np.ndarray, lit: Lit, pieces: int) -> Brightest:
        """What some sensors see at most, edges in so many pieces."""
        return Brightest(lit, Lobes(lit.scene, lit.shining, self.poses[0][which]), self.within_scale, pieces)

    def _joined(self, which: np.ndarray, brightest: Brightest) -> np.ndarray:
        return self.problem.objective.joined(self._quantity(which, m, brightest) for m in range(self.amount.shape[1]))

    def _quantity(self, which: np.ndarray, m: int, brightest: Brightest) -> np.ndarray:
        """The part of one quantity, (n, L)."""
        found = np.zeros((len(which), len(brightest.lit)), np.float32)
        for e in np.flatnonzero(self.needs[m]):
            for way in np.unique(self.look[which, e]):
                rows = np.flatnonzero(self.look[which, e] == way)
                found[rows] += self._edge(which[rows], m, e, *brightest.of(e, way))
        return found

    def _edge(self, which: np.ndarray, m: int, e: int, ratio: np.ndarray, uneven: np.ndarray) -> np.ndarray:
        """What an edge adds, (n, L)."""
        most = self.weights[which, m, e] @ ratio.T
        left = 1 - self.loss[which, m, e, None] * (uneven - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(most > 0, self.amount[which, m, e, None] * np.maximum(left, 0) / most, np.inf)


def has_pair_bounds(scene: Scene, model: str) -> bool:
    """Whether any of a scene's quantities has a bound: faces without print, points of light, a known place,
    lines."""
    lines = straight(scene) and _is_linear(scene).any()
    return bool(model == "calibrated" and scene.placement.is_known and lines and is_bounded(scene))


def _is_linear(scene: Scene) -> np.ndarray:
    """Which quantities move with lines and circles to first order, bool (M,)."""
    forms = forms_of(scene.quantities)
    return np.array([each not in forms and not MEASURANDS[each.kind].extreme for each in scene.quantities])


def _pulls(known: Measurands, aim: Aim) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Derivatives (S, E) of each quantity by the displacement and the rotation of each line."""
    offset, tilt = known.of_lines(known.gradient if aim.unit == "image" else known.gradient_object)
    return zip(np.moveaxis(offset, -2, 0), np.moveaxis(tilt, -2, 0), strict=True)


def _looks(
    pictures: Pictures, names: tuple[str, ...], fractions: np.ndarray
) -> tuple[dict[str, list[Look]], np.ndarray]:
    """The ways in which edges are looked at, by name, at fractions (S, E, n) of them; and which it is (S, E)."""
    ways, numbers = {}, []
    for e, name in enumerate(names):
        edge = pictures.scene.solid.edge(name)
        seen = turned(pictures.scene.bodies, edge, pictures.viewpoint)
        points = edge_points(pictures.scene.solid, (name,), fractions[:, e : e + 1])[:, 0]
        ways[name], number = [Look()], np.zeros(len(seen), int)
        for side in (0, 1):
            rows = np.flatnonzero(seen[:, side] & ~seen[:, 1 - side])
            found, which = _behind(pictures, edge, side, rows, points[rows])
            number[rows] = len(ways[name]) + which
            ways[name] += found
        numbers.append(number)
    return ways, np.stack(numbers, -1)


def _behind(
    pictures: Pictures, edge: Edge, side: int, rows: np.ndarray, points: np.ndarray
) -> tuple[list[Look], np.ndarray]:
    """What is past one face of an edge for some sensors, at places (k, n, 3), and which of that it is for each (k,)."""
    scene, bodies = pictures.scene, pictures.scene.bodies
    if not len(rows):
        return [], np.zeros(0, int)
    if bodies.outer[edge.faces[1 - side]] and not has_background(scene):
        return [Look(side, (-1,))], np.zeros(len(rows), int)
    some = Pictures.of(scene, pictures.sensors[rows])
    things = things_behind(some, points, np.isfinite(points).all(-1), edge.faces)
    there = np.zeros((len(rows), len(bodies.faces) + 2), bool)
    np.put_along_axis(there, things % there.shape[1], True, 1)  # darkness is the last
    kinds, which, count = np.unique(there, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(-count, kind="stable")
    which, kinds = np.minimum(np.argsort(order)[which.ravel()], _WAYS), kinds[order]
    kinds = [*kinds[:_WAYS], *([kinds[_WAYS:].any(0)] if len(kinds) > _WAYS else [])]
    return [Look(side, tuple(np.flatnonzero(kind).tolist())) for kind in kinds], which


def _of_line(nodes: EdgeNodes, a: np.ndarray, b: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``amount`` (S, E), ``weights`` (S, E, PIECES + 1) and ``loss`` (S, E) of A d + B theta of each line."""
    weight, slope, point = line_weight(nodes, a, b), line_slope(nodes, a, b), point_variance(nodes, scale)
    amount, weights, loss = _long(nodes, weight, slope, point * np.ones(weight.shape), scale)
    short = nodes.length[..., 0] < SHORT * scale
    found, lost = _short((weight * np.sqrt(point))[short], nodes.length[short], scale)
    amount[short], loss[short], weights[short] = np.fmin(found, amount[short]), lost, np.eye(PIECES + 1)[-1]
    return amount, weights, loss


def _short(g: np.ndarray, length: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """``amount`` and ``loss`` (k,) of short edges, of which ``g`` (k, n) is what their nodes add at even contrast.

    The sum over the points h K h, K their correlations, is h' K h' at uneven contrast and not less than (h' K h)^2 over
    h K h (Cauchy and Schwarz). h' K h is a sum over the nodes, each times sqrt(1 / R) there: that R may be less than
    elsewhere counts only where a node's part is negative.
    """
    step = POINT_WEIGHTS * length / 2
    kernel = correlation((POINTS[:, None] - POINTS) * length[..., None] / 2, scale)
    pulled = np.einsum("kij,kj->ki", kernel, g @ to_points().T * step)
    parts = g * (pulled * step @ to_points())
    amount = parts.sum(-1)
    return amount, -np.minimum(parts, 0.0).sum(-1) / amount


def _long(
    nodes: EdgeNodes, weight: np.ndarray, slope: np.ndarray, point: np.ndarray, scale: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of long edges: to first order, less what `long_edge` takes off at the ends."""
    inside = np.concatenate([[0], NODE_WEIGHTS, [0]]) * nodes.length / 2
    square = inside * (weight**2 + nodes.spacing**2 * slope**2 / 6)
    span = scale / nodes.along
    counts = square / (np.minimum(span, scale) * point)  # `calibrated` takes the scale itself to first order
    whole = counts.sum(-1)
    first = 2 * np.sqrt(np.pi) * square.sum(-1) ** 2 / whole
    ends = (lacking((nodes.spacing / span) ** 2)[0] * span**2 * point * weight**2)[..., [0, -1]].sum(-1)
    piece = np.clip((nodes.spatial * PIECES).astype(int), 0, PIECES - 1)
    weights = [np.where(piece == k, counts, 0.0).sum(-1) / whole for k in range(PIECES)]
    return first - ends, np.stack([*weights, np.zeros(whole.shape)], -1), ends / (first - ends)
