"""The classic pipeline: gradient threshold and Canny's thinning, each edge pixel refined by a parabola."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import sparse

from measure.features.calipers import Caliper
from measure.features.lines import unit_covariance
from measure.features.optics import Optics
from measure.features.points import EdgePoints
from planner.features.locator import edge_blur, kappa2

_FIXED_POINT = 64  # Canny takes gradients as 16-bit integers: 1/64 grey level a pixel
_LARGEST = 32767
_SINGLE = 2.0**16  # grey levels that single precision resolves to 1/256; darkness is brought below
_TRUNCATE = 4


@dataclass(frozen=True)
class CannyLocator:
    """Edge pixels near one expected edge.

    Attributes
    ----------
    caliper : Caliper
    shape : tuple of int
        Of the image.
    scale, blur : float
        Smoothing scale and the lens' blur, px.
    threshold : float
        Smallest gradient of an edge pixel, grey levels a pixel (no hysteresis: one threshold, as in the paper).
    rows, columns : slice
        Part of the image that matters.
    near : ndarray of bool
        Pixels of that part that belong to the edge: within the search window, away from the corners.
    smooth, derive : ndarray
        Sampled Gaussian and its derivative.
    gradient_to_contrast : float
        Contrast of a straight blurred edge whose gradient is 1 at its middle.
    """

    caliper: Caliper
    shape: tuple[int, int]
    scale: float
    blur: float
    threshold: float
    rows: slice
    columns: slice
    near: np.ndarray
    smooth: np.ndarray
    derive: np.ndarray
    gradient_to_contrast: float

    @classmethod
    def of(cls, optics: Optics, caliper: Caliper, threshold: float) -> CannyLocator:
        """Prepare the locator of one edge."""
        scale, window = optics.scale_px, optics.window_px
        x = np.arange(-int(np.ceil(_TRUNCATE * scale)), int(np.ceil(_TRUNCATE * scale)) + 1)
        gauss = np.exp(-(x**2) / (2 * scale**2))
        gauss /= gauss.sum()
        derive = x * gauss / (x**2 * gauss).sum()  # exactly 1 on a ramp of 1 grey level a pixel
        margin = window + _TRUNCATE * scale + 2
        ends = caliper.at(caliper.positions[[0, -1]], np.zeros(2))
        low = np.maximum(np.floor(ends.min(0) - margin), 0).astype(int)
        high = np.minimum(np.ceil(ends.max(0) + margin) + 1, optics.shape[::-1]).astype(int)
        rows, columns = slice(low[1], high[1]), slice(low[0], high[0])
        y, x = np.mgrid[rows, columns]
        along, offset = caliper.coordinates(np.stack([x, y], -1))
        near = (
            (np.abs(offset) <= window) & (along >= caliper.positions[0] - 0.5) & (along <= caliper.positions[-1] + 0.5)
        )
        total = np.hypot(scale, edge_blur(optics.blur_px))
        return cls(
            caliper,
            optics.shape,
            scale,
            optics.blur_px,
            threshold,
            rows,
            columns,
            near,
            gauss,
            derive,
            float(np.sqrt(2 * np.pi) * total),
        )

    def locate(self, images: np.ndarray, chosen: np.ndarray | None = None) -> EdgePoints:
        """Edge points in a stack of images, shape (n, height, width).

        ``chosen`` are the edge pixels to refine, bool like `near`; Canny's own choice in each image when not given.
        """
        gradients = [self.gradient(image) for image in images]
        pixels = [np.nonzero(self.edge_pixels(*gradient) if chosen is None else chosen) for gradient in gradients]
        counts = np.array([len(y) for y, _ in pixels])
        which = np.repeat(np.arange(len(images)), counts)
        y, x = (np.concatenate(part) for part in zip(*pixels, strict=True))
        gx, gy = (np.stack(part) for part in zip(*gradients, strict=True))
        slot = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        along, offset, strength = (np.zeros((len(images), max(counts.max(), 1))) for _ in range(3))
        valid = np.zeros(along.shape, bool)
        points, peak, good = _parabola(gx, gy, which, y, x)
        along[which, slot], offset[which, slot] = self.caliper.coordinates(
            points + [self.columns.start, self.rows.start]
        )
        strength[which, slot], valid[which, slot] = peak, good
        contrast = self.gradient_to_contrast * (strength * valid).sum(1) / np.maximum(valid.sum(1), 1)
        rise = np.zeros(along.shape)
        rise[which, slot] = np.sign(gx[which, y, x] * self.caliper.normal[0] + gy[which, y, x] * self.caliper.normal[1])
        late = along > self.caliper.positions.mean()
        first, second = ((rise * valid * half).sum(1) for half in (~late, late))
        return EdgePoints(along, offset, valid, contrast, first * second < 0)

    @property
    def pixels(self) -> np.ndarray:
        """Flat indices of the pixels that can change the result: the kernel, and what thinning and parabola look at."""
        radius = len(self.smooth) // 2 + 2
        around = cv2.dilate(np.pad(self.near, radius).astype(np.uint8), np.ones((2 * radius + 1,) * 2, np.uint8))
        used = np.zeros(self.shape, bool)
        used[self.rows, self.columns] = around[radius:-radius, radius:-radius]
        return np.flatnonzero(used)

    def unit_covariance(self) -> np.ndarray:
        """Covariance of (mean offset, slope) for unit noise and unit contrast, (2, 2): the closed form of eq. 7."""
        return kappa2(self.scale, self.blur) * unit_covariance(self.caliper.positions, self.scale)

    def linear_response(self, clean: np.ndarray) -> tuple[EdgePoints, sparse.csr_array]:
        """Edge points of one noise-free image and d(offset) / d(pixel), shape (m, height * width).

        Linear in the noise once the edge pixels are chosen; the choice itself is not, and is held fixed.
        """
        gx, gy = self.gradient(clean)
        y, x = np.nonzero(self.edge_pixels(gx, gy))
        _, d_low, d_mid, d_high, gx0, gy0, m0 = _peak(gx[None], gy[None], np.zeros_like(x), y, x)
        toward = (gx0 * self.caliper.normal[0] + gy0 * self.caliper.normal[1]) / m0
        shape = gx.shape
        d_magnitude = sparse.csr_array((x.size, gx.size))
        for step, derivative in ((-1, d_low), (0, d_mid), (1, d_high)):
            picked = _bilinear_matrix(x + step * gx0 / m0, y + step * gy0 / m0, shape)
            d_magnitude = d_magnitude + sparse.diags_array(derivative * toward) @ picked
        magnitude = np.maximum(np.hypot(gx, gy), np.finfo(float).tiny).ravel()
        response = d_magnitude @ (
            sparse.diags_array(gx.ravel() / magnitude) @ self._filter_matrix(shape, self.derive, self.smooth)
            + sparse.diags_array(gy.ravel() / magnitude) @ self._filter_matrix(shape, self.smooth, self.derive)
        )
        local = sparse.coo_array(response)
        row, column = np.divmod(local.col, shape[1])
        flat = (row + self.rows.start) * clean.shape[1] + column + self.columns.start
        return self.locate(clean[None]), sparse.csr_array((local.data, (local.row, flat)), (x.size, clean.size))

    def gradient(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gaussian derivatives along x and y of the part that matters, grey levels a pixel."""
        part = image[self.rows, self.columns]
        base = _SINGLE * np.rint(part.min() / _SINGLE)  # 0 for 8 and 16 bit images
        part = np.ascontiguousarray(part - base, dtype=np.float32)
        border = cv2.BORDER_REPLICATE
        return (
            cv2.sepFilter2D(part, cv2.CV_32F, self.derive, self.smooth, borderType=border),
            cv2.sepFilter2D(part, cv2.CV_32F, self.smooth, self.derive, borderType=border),
        )

    def edge_pixels(self, gx: np.ndarray, gy: np.ndarray) -> np.ndarray:
        """Pixels near the edge that Canny keeps: gradient above the threshold and largest along its direction."""
        steepest = max(float(np.abs(gx).max()), float(np.abs(gy).max()), 1.0)
        unit = min(_FIXED_POINT, _LARGEST / steepest)  # coarser in a picture so bright that the integers would saturate
        fixed = [np.rint(g * unit).astype(np.int16) for g in (gx, gy)]
        limit = self.threshold * unit
        return (cv2.Canny(fixed[0], fixed[1], limit, limit, L2gradient=True) > 0) & self.near

    def _filter_matrix(self, shape: tuple[int, int], along_x: np.ndarray, along_y: np.ndarray) -> sparse.csr_array:
        """The separable filter as a matrix on the flattened part of the image (inside its border)."""
        radius = len(along_x) // 2
        matrices = [
            sparse.diags_array(list(kernel), offsets=list(range(-radius, radius + 1)), shape=(size, size))
            for kernel, size in ((along_y, shape[0]), (along_x, shape[1]))
        ]
        return sparse.csr_array(sparse.kron(*matrices))


