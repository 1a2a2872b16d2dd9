"""Many images at once: the model of a picture around one state as a polynomial in small displacements of its pieces.

A piece whose ends are displaced by a n + b t (n its normal, t its direction, a and b linear along it) changes the image
by integrals along the piece of the pixel kernel and of its derivatives across it, up to the fourth order in a. So the
model is a fixed matrix times polynomials of the displacements, all that the data have to say of it is one matrix
product, and the likelihood is maximised among a few numbers for each image.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from imaging.blurred.model import BlurredModel, State

_ROWS = ((0, 3), (1, 4), (2, 3), (3, 3), (4, 4), (5, 5))  # kernel and how many powers of t go with it
_STARTS = np.cumsum([0, *(count for _, count in _ROWS)])
ROWS = int(_STARTS[-1])
_KERNEL, _CONTRAST, _ACROSS, _ALONG, _ACROSS2, _ACROSS3 = (slice(a, b) for a, b in pairwise(_STARTS))
_ITERATIONS = 40
_SETTLED = 3e-4  # of a standard deviation
_BOW_SEEN = 1.0  # 1/px^2, information: bows of which an image tells less are left out
_STRIDE = 8.0  # standard deviations that one iteration may go
_ARRIVED = 1.0  # standard deviation: what still goes farther is not where it will be


class Displaced(NamedTuple):
    """Displacements of N pieces in n images, each a polynomial in t.

    ``across`` and ``along`` in px, (n, N, 2); ``contrast``, its change in grey levels, (n, N, 3); ``blur``, px, (n,).
    """

    across: np.ndarray
    along: np.ndarray
    contrast: np.ndarray
    blur: np.ndarray


@dataclass(frozen=True, eq=False)
class Pieces:
    """The moving pieces of a model at one state.

    Attributes
    ----------
    pixels : tuple of ndarray of int
        For each piece the pixels (of the model's P) that it can change.
    rows : tuple of ndarray, shape (ROWS, p)
        Integrals along each piece at its pixels.
    lengths : ndarray, shape (N,)
    across, along : ndarray, shape (N, 2, q)
        From a step of the parameters to the displacements' coefficients.
    contrast : ndarray, shape (N, 3, q)
    blur : float
    """

    pixels: tuple[np.ndarray, ...]
    rows: tuple[np.ndarray, ...]
    lengths: np.ndarray
    across: np.ndarray
    along: np.ndarray
    contrast: np.ndarray
    blur: float

    @classmethod
    def of(cls, model: BlurredModel, state: State) -> Pieces:
        arrangement = model.arrangement
        moving = model.moving
        ends = state.vertices[arrangement.pieces[moving]]
        away = ends[:, 1] - ends[:, 0]
        lengths = np.linalg.norm(away, axis=1)
        direction = away / lengths[:, None]
        normal = np.stack([-direction[:, 1], direction[:, 0]], 1)
        steps = _vertex_steps(model, moving)
        found = _integrals(model, state, lengths)
        return cls(
            tuple(pixels for pixels, _ in found),
            tuple(rows for _, rows in found),
            lengths,
            np.einsum("ni,nkiq->nkq", normal, steps),
            np.einsum("ni,nkiq->nkq", direction, steps),
            _contrast_steps(model, moving, ends),
            state.blur,
        )

    def displaced(self, steps: np.ndarray) -> Displaced:
        """From steps of the parameters (n, q)."""
        parts = (np.tensordot(steps, part, (1, 2)) for part in (self.across, self.along, self.contrast))
        return Displaced(*parts, steps[:, -1])

    def coefficients(self, by: Displaced) -> np.ndarray:
        """What the rows are multiplied by, (n, N, ROWS)."""
        a, b, length = by.across, by.along, self.lengths[:, None]
        swept = (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])[..., None]
        square = _product(a, a)
        found = np.zeros((*a.shape[:2], ROWS))
        found[..., _KERNEL][..., :2] = -length * a
        found[..., :1] -= swept / 2
        found[..., _CONTRAST] = -length * _product(by.contrast, a)
        found[..., _ACROSS] = -length / 2 * square
        found[..., _ACROSS][..., :2] -= swept / 3 * a
        found[..., _ALONG] = -length / 2 * _product(a, b)
        found[..., _ACROSS2] = -length / 6 * _product(square, a)
        found[..., _ACROSS2][..., :2] -= length * self.blur * by.blur[:, None, None] * a
        found[..., _ACROSS3] = -length / 24 * _product(square, square)
        found[..., _ACROSS3][..., :3] -= length / 2 * self.blur * by.blur[:, None, None] * square
        return found

    def gradient(self, by: Displaced, told: np.ndarray) -> np.ndarray:
        """Derivative of the sum of coefficients times ``told`` (n, N, ROWS) by the parameters, (n, q)."""
        a, b, length = by.across, by.along, self.lengths[:, None]
        square = _product(a, a)
        swept = (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])[..., None]
        across, across2, across3 = told[..., _ACROSS], told[..., _ACROSS2], told[..., _ACROSS3]
        turned = told[..., :1] / 2 + (a * across[..., :2]).sum(-1, keepdims=True) / 3
        by_a = told[..., _KERNEL][..., :2] + _moment(by.contrast, told[..., _CONTRAST]) + _moment(a, across)
        by_a = by_a + _moment(b, told[..., _ALONG]) / 2 + _moment(square, across2) / 2
        by_a = by_a + _moment(_product(square, a), across3) / 6
        by_a = by_a + self.blur * by.blur[:, None, None] * (across2[..., :2] + _moment(a, across3[..., :3]))
        by_a = -length * by_a - swept / 3 * across[..., :2] - turned * np.stack([b[..., 1], -b[..., 0]], -1)
        by_b = -length / 2 * _moment(a, told[..., _ALONG]) - turned * np.stack([-a[..., 1], a[..., 0]], -1)
        by_contrast = -length * _moment(a, told[..., _CONTRAST], 3)
        found = sum(
            np.tensordot(values, part, ((1, 2), (0, 1)))
            for values, part in ((by_a, self.across), (by_b, self.along), (by_contrast, self.contrast))
        )
        found[:, -1] -= self.blur * (length * a * across2[..., :2]).sum((1, 2))
        found[:, -1] -= self.blur * (length / 2 * square * across3[..., :3]).sum((1, 2))
        return found


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Product of polynomials, coefficients along the last axis."""
    found = np.zeros((*a.shape[:-1], a.shape[-1] + b.shape[-1] - 1))
    for i in range(a.shape[-1]):
        found[..., i : i + b.shape[-1]] += a[..., i : i + 1] * b
    return found


def _moment(a: np.ndarray, told: np.ndarray, terms: int = 2) -> np.ndarray:
    """Derivative of sum_ij a_i x_j told_(i+j) by each of so many x_j."""
    count = a.shape[-1]
    return np.stack([(a * told[..., j : j + count]).sum(-1) for j in range(terms)], -1)


def _vertex_steps(model: BlurredModel, moving: np.ndarray) -> np.ndarray:
    """From the parameters to the displacement of each piece's first end and what the other's is more, (N, 2, 2, q)."""
    place = np.full(len(model.arrangement.vertices), -1)
    place[model.free] = np.arange(model.free.size)
    steps = np.zeros((moving.size, 2, 2, model.count))
    for n, pair in enumerate(place[model.arrangement.pieces[moving]]):
        for axis in (0, 1):
            if pair[0] >= 0:
                steps[n, 0, axis, 2 * pair[0] + axis] += 1
                steps[n, 1, axis, 2 * pair[0] + axis] -= 1
            if pair[1] >= 0:
                steps[n, 1, axis, 2 * pair[1] + axis] += 1
    return steps


def _contrast_steps(model: BlurredModel, moving: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """From the parameters to the contrast along each piece, a parabola in t through ends and middle, (N, 3, q)."""
    arrangement, steps = model.arrangement, np.zeros((moving.size, 3, model.count))
    first, parabola = 2 * model.free.size, np.linalg.inv(np.vander([0.0, 0.5, 1.0], 3, increasing=True))
    for n, (piece, (start, stop)) in enumerate(zip(moving, ends, strict=True)):
        places = arrangement.recorded(np.stack([start, (start + stop) / 2, stop]))
        for region, sign in zip(arrangement.sides[piece], (1.0, -1.0), strict=True):
            part = arrangement.level_slices[region]
            basis = sign * arrangement.regions[region].basis(places)
            steps[n, :, first + part.start : first + part.stop] += parabola @ basis.T
    return steps


def _integrals(model: BlurredModel, state: State, lengths: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """For each moving piece its pixels and the integrals along it, (ROWS, p)."""
    nodes, (traced, kernels, scatter, product, _) = model.nodes, model.drawn(state)
    contrast = model.contrasts(state, traced)
    x, y = ([k, *(kernels.derivative(axis, order) for order in (1, 2, 3))]
            for axis, k in ((0, kernels.x), (1, kernels.y)))  # fmt: skip
    size = np.linalg.norm(traced.tangent, axis=1)
    found = []
    for length, piece in zip(lengths, model.moving, strict=True):
        here = slice(*np.searchsorted(nodes.piece, [piece, piece + 1]))
        tangent = traced.tangent[here] / size[here, None]
        nx, ny = -tangent[:, 1], tangent[:, 0]
        stretch = traced.area[here] * length / size[here]  # recorded px across for an ideal one
        pixels, local = scatter.of_nodes(here)
        weight = nodes.weight[here] * traced.area[here]
        dim = weight * contrast[here]
        kx, ky = ([k[here] for k in part] for part in (x, y))
        images = [
            (dim, product[here]),
            (weight, product[here]),
            (dim * stretch, _sum(kx, ky, ((1, 0, nx), (0, 1, ny)))),
            (dim * size[here] / length, _sum(kx, ky, ((1, 0, tangent[:, 0]), (0, 1, tangent[:, 1])))),
            (dim * stretch**2, _sum(kx, ky, ((2, 0, nx**2), (1, 1, 2 * nx * ny), (0, 2, ny**2)))),
            (dim * stretch**3, _sum(kx, ky, (
                (3, 0, nx**3), (2, 1, 3 * nx**2 * ny), (1, 2, 3 * nx * ny**2), (0, 3, ny**3)))),
        ]  # fmt: skip
        powers = np.vander(nodes.t[here], max(count for _, count in _ROWS), increasing=True)
        rows = [
            local.at_all(images[kernel][1], images[kernel][0][:, None] * powers[:, :count]).T for kernel, count in _ROWS
        ]
        found.append((pixels, np.concatenate(rows)))
    return found


def _sum(x: list[np.ndarray], y: list[np.ndarray], terms) -> np.ndarray:
    """Sum of factor times derivative of k(x) k(y), (n, w, w)."""
    return sum(y[j][:, :, None] * (x[i] * factor[:, None])[:, None] for i, j, factor in terms)


class Evidence(NamedTuple):
    """All that n images tell an expansion.

    Attributes
    ----------
    told : ndarray, shape (n, l + N ROWS)
        Products of the pixels, less what was expected, with all columns; in standard deviations of the noise.
    far_told : ndarray, shape (n, l)
        The part of it that the pixels far from the pieces make.
    squares : ndarray, shape (n, 2)
        Chi-square at the state, of the pixels near the pieces and of the others.
    """

    told: np.ndarray
    far_told: np.ndarray
    squares: np.ndarray


class Solved(NamedTuple):
    """Most likely steps of the parameters in n images, from an expansion.

    Attributes
    ----------
    steps : ndarray, shape (n, q)
    squares : ndarray, shape (n, 3)
        Chi-square of the pixels near the pieces, of the others, and of a bow in each piece (score test).
    left : ndarray, shape (n, q)
        How far the steps may be from the likelihood's maximum: what the last iteration changed, and the effect of the
        highest order (that of all that is left out was seen to be up to 5 times as large, while it is small); infinite
        where the iterations have not arrived.
    """

    steps: np.ndarray
    squares: np.ndarray
    left: np.ndarray


class Drawn(NamedTuple):
    """Most likely steps in drawn images: to first order, fully, and how far off the latter may be, all (n, q)."""

    linear: np.ndarray
    steps: np.ndarray
    left: np.ndarray


@dataclass(frozen=True, eq=False)
class Expansion:
    """The model around one state, ready for a stack of images.

    Attributes
    ----------
    order : ndarray of int, shape (P,)
        The model's pixels in the order in which they are used here.
    pieces : Pieces
    expected : ndarray, shape (P,)
        Recorded level at the state.
    root : ndarray, shape (P,)
        One over the standard deviation of the noise.
    linear : ndarray, shape (P, l)
        Derivatives by levels and blur, in standard deviations of the noise.
    rows : tuple of ndarray, shape (p, ROWS)
        The pieces' rows, in standard deviations of the noise.
    near : int
        So many of the pixels, the first ones, lie near a piece.
    gram : ndarray, shape (l + N ROWS, l + N ROWS)
        Products of all columns, weighted.
    gram_far : ndarray, shape (l, l)
        The part of it that the other pixels make.
    inverse : ndarray, shape (q, q)
        Of the information on the parameters with what was known before.
    prior, offset : ndarray, shape (q, q) and (q,)
        Precision of what was known before, and its distance from the state.
    """

    order: np.ndarray
    pieces: Pieces
    expected: np.ndarray
    root: np.ndarray
    linear: np.ndarray
    rows: tuple[np.ndarray, ...]
    near: int
    gram: np.ndarray
    gram_far: np.ndarray
    inverse: np.ndarray
    prior: np.ndarray
    offset: np.ndarray

    @classmethod
    def of(cls, pieces, expected, weight, gain, linear, inverse, prior, offset) -> Expansion:
        """From arrays in the model's order of the pixels: those that a piece can change are brought to the front."""
        touched = np.zeros(expected.size, bool)
        for pixels in pieces.pixels:
            touched[pixels] = True
        order, near = np.argsort(~touched, kind="stable"), int(touched.sum())
        place = np.empty(order.size, int)
        place[order] = np.arange(order.size)
        pieces = replace(pieces, pixels=tuple(place[pixels] for pixels in pieces.pixels))
        expected, root = expected[order], np.sqrt(weight[order])
        scale = gain[order] * root
        linear = linear[order] * scale[:, None]
        rows = tuple(
            np.ascontiguousarray((rows * scale[pixels]).T)
            for pixels, rows in zip(pieces.pixels, pieces.rows, strict=True)
        )
        gram, gram_far = _gram(linear[:near], pieces.pixels, rows), linear[near:].T @ linear[near:]
        gram[: len(gram_far), : len(gram_far)] += gram_far
        return cls(order, pieces, expected, root, linear, rows, near, gram, gram_far, inverse, prior, offset)

    def see(self, used: np.ndarray) -> Evidence:
        """What pixels (n, P) of n images, which are used up, tell."""
        away = np.subtract(used, self.expected, out=used)
        away *= self.root
        near, far = away[:, : self.near], away[:, self.near :]
        far_told = far @ self.linear[self.near :]
        told = [near @ self.linear[: self.near] + far_told]
        told += [away[:, pixels] @ rows for pixels, rows in zip(self.pieces.pixels, self.rows, strict=True)]
        squares = [np.einsum("np,np->n", part, part) for part in (near, far)]
        return Evidence(np.concatenate(told, 1), far_told, np.stack(squares, 1))

    def solve(self, seen: Evidence) -> Solved:
        """Most likely steps for what n images tell."""
        told, count = seen.told, self.linear.shape[1]
        steps, change = self._climb(told, self.offset)
        columns, level = self._columns(steps), steps[:, -count:]
        far = seen.squares[:, 1] + ((level @ self.gram_far - 2 * seen.far_told) * level).sum(1)
        explained = columns @ self.gram
        whole = seen.squares.sum(1) + ((explained - 2 * told) * columns).sum(1)
        bows, information = self.bows
        scores = (told - explained) @ bows
        bowed = np.einsum("ni,ij,nj->n", scores, np.linalg.pinv(information, hermitian=True), scores)
        squares = np.stack([whole - far, far, bowed], 1)
        left = np.abs(change) + np.abs(self._highest(steps))
        left[(np.abs(change) > _ARRIVED * self.scale).any(1)] = np.inf  # levels on their way: corners seem to rest
        return Solved(steps, squares, left)

    @cached_property
    def bows(self) -> tuple[np.ndarray, np.ndarray]:
        """Bows 4 t (1 - t) px of B pieces as columns (l + N ROWS, B), and their information beside the parameters'.

        A straight edge that is none shows here long before the sum of all squares tells.
        """
        count, pieces = self.linear.shape[1], len(self.pieces.rows)
        bows = np.zeros((count + pieces * ROWS, pieces))
        first = count + np.arange(pieces) * ROWS
        bows[first + 1, np.arange(pieces)] = 4 * self.pieces.lengths
        bows[first + 2, np.arange(pieces)] = -4 * self.pieces.lengths
        shared = self._score(np.zeros((pieces, len(self.inverse))), bows.T @ self.gram)
        information = bows.T @ self.gram @ bows - shared @ self.inverse @ shared.T
        seen = np.diag(information) > _BOW_SEEN
        return bows[:, seen], information[np.ix_(seen, seen)]

    def _climb(self, told: np.ndarray, offset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Most likely steps (n, q) for what n images tell, and the last change of each."""
        steps = np.zeros((len(told), self.inverse.shape[0]))
        change, open_ = np.zeros_like(steps), np.arange(len(steps))
        for _ in range(_ITERATIONS):
            columns = self._columns(steps[open_])
            score = self._score(steps[open_], told[open_] - columns @ self.gram)
            score += (offset - steps[open_]) @ self.prior
            change[open_] = np.clip(score @ self.inverse, -_STRIDE * self.scale, _STRIDE * self.scale)
            steps[open_] += change[open_]
            open_ = open_[(np.abs(change[open_]) > _SETTLED * self.scale).any(1)]
            if not open_.size:
                break
        return steps, change

    def drawn(self, count: int) -> Drawn:
        """Most likely steps in ``count`` images of the state itself, each with noise of its own.

        Images need not be made: all that they tell is normal with the covariance `gram`. Always the same draws.
        """
        values, vectors = np.linalg.eigh(self.gram)
        half = np.random.default_rng(0).standard_normal((count // 2, len(values)))
        told = np.concatenate([half, -half]) * np.sqrt(np.maximum(values, 0)) @ vectors.T
        none = np.zeros((len(told), self.inverse.shape[0]))
        linear = self._score(none, told) @ self.inverse
        steps, change = self._climb(told, np.zeros(self.inverse.shape[0]))
        return Drawn(linear, steps, np.abs(change) + np.abs(self._highest(steps)))

    @property
    def scale(self) -> np.ndarray:
        """Standard deviation of each parameter, (q,)."""
        return np.sqrt(np.diag(self.inverse))

    def _columns(self, steps: np.ndarray) -> np.ndarray:
        """What all columns are multiplied by, (n, l + N ROWS)."""
        moved = self.pieces.coefficients(self.pieces.displaced(steps))
        return np.concatenate([steps[:, -self.linear.shape[1] :], moved.reshape(len(steps), -1)], 1)

    def _score(self, steps: np.ndarray, told: np.ndarray) -> np.ndarray:
        """Derivative of the columns' multipliers by the parameters, times ``told``."""
        count = self.linear.shape[1]
        shape = len(told), len(self.pieces.rows), ROWS
        found = self.pieces.gradient(self.pieces.displaced(steps), told[:, count:].reshape(shape))
        found[:, -count:] += told[:, :count]
        return found

    def _effect(self, columns: np.ndarray) -> np.ndarray:
        """What so much of the columns does to the parameters, (n, q)."""
        return -self._score(np.zeros((len(columns), len(self.inverse))), columns @ self.gram) @ self.inverse

    def _highest(self, steps: np.ndarray) -> np.ndarray:
        top = np.zeros(ROWS, bool)
        top[_ACROSS3] = True
        which = np.concatenate([np.zeros(self.linear.shape[1], bool), np.tile(top, len(self.pieces.rows))])
        return self._effect(np.where(which, self._columns(steps), 0.0))


def _gram(linear: np.ndarray, pixels: tuple[np.ndarray, ...], rows: tuple[np.ndarray, ...]) -> np.ndarray:
    """Products of all columns: ``linear`` (p, l), and each piece's ``rows`` at its ``pixels``, 0 elsewhere."""
    count, pieces = linear.shape[1], len(rows)
    gram = np.zeros((count + pieces * ROWS,) * 2)
    gram[:count, :count] = linear.T @ linear
    place = np.full((pieces, len(linear)), -1, np.int32)
    for n, here in enumerate(pixels):
        place[n, here] = np.arange(here.size)
        at = slice(count + n * ROWS, count + (n + 1) * ROWS)
        gram[at, :count] = rows[n].T @ linear[here]
        gram[:count, at] = gram[at, :count].T
        for m in range(n + 1):
            also = place[m, here]
            shared = also >= 0
            if shared.any():
                to = slice(count + m * ROWS, count + (m + 1) * ROWS)
                gram[at, to] = rows[n][shared].T @ rows[m][also[shared]]
                gram[to, at] = gram[at, to].T
    return gram
