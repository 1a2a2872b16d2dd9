"""Sets of pictures that are adjusted together (network design), chosen by what each tells of unknowns that all share.

Lines and circles of a picture are whitened observations of the part's features, its place and the camera, which all
pictures share, and of where its own sensor stands. With the latter eliminated a picture is one symmetric matrix, its
information of what is shared; those of a set add to each other and to what is known before. A value's variance is
g . N+ g, N the sum and g the value's gradient, where g does not change along what N leaves open.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from imaging.bundles.bundle import Bundle
from planner.search.candidates import DEAREST
from planner.search.objective import Aim
from planner.search.sets import SEEDS, SMALL, Score, every_set, exchanged, filled, sets_of

MOST_TRIED = 30_000  # sets that are tried one by one
_AT_ONCE = 512  # matrices
_DAMPED = 1e-13  # of the scale, added along all unknowns so that a sum that leaves some open is solved
_OPEN = 1e-3  # of a gradient's length: what it has along open directions, at least, where it is not told
_OWN_OPEN = 1e-10  # of the largest singular value, of a picture's own unknowns
_ROUNDS = 200
_HEAVY = 8  # pictures of the largest shares, with which sets begin


@dataclass(frozen=True, eq=False)
class Network:
    """P pictures that could be taken, and n unknowns that all share.

    Attributes
    ----------
    told : ndarray, shape (2, P, n, n)
        What each tells by lines and circles that are ``ok``, and by those that are ``clutter``, too; its own unknowns
        are eliminated: inverse variances. The latter counts only for a value that the former does not tell, and then
        as if its variance were `DEAREST` times as large, as much as a plan pays to be without.
    before : ndarray, shape (n, n)
        What is known before the pictures.
    gradient : ndarray, shape (M, n)
        Derivatives of the quantities by the unknowns.
    shown : ndarray of bool, shape (2, P, F)
        Which edges and circles these are.
    needed : ndarray of bool, shape (M, F)
        Of each quantity those that some picture must show: datums, which the drawing alone does not measure.
    aim : Aim
        What is minimised, of variances.
    scale : float
        Largest information of an unknown that a picture has before its own unknowns are eliminated: beside it what
        rounding leaves is told from what is known.
    """

    told: np.ndarray
    before: np.ndarray
    gradient: np.ndarray
    shown: np.ndarray
    needed: np.ndarray
    aim: Aim
    scale: float

    def __len__(self) -> int:
        return self.told.shape[1]

    def with_pictures(self, told: np.ndarray, shown: np.ndarray) -> Network:
        """The same of other pictures."""
        return replace(self, told=told, shown=shown)

    def of_sets(self, members: np.ndarray) -> Score:
        """Of sets of pictures, indices (..., K)."""
        return self._score(self.variances(members))

    def with_each(self, members: tuple[int, ...]) -> Score:
        """Of a set of K pictures and each of the P as one more."""
        kept = list(members)
        whole = self.before + self.told[:, kept].sum(1, keepdims=True) + self.told
        return self._score(self._counted(whole, self.shown[:, kept].any(1, keepdims=True) | self.shown))

    def variances(self, members: np.ndarray) -> np.ndarray:
        """Of the quantities (..., M) by sets of pictures, indices (..., K), as they count: infinite of what they do not
        tell, `DEAREST` times as large of what is clutter."""
        members = np.asarray(members)
        flat, found = members.reshape(-1, members.shape[-1]), []
        for at in range(0, len(flat), _AT_ONCE):
            some = flat[at : at + _AT_ONCE]
            found.append(self._counted(self.before + self.told[:, some].sum(2), self.shown[:, some].any(2)))
        return np.concatenate(found).reshape(*members.shape[:-1], -1)

    def relaxed(self, count: int) -> tuple[float, np.ndarray]:
        """What no ``count`` of the pictures can stay below, and shares (P,) of pictures that come near, their sum that.

        Pictures may be taken in part. A value's variance is a convex function of such shares, and what is minimised at
        least as large as any mixture of the values': its tangent anywhere is below all sets. Shares grow where the
        tangent falls (Torsney 1983), the mixture where a value is large. Infinite where all pictures leave one open.
        """
        shares, each = np.full(len(self), count / len(self)), self.told[1]
        told = np.isfinite(self.variances(np.arange(len(self))))
        weights = np.where(told, self.aim.shares, 0.0)
        mixed, bound = told / max(told.sum(), 1), 0.0
        for _ in range(_ROUNDS):
            by = self._solved(self.before + np.tensordot(shares, each, 1))
            parts = weights * np.einsum("mn,nm->m", self.gradient, by)
            mixture = mixed if self.aim.over == "minimax" else np.ones(len(parts))
            falls = np.einsum("pnm,nm->pm", each @ by, by) @ (weights * mixture)
            bound = max(bound, float(mixture @ parts + shares @ falls - count * falls.max()))
            if not falls.any():
                break
            shares = shares * np.sqrt(np.maximum(falls, 0.0))
            shares *= count / shares.sum()
            mixed = mixed * parts / (mixed @ parts)
        return bound if told.all() else math.inf, shares

    def _counted(self, whole: np.ndarray, shown: np.ndarray) -> np.ndarray:
        """(S, M) of S sets, by what they tell without and with clutter, (2, S, n, n), of what they show, (2, S, F)."""
        found = self._variances(whole[0], shown[0])
        lost = ~np.isfinite(found).all(-1)
        if lost.any():
            every = DEAREST * self._variances(whole[1, lost], shown[1, lost])
            found[lost] = np.where(np.isfinite(found[lost]), found[lost], every)
        return found

    def _variances(self, whole: np.ndarray, shown: np.ndarray) -> np.ndarray:
        """(..., M) by information (..., n, n), of pictures that show some edges and circles, bool (..., F)."""
        by = self._solved(whole)
        left = _DAMPED * self.scale * np.linalg.norm(by, axis=-2) > _OPEN * np.linalg.norm(self.gradient, axis=1)
        unseen = (self.needed & ~shown[..., None, :]).any(-1)
        return np.where(left | unseen, np.inf, np.einsum("mn,...nm->...m", self.gradient, by))

    def _solved(self, whole: np.ndarray) -> np.ndarray:
        """N^-1 g of information (..., n, n), damped, (..., n, M): times the damping it is the part of a gradient that
        lies along what is open."""
        return np.linalg.solve(whole + _DAMPED * self.scale * np.eye(whole.shape[-1]), self.gradient.T)

    def _score(self, variances: np.ndarray) -> Score:
        told = np.isfinite(variances)
        parts = np.where(told, variances, 0.0) * self.aim.shares
        return Score((~told).sum(-1), self.aim.joined(np.moveaxis(parts, -1, 0)), parts.sum(-1))


def best_sets(network: Network, count: int) -> tuple[tuple[int, ...], ...]:
    """For 1, 2, ... ``count`` pictures a set that no exchange of one picture for another makes better.

    Each is the best of those that begin with the one before, with nothing, with pictures whose relaxed share is whole,
    and with each picture if they and the set are few, else with each of the largest shares.
    """
    found: list[tuple[int, ...]] = []
    for size in range(1, count + 1):
        shares = network.relaxed(size)[1]
        whole = np.repeat(np.arange(len(network)), np.floor(shares + 1e-9).astype(int))[:size]
        few = len(network) <= SEEDS and size <= SMALL
        first = np.argsort(-shares)[: None if few else _HEAVY]
        starts = [found[-1] if found else (), (), tuple(whole.tolist()), *((int(row),) for row in first)]
        tried = [exchanged(network, filled(network, start, size)) for start in dict.fromkeys(starts)]
        found.append(tuple(sorted(tried[network.of_sets(np.array(tried)).best()])))
    return tuple(found)


def best_of_all(network: Network, count: int) -> tuple[int, float] | None:
    """How many quantities the best of all sets of ``count`` pictures leaves open, and what is minimised of the others;
    None where they are too many to be tried."""
    if not len(network) or sets_of(len(network), count) > MOST_TRIED:
        return None
    return network.of_sets(np.array(every_set(network, count))).at(0)[:2]


def of_one(bundle: Bundle, whites: np.ndarray) -> np.ndarray:
    """What a picture tells of what all share, (..., n, n), by combinations (..., q, q) of its lines and circles that
    are independent and of variance 1; its own unknowns are eliminated, with what is known of them before."""
    own, priors = ~is_shared(bundle), bundle.unknowns.priors()[0] * bundle.unknowns.units
    priors, seen = priors[priors[:, own].any(1)], whites @ _design(bundle)
    rows = np.concatenate([seen, np.broadcast_to(priors, (*whites.shape[:-2], *priors.shape))], -2)
    shared = rows[..., ~own]
    if own.any():
        left, sizes, _ = np.linalg.svd(rows[..., own], full_matrices=False)
        left = left * (sizes > _OWN_OPEN * sizes.max(-1, keepdims=True))[..., None, :]
        shared = shared - left @ (np.swapaxes(left, -1, -2) @ shared)
    return np.swapaxes(shared, -1, -2) @ shared


def scale_of(bundle: Bundle, white: np.ndarray) -> float:
    """Largest information of an unknown by such combinations (q, q) of one picture."""
    return float(((white @ _design(bundle)) ** 2).sum(0).max())


def _design(bundle: Bundle) -> np.ndarray:
    """Derivatives (q, n) of lines and circles of a picture; 0 of those that have none."""
    return np.where(np.isfinite(bundle.designs[0]), bundle.designs[0], 0.0) * bundle.unknowns.units


def of_shared(bundle: Bundle) -> tuple[np.ndarray, np.ndarray]:
    """What is known before of what all share, (n, n), and derivatives (M, n) of the quantities, in the same units."""
    shared, units = is_shared(bundle), bundle.unknowns.units
    priors = (bundle.unknowns.priors()[0] * units)[:, shared]
    return priors.T @ priors, (bundle.nominal[1] * units)[:, shared]


def is_shared(bundle: Bundle) -> np.ndarray:
    """Which unknowns of one picture are not its own: its sensor's, what only it is carried by, and its own camera."""
    shared = np.ones(bundle.unknowns.count, bool)
    for name in ("sensor 1", "carrier 1", "camera 1", "estimated 1"):
        if name in bundle.unknowns.slices:
            shared[bundle.unknowns.slices[name]] = False
    return shared