def _parabola(gx, gy, which, y, x):
    """Refined points (k, 2) as (x, y), gradient there, and whether the pixel is a proper peak."""
    shift, *_, gx0, gy0, m0 = _peak(gx, gy, which, y, x)
    points = np.stack([x + shift * gx0 / m0, y + shift * gy0 / m0], -1)
    return points, m0, np.abs(shift) <= 1


def _peak(gx, gy, which, y, x):
    """Shift of the gradient's maximum along itself, px, its derivatives by the three magnitudes, and the gradient."""
    gx0, gy0 = gx[which, y, x].astype(float), gy[which, y, x].astype(float)
    m0 = np.hypot(gx0, gy0)
    magnitude = np.hypot(gx, gy)
    low = _bilinear(magnitude, which, x - gx0 / m0, y - gy0 / m0)
    high = _bilinear(magnitude, which, x + gx0 / m0, y + gy0 / m0)
    bend = np.minimum(low - 2 * m0 + high, -1e-9 * np.maximum(m0, 1e-30))  # flat: no peak, and no overflow
    shift = (low - high) / (2 * bend)
    return shift, (0.5 - shift) / bend, 2 * shift / bend, (-0.5 - shift) / bend, gx0, gy0, m0


def _corners_of(x, y):
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - x0, y - y0
    return [
        (y0, x0, (1 - fy) * (1 - fx)),
        (y0, x0 + 1, (1 - fy) * fx),
        (y0 + 1, x0, fy * (1 - fx)),
        (y0 + 1, x0 + 1, fy * fx),
    ]


def _bilinear(stack, which, x, y):
    height, width = stack.shape[1:]
    return sum(w * stack[which, np.minimum(j, height - 1), np.minimum(i, width - 1)] for j, i, w in _corners_of(x, y))


def _bilinear_matrix(x, y, shape):
    rows = np.arange(x.size)
    parts = [(w, (rows, j * shape[1] + i)) for j, i, w in _corners_of(x, y)]
    data = np.concatenate([w for w, _ in parts])
    index = tuple(np.concatenate([p[1][k] for p in parts]) for k in (0, 1))
    return sparse.csr_array((data, index), (x.size, shape[0] * shape[1]))
