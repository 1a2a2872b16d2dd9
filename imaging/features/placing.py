"""A part's place as an unknown: what it does to lines and circles, and the adjustment that finds it from datums.

Datums are features of the part, or a board beside it, which counts as one feature (`imaging.boards.seen`).

Found features y are J p + d + e: J their derivative by the placement p (shift and rotation vector of the part), d what
the datums are off on the part, e noise. Of all p the most likely one given the datums' y, and what is known of p
before (maximum a posteriori, Gauss-Markov), is taken off what is seen of all features; a measurand is then of these.
Placements are in units of their standard uncertainty before the picture, so that its own information is 1 for each.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from imaging.features.displaced import by_deviations
from imaging.features.seen import Seen
from scenes import Quantity, Scene, Side
from scenes.measurands.features import ends_of
from scenes.placement import COMPONENTS, components, datums_of, root
from scenes.status import OF_SIGMA, OF_TOLERANCE

if TYPE_CHECKING:
    from imaging.boards.seen import SeenBoard

_NOISELESS = 1e-4  # of a feature's variance, in a combination of some; what is told of a placement has 3e-3 and more


@dataclass(frozen=True, eq=False)
class Placing:
    """How the features of pictures of leading shape (...) tell where the part lies; k components are not exact.

    Attributes
    ----------
    names : tuple of str
        Of the components (`scenes.placement.components`).
    root : ndarray, shape (6 + c, k)
        Placement (the scene's unit, degrees) and deviations of the camera by them (`scenes.placement.root`).
    expected : ndarray, shape (k,)
        Their expectation.
    slopes : ndarray, shape (..., q, k)
        J, by the components.
    features : tuple of str
        Names of the datums, or of the board.
    datums : ndarray of bool, shape (q,)
        Which parameters of `Seen` are those of datums.
    scatter : ndarray, shape (..., q, q)
        Covariance of what the datums are off on the part, or a board's points on it, in the same parameters.
    beside : ndarray, shape (..., q, q)
        The same by what is not known of a board's place relative to the part and of its pitch.
    board : SeenBoard, optional
        What stands beside the part and tells where it lies.
    """

    names: tuple[str, ...]
    root: np.ndarray
    expected: np.ndarray
    slopes: np.ndarray
    features: tuple[str, ...]
    datums: np.ndarray
    scatter: np.ndarray
    beside: np.ndarray
    board: SeenBoard | None = None

    @classmethod
    def of(cls, scene: Scene, seen: Seen, board: SeenBoard | None = None) -> Placing | None:
        """That of a scene's features, and its board's points, as they are expected; None where their place is known."""
        if scene.placement.is_known:
            return None
        told = root(scene)
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes = by_deviations(seen, scene) @ told
            datums, scatter = _datums(scene, seen)
        lead = (
            slopes.shape[:-2] if board is None else board.root.shape[:-2]
        )  # a board's noise depends on the lights, too
        slopes, scatter = (np.broadcast_to(each, (*lead, *each.shape[-2:])).copy() for each in (slopes, scatter))
        beside = np.zeros(scatter.shape)
        if board is not None:
            part = seen.of_board
            slopes[..., part, :], datums[part] = board.root, True
            scatter[..., part, part], beside[..., part, part] = board.spread(board.printed), board.of_beside
        expected = np.linalg.pinv(told) @ scene.placement.mean
        told_by = scene.placement.told_by
        return cls(components(scene), told, expected, slopes, told_by, datums, scatter, beside, board)

    def squares(self, errors: np.ndarray, found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Chi-square (...) of what the best placement leaves of features found (..., q), and degrees of freedom."""
        told, white = self._whitening(errors)
        slopes = white @ self._told_slopes(told)
        off = np.einsum("...iq,...q->...i", white, np.nan_to_num(np.where(told, found, 0.0))) - slopes @ self.expected
        with_prior = np.eye(off.shape[-1]) + slopes @ np.swapaxes(slopes, -1, -2)
        squares = np.einsum("...i,...i->...", off, np.linalg.solve(with_prior, off[..., None])[..., 0])
        return squares, (white != 0).any(-1).sum(-1)

    def adjusted(self, errors: np.ndarray) -> Adjustment:
        """The adjustment of features whose noise has a covariance (..., q, q); infinite or NaN of what is not found."""
        told, white = self._whitening(errors)
        slopes = white @ self._told_slopes(told)
        information = np.swapaxes(slopes, -1, -2) @ slopes
        posterior = np.linalg.inv(information + np.eye(len(self.names)))
        return Adjustment(self, information, posterior, posterior @ np.swapaxes(slopes, -1, -2) @ white)

    def _told_slopes(self, told: np.ndarray) -> np.ndarray:
        return np.where(told[..., None], self.slopes, 0.0)

    def _whitening(self, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which features tell (..., q), and combinations of them of variance 1 that are independent, (..., q, q).

        Lines that share corners leave no noise in some combinations; these tell nothing of a placement, but for what
        noise has turned the lines, and are left out as rows of zeros.
        """
        told = self.datums & np.isfinite(np.einsum("...qq->...q", errors)) & np.isfinite(self.slopes).all(-1)
        whole = np.where(told[..., :, None] & told[..., None, :], errors + self.scatter + self.beside, 0.0)
        return told, whitening(whole)


def whitening(covariance: np.ndarray) -> np.ndarray:
    """Combinations (..., q, q) of errors of a covariance (..., q, q) that are independent and of variance 1.

    Rows of zeros where a combination has no noise, or a feature is not told (a row and a column of zeros).
    """
    size = np.sqrt(np.einsum("...qq->...q", covariance))
    size = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(covariance / (size[..., :, None] * size[..., None, :]))
    some = values > _NOISELESS
    scale = np.where(some, 1 / np.sqrt(np.where(some, values, 1.0)), 0.0)
    return scale[..., None] * np.swapaxes(vectors, -1, -2) / size[..., None, :]


@dataclass(frozen=True, eq=False)
class Adjustment:
    """The linear estimate of a placement, and what is left of it in values.

    Attributes
    ----------
    placing : Placing
    information : ndarray, shape (..., k, k)
        What the datums tell of the placement, in units of what is known before.
    posterior : ndarray, shape (..., k, k)
        Covariance of the adjusted placement's error, in those units.
    gain : ndarray, shape (..., k, q)
        Derivative of the adjusted placement by features; 0 of what is no datum.
    """

    placing: Placing
    information: np.ndarray
    posterior: np.ndarray
    gain: np.ndarray

    def estimate(self, errors: np.ndarray) -> np.ndarray:
        """The most likely placement (..., k) of features found with errors (..., q) beside the expected ones."""
        known = np.nan_to_num(np.where(self.placing.datums, errors, 0.0))
        told = np.einsum("...kq,...q->...k", self.gain, known)
        return told + np.einsum("...kl,l->...k", self.posterior, self.placing.expected)

    def covariance(self) -> np.ndarray:
        """Of placement and the camera's deviations, (..., 6 + c, 6 + c), the scene's unit and degrees, squared."""
        return self.placing.root @ self.posterior @ self.placing.root.T

    def gradient(self, gradient: np.ndarray) -> np.ndarray:
        """Derivatives of adjusted values by features, (..., M, q), from those at a known placement."""
        return gradient - self.pulls(gradient) @ self.gain

    def pulls(self, gradient: np.ndarray) -> np.ndarray:
        """Derivatives (..., M, k) by the placement, at a known one; features that a value does not need do not
        count."""
        slopes = np.where(np.isfinite(self.placing.slopes), self.placing.slopes, 0.0)
        return gradient @ slopes

    def placed(self, gradient: np.ndarray) -> np.ndarray:
        """Covariance (..., M, M) of values by what is not known of the placement, of the datums on the part, and of the
        place of a board beside it.

        ``gradient`` (..., M, q) is that at a known placement.
        """
        left = self.left(gradient)
        return left @ np.swapaxes(left, -1, -2) + self._moved(gradient, self.placing.scatter + self.placing.beside)

    def left(self, gradient: np.ndarray) -> np.ndarray:
        """Derivatives (..., M, k) of adjusted values by the placement: what the datums' gain leaves of `pulls`."""
        return self.pulls(gradient) @ self.posterior

    def by_datums(self, gradient: np.ndarray) -> np.ndarray:
        """The part of `placed` by what the datums are off on the part, or a board's points on it."""
        return self._moved(gradient, self.placing.scatter)

    def _moved(self, gradient: np.ndarray, scatter: np.ndarray) -> np.ndarray:
        moved = self.pulls(gradient) @ self.gain
        return moved @ np.nan_to_num(scatter) @ np.swapaxes(moved, -1, -2)

    @cached_property
    def _directions(self) -> tuple[np.ndarray, np.ndarray]:
        return np.linalg.eigh(self.information)

    def untold(self, gradient: np.ndarray) -> np.ndarray:
        """Standard deviations (..., M) of values by directions of the placement of which the datums say less than was
        known before."""
        left = self._untold(gradient)
        return np.sqrt((left**2).sum(-1))

    def matters(self, gradient: np.ndarray, variances: np.ndarray, quantities: tuple[Quantity, ...]) -> np.ndarray:
        """Whether what is `untold` is more than a bias may be, beside noise (..., M) and tolerances; bool (..., M)."""
        halves = np.array([0.0 if each.tolerance is None else each.tolerance.half for each in quantities])
        with np.errstate(invalid="ignore"):
            return self.untold(gradient) > np.maximum(OF_SIGMA * np.sqrt(variances), OF_TOLERANCE * halves)

    def guilty(self, gradient: np.ndarray) -> str:
        """The component that has most of the direction which matters most to one value of one picture, by its
        gradient (q,); with the camera's, all that cannot be told from each other."""
        left = self._untold(gradient[None])[0]
        direction = self._directions[1][:, int(np.abs(left).argmax())]
        first, names = int(np.abs(direction).argmax()), self.placing.names
        if set(names) <= set(COMPONENTS):
            return names[first]
        moves = np.abs(self.pulls(gradient[None])[0] * direction)
        return " or ".join(name for i, name in enumerate(names) if i == first or moves[i] > moves.max() / 2)

    def _untold(self, gradient: np.ndarray) -> np.ndarray:
        """What each direction adds, (..., M, k)."""
        sizes, directions = self._directions
        weak = np.where(sizes < 1, 1 / (1 + np.maximum(sizes, 0.0)), 0.0)
        return (self.pulls(gradient) @ directions) * weak[..., None, :]


def _datums(scene: Scene, seen: Seen) -> tuple[np.ndarray, np.ndarray]:
    """Which parameters are those of datums (q,), and their covariance on the part (..., q, q)."""
    which, sd = np.zeros(seen.count, bool), scene.placement.datum_sd or 0.0
    scatter = np.zeros((*seen.sensors.shape[:-1], seen.count, seen.count))
    for each in datums_of(scene):
        if not isinstance(each, Side):
            part = seen.numbers(seen.circles.index(each.circle))
            which[part] = True
            scatter[..., part, part] = sd**2 * np.eye(part.stop - part.start)
            continue
        e = seen.names.index(each.edge)
        part = slice(2 * e, 2 * e + 2)
        which[part] = True
        off = sd * seen.per_unit(each, ends_of(seen.solid, each), seen.normals[..., e, :])
        length = np.linalg.norm(seen.along[..., e, :], axis=-1)
        to_line = np.zeros((*length.shape, 2, 2))  # from offsets of both ends to displacement and rotation
        to_line[..., 0, 0], to_line[..., 1, 0], to_line[..., 1, 1] = 1.0, -1 / length, 1 / length
        spread = to_line * off[..., None, :]
        scatter[..., part, part] = spread @ np.swapaxes(spread, -1, -2)
    return which, scatter
