"""Maximum likelihood in Gaussian noise: the image as a linear function of what is unknown near the expected edges.

Around the expected place the image depends linearly on grey levels, on small offsets of the edges and on a small change
of the blur. Least squares in that model is one step of Fisher scoring: as precise as the full likelihood once the
expected place is near, and one matrix product for a whole stack of images. Where the found offset is not small, the
expectation moves there and the step is repeated (`measure.distance`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from measure import status
from measure.estimators.estimate import Estimate, Response, scaled
from measure.features.calipers import Caliper

MIN_CONTRAST_SIGMAS = 4.0  # contrast over its own standard error below which there is no edge to be seen


@dataclass(frozen=True)
class Columns:
    """Columns of the linear model on P pixels.

    Attributes
    ----------
    levels : ndarray, shape (P, q)
        Basis functions of the grey levels times the part of each pixel that they fill.
    start, stop : ndarray, shape (E, q)
        Rows that give each edge's contrast (inside minus outside) at its two ends from the levels.
    offsets : ndarray, shape (P, 2 E)
        Change of the coverage with an edge's offset, and with its tilt about the edge's middle.
    blurs : ndarray, shape (P, b)
        Change of the coverage with the blur.
    """

    levels: np.ndarray
    start: np.ndarray
    stop: np.ndarray
    offsets: np.ndarray
    blurs: np.ndarray


@dataclass(frozen=True)
class LikelihoodEstimator:
    """Least squares in the linear model of a few edges at once.

    Attributes
    ----------
    calipers : tuple of Caliper
    pixels : ndarray of int
        Flat indices of the P pixels.
    rows : ndarray, shape (4 E, P)
        Linear functions of the image: for each edge (p0, p1), then for each edge its contrast at both ends.
    unit : ndarray, shape (4 E, 4 E)
        Their covariance for unit noise variance.
    noise : float
        Standard deviation of a grey level.
    """

    calipers: tuple[Caliper, ...]
    pixels: np.ndarray
    rows: np.ndarray
    unit: np.ndarray
    noise: float

    @classmethod
    def of(
        cls, calipers: tuple[Caliper, ...], pixels: np.ndarray, columns: Columns, noise: float
    ) -> LikelihoodEstimator:
        """Solve the normal equations once, by an orthogonal decomposition of the scaled columns."""
        design = np.concatenate([columns.offsets, columns.levels, columns.blurs], 1)
        size = np.linalg.norm(design, axis=0)
        keep = size > 1e-6 * size.max()
        q, r = np.linalg.qr(design[:, keep] / size[keep])
        inverse = np.zeros((design.shape[1], len(pixels)))
        inverse[keep] = np.linalg.solve(r, q.T) / size[keep, None]
        first = columns.offsets.shape[1]
        levels = inverse[first : first + columns.levels.shape[1]]
        rows = np.concatenate([inverse[:first], columns.start @ levels, columns.stop @ levels])
        return cls(calipers, pixels, rows, rows @ rows.T, noise)

    @property
    def middles(self) -> np.ndarray:
        """Place along each edge about which its tilt is taken, px, shape (E,)."""
        return np.array([caliper.length / 2 for caliper in self.calipers])

    def estimate(self, images: np.ndarray) -> Estimate:
        used = images.reshape(len(images), -1)[:, self.pixels]
        return self._estimate(used @ self.rows.T)

    def _estimate(self, found: np.ndarray) -> Estimate:
        edges, n = len(self.calipers), len(found)
        p = found[:, : 2 * edges].reshape(n, edges, 2)
        start, stop = found[:, 2 * edges : 3 * edges], found[:, 3 * edges :]
        offset, tilt = self._solve(p, start, stop)
        error = self.noise * np.sqrt(np.diag(self.unit)[2 * edges : 3 * edges] + np.diag(self.unit)[3 * edges :]) / 2
        seen = np.minimum(np.abs(start), np.abs(stop)) > MIN_CONTRAST_SIGMAS * error
        steady = start * stop > 0
        contrast = np.stack([start, (stop - start) / np.array([caliper.length for caliper in self.calipers])], -1)
        count = np.full((n, edges), len(self.pixels))
        state = np.where(seen, np.where(steady, status.OK, status.SIGN_CHANGE), status.LOW_CONTRAST)
        return Estimate(offset - self.middles * tilt, tilt, contrast, count, np.zeros_like(count), state)

    def _solve(self, p: np.ndarray, start: np.ndarray, stop: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Offset at the middle and tilt from p0 + p1 t = C(t) (a + b t), least squares along the edge, (n, E)."""
        length = np.array([caliper.length for caliper in self.calipers])
        c0, c1 = (start + stop) / 2, (stop - start) / length
        lever = length**2 / 12
        determinant = c0**2 - c1**2 * lever
        with np.errstate(divide="ignore", invalid="ignore"):
            offset = (c0 * p[..., 0] - c1 * lever * p[..., 1]) / determinant
            tilt = (c0 * p[..., 1] - c1 * p[..., 0]) / determinant
        return offset, tilt

    def covariance(self, estimate: Estimate) -> np.ndarray:
        edges = len(self.calipers)
        contrast = estimate.contrast[..., 0] + estimate.contrast[..., 1] * self.middles
        return scaled(self.unit[: 2 * edges, : 2 * edges], contrast, self.middles)

    def respond(self, clean: np.ndarray) -> Response:
        """The rows themselves, divided by the clean image's contrast; the offsets found there are second order."""
        estimate = self.estimate(clean[None])
        edges = len(self.calipers)
        lines = np.zeros((2 * edges, clean.size))
        for e in range(edges):
            c0 = estimate.contrast[0, e, 0] + estimate.contrast[0, e, 1] * self.middles[e]
            c1, lever = estimate.contrast[0, e, 1], self.calipers[e].length ** 2 / 12
            p0, p1 = self.rows[2 * e], self.rows[2 * e + 1]
            determinant = c0**2 - c1**2 * lever
            offset, tilt = (c0 * p0 - c1 * lever * p1) / determinant, (c0 * p1 - c1 * p0) / determinant
            lines[2 * e, self.pixels], lines[2 * e + 1, self.pixels] = offset - self.middles[e] * tilt, tilt
        return Response(estimate, lines)
