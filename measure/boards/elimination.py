"""Least squares of one camera and many boards: what each board's pose takes is eliminated first.

With J and K the derivatives of a board's residuals by what all share and by its own pose, the shared unknowns see
J (1 - K K+) alone. One triangle of them remains, whatever the number of boards (Brown 1958).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

_TRIES = 200
_SETTLED = 1e-10  # of chi-square, that a step may still gain: then no estimate is 1e-5 of its sigma off the least
_WORST = 1e10  # condition number
_DAMPED, _LESS, _MORE, _MOST = 1e-3, 0.1, 8.0, 1e12


@dataclass(frozen=True, eq=False)
class Block:
    """A board's residuals (m,), their derivatives by the shared unknowns (m, s) and by its pose (m, 6)."""

    residual: np.ndarray
    shared: np.ndarray
    own: np.ndarray

    def without_pose(self, damped: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows (m, s) and residuals (m,) that no pose explains; ``damped`` (6,) holds the pose."""
        basis = np.linalg.qr(np.concatenate([self.own, np.diag(damped)]))[0][: len(self.own)]
        rest = np.concatenate([self.shared, self.residual[:, None]], 1)
        rest = rest - basis @ (basis.T @ rest)
        return rest[:, :-1], rest[:, -1]

    def pose_step(self, step: np.ndarray, damped: np.ndarray) -> np.ndarray:
        """Of the pose (6,), once the shared unknowns' step is known."""
        left = -(self.residual + self.shared @ step)
        rows = np.concatenate([self.own, np.diag(damped)])
        return np.linalg.lstsq(rows, np.concatenate([left, np.zeros(len(damped))]))[0]


Point = tuple[np.ndarray, np.ndarray]
"""The shared unknowns (s,), and the poses (boards, 6)."""


def minimised(
    blocks: Callable[[Point], list[Block]],
    cost: Callable[[Point], float],
    prior: np.ndarray,
    start: Point,
    allowed: Callable[[np.ndarray], bool],
) -> Point:
    """Least sum of squares by Levenberg and Marquardt's method, of residuals in units of their standard deviations.

    Parameters
    ----------
    blocks, cost : callable
        Each board's residuals with derivatives at a point, and the sum of all squares, those of the prior too.
    prior : ndarray, shape (p, s)
        Rows whose products with the shared unknowns are residuals as well.
    start : Point
    allowed : callable
        Whether shared unknowns may be what they are.
    """
    point, damping, now = start, _DAMPED, cost(start)
    for _ in range(_TRIES):
        here = blocks(point)
        while damping < _MOST:
            step, gain = _step(here, prior, point[0], damping)
            ahead = point[0] + step[0], point[1] + step[1]
            then = cost(ahead) if allowed(ahead[0]) else np.inf
            if then <= now:
                break
            damping *= _MORE
        else:
            return point
        # a damped step may gain little far from the least: what one without damping would gain says how far it is
        settled = gain <= _SETTLED and _step(here, prior, point[0], 0.0)[1] <= _SETTLED
        point, now, damping = ahead, then, max(damping * _LESS, 1e-12)
        if settled:
            break
    return point


def _step(here: Sequence[Block], prior: np.ndarray, shared: np.ndarray, damping: float) -> tuple[Point, float]:
    """One step, and what it would gain if residuals were linear."""
    size = np.sqrt(sum((block.shared**2).sum(0) for block in here) + (prior**2).sum(0))
    size = np.where(size > 0, size, 1.0)
    damped = [np.sqrt(damping) * np.maximum(np.linalg.norm(block.own, axis=0), 1e-300) for block in here]
    normal = prior.T @ prior + damping * np.diag(size**2)
    right = prior.T @ (prior @ shared)
    for block, hold in zip(here, damped, strict=True):
        rows, _ = block.without_pose(hold)
        # the damped elimination is no projection: products with the rows as they were keep it symmetric
        normal += block.shared.T @ rows
        right += rows.T @ block.residual
    even = (normal + normal.T) / (2 * np.outer(size, size))
    step = -np.linalg.lstsq(even, right / size, rcond=1e-15)[0] / size if len(size) else np.zeros(0)
    poses = np.array([block.pose_step(step, hold) for block, hold in zip(here, damped, strict=True)])
    gain = (prior @ shared) @ (prior @ shared) - (prior @ (shared + step)) @ (prior @ (shared + step))
    for block, pose in zip(here, poses, strict=True):
        then = block.residual + block.shared @ step + block.own @ pose
        gain += block.residual @ block.residual - then @ then
    return (step, poses), float(gain)


def covariance(here: Sequence[Block], prior: np.ndarray) -> np.ndarray:
    """Inverse normal matrix of the shared unknowns and all poses, (s + 6 n,) squared; infinite where the residuals
    determine nothing."""
    s, n = prior.shape[1], len(here)
    nothing = np.full((s + 6 * n, s + 6 * n), np.inf)
    size = np.sqrt(sum((block.shared**2).sum(0) for block in here) + (prior**2).sum(0))
    own = [np.linalg.norm(block.own, axis=0) for block in here]
    if not all((each > 0).all() for each in (size, *own)):
        return nothing
    rows = [block.without_pose(np.zeros(6))[0] for block in here]
    triangle = np.linalg.qr(np.concatenate([*rows, prior]) / size, mode="r") if s else np.zeros((0, 0))
    posed = [np.linalg.qr(block.own / each) for block, each in zip(here, own, strict=True)]
    if max(np.linalg.cond(each) for each in (triangle, *(upper for _, upper in posed)) if each.size) > _WORST:
        return nothing
    root = np.linalg.inv(triangle) / size[:, None]
    roots = [root]  # of the unknowns by the shared residuals: a pose follows what all share
    for block, (basis, upper), each in zip(here, posed, own, strict=True):
        roots.append(-np.linalg.solve(upper, basis.T @ (block.shared @ root)) / each[:, None])
    whole = np.concatenate(roots)
    found = whole @ whole.T
    for i, ((_, upper), each) in enumerate(zip(posed, own, strict=True)):
        inverse = np.linalg.inv(upper) / each[:, None]
        some = slice(s + 6 * i, s + 6 * i + 6)
        found[some, some] += inverse @ inverse.T
    return found
