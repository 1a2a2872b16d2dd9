"""Maximum likelihood in Gaussian noise: the image as a linear function of what is unknown near the expected edges.

Around the expected place the image depends linearly on grey levels, on small offsets of the edges and on a small change
of the blur. Least squares in that model is one step of Fisher scoring: as precise as the full likelihood once the
expected place is near, and one matrix product for a whole stack of images. Where the found offset is not small, the
expectation moves there and the step is repeated (`measure.distance`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from measure.estimators.estimate import Estimate, noisy
from measure.features.calipers import Caliper
from measure.features.optics import Optics
from scenes import status

MIN_CONTRAST_SIGMAS = 4.0  # contrast over its own standard error below which there is no edge to be seen


@dataclass(frozen=True, eq=False)
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
    inputs : ndarray, shape (k, P)
        Change of the grey levels with one standard uncertainty of each of k inputs that are known so well before.
    """

    levels: np.ndarray
    start: np.ndarray
    stop: np.ndarray
    offsets: np.ndarray
    blurs: np.ndarray
    inputs: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True, eq=False)
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
    optics : Optics
    """

    calipers: tuple[Caliper, ...]
    pixels: np.ndarray
    rows: np.ndarray
    unit: np.ndarray
    optics: Optics

    @classmethod
    def of(
        cls,
        calipers: tuple[Caliper, ...],
        pixels: np.ndarray,
        columns: Columns,
        optics: Optics,
        deviation: float = 1.0,
    ) -> LikelihoodEstimator:
        """Solve the normal equations once, by an orthogonal decomposition of the scaled columns.

        What is known of inputs before counts as an observation of each (Mikhail and Ackermann, Observations and Least
        Squares, 1976); ``deviation`` is the standard deviation of the pixels' noise, grey levels.
        """
        free = np.concatenate([columns.offsets, columns.levels, columns.blurs], 1)
        known = len(columns.inputs)
        design = np.zeros((len(pixels) + known, free.shape[1] + known))
        design[: len(pixels), : free.shape[1]] = free
        if known:
            design[: len(pixels), free.shape[1] :] = columns.inputs.T
            design[len(pixels) :, free.shape[1] :] = deviation * np.eye(known)
        size = np.linalg.norm(design, axis=0)
        keep = size > 1e-6 * size.max()
        q, r = np.linalg.qr(design[:, keep] / size[keep])
        inverse = np.zeros((design.shape[1], len(pixels)))
        inverse[keep] = np.linalg.solve(r, q[: len(pixels)].T) / size[keep, None]
        first = columns.offsets.shape[1]
        levels = inverse[first : first + columns.levels.shape[1]]
        rows = np.concatenate([inverse[:first], columns.start @ levels, columns.stop @ levels])
        return cls(calipers, pixels, rows, rows @ rows.T, optics)

    @classmethod
    def joined(cls, calipers: tuple[Caliper, ...], parts: list[LikelihoodEstimator | None]) -> LikelihoodEstimator:
        """Estimators of one edge each as one: they share pixels near the corners, and so their errors are correlated.

        Rows of an edge without an estimator are 0, which shows no contrast.
        """
        known = [part for part in parts if part]
        pixels = np.unique(np.concatenate([np.empty(0, int), *(part.pixels for part in known)]))
        edges, rows = len(parts), np.zeros((4 * len(parts), len(pixels)))
        for e, part in enumerate(parts):
            if part:
                rows[np.ix_([2 * e, 2 * e + 1, 2 * edges + e, 3 * edges + e], np.searchsorted(pixels, part.pixels))] = (
                    part.rows
                )
        return cls(calipers, pixels, rows, rows @ rows.T, calipers[0].optics)

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
        with np.errstate(invalid="ignore"):  # an edge that is not visible has no length
            change = (stop - start) / np.array([caliper.length for caliper in self.calipers])
        contrast = np.stack([start, change], -1)
        level, slope = np.moveaxis((self._to_lines(contrast) @ p[..., None])[..., 0], -1, 0)
        size = np.sqrt(np.diag(self.unit)[2 * edges : 3 * edges] + np.diag(self.unit)[3 * edges :]) / 2
        error = np.sqrt(self.optics.noise_variance) * size
        seen = np.minimum(np.abs(start), np.abs(stop)) > MIN_CONTRAST_SIGMAS * error
        steady = start * stop > 0
        count = np.full((n, edges), len(self.pixels))
        state = np.where(seen, np.where(steady, status.OK, status.SIGN_CHANGE), status.LOW_CONTRAST)
        return Estimate(level, slope, contrast, count, np.zeros_like(count), state)

    def _to_lines(self, contrast: np.ndarray) -> np.ndarray:
        """From (p0, p1) to (level, slope) of each edge, shape (n, E, 2, 2), at contrasts (n, E, 2).

        p0 + p1 t = C(t) (a + b t), t the distance from the edge's middle and C linear in it, by least squares along the
        edge; a is the offset at the middle, b the slope.
        """
        length = np.array([caliper.length for caliper in self.calipers])
        c1, lever = contrast[..., 1], length**2 / 12
        c0 = contrast[..., 0] + c1 * self.middles
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.stack([-c1, c0], -1) / (c0**2 - c1**2 * lever)[..., None]
            offset = np.stack([c0, -c1 * lever], -1) / (c0**2 - c1**2 * lever)[..., None]
        return np.stack([offset - self.middles[:, None] * slope, slope], -2)

    def covariance(self, estimate: Estimate, images: np.ndarray) -> np.ndarray:
        edges = len(self.calipers)
        found = noisy(self.rows[: 2 * edges], self.optics, images, self.pixels)
        found = found.reshape(*found.shape[:-2], edges, 2, edges, 2)
        to_lines = self._to_lines(estimate.contrast)
        each = "eifj" if found.ndim == 4 else "neifj"
        whole = np.einsum(f"neai,{each},nfbj->neafb", to_lines, found, to_lines, optimize=True)
        return whole.reshape(len(to_lines), 2 * edges, 2 * edges)

    def respond_within(self, clean: np.ndarray) -> np.ndarray:
        """The rows themselves, divided by the clean image's contrast; the offsets found there are second order."""
        edges = len(self.calipers)
        to_lines = self._to_lines(self.estimate(clean[None]).contrast)[0]
        return (to_lines @ self.rows[: 2 * edges].reshape(edges, 2, -1)).reshape(2 * edges, -1)
