"""Edge points at the zero crossing of the Gaussian second derivative across the edge.

The derivative at a fixed place is a linear function of the image, so all places of all edges are one sparse matrix,
applied to a whole stack of images at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from measure.features.calipers import Caliper
from measure.features.lines import trapezoid, trend_along
from measure.features.optics import Optics
from measure.features.points import EdgePoints, UnitNoise
from planner.features.locator import edge_blur

STEP = 0.5  # px between the places across the edge
_TRUNCATE = 4  # standard deviations at which the kernel ends


@dataclass(frozen=True)
class GradientLocator:
    """Zero-crossing locator for one edge, straight or curved.

    Attributes
    ----------
    positions : ndarray, shape (m,)
        Places along the edge, px (or any other parameter of a curve).
    offsets : ndarray, shape (T,)
        Places across the edge, px.
    pixels : ndarray of int
        Flat indices of the pixels that matter.
    kernel : csr_array, shape (m * T, len(pixels))
        Second derivative across the edge at each position and place.
    slope_to_contrast : ndarray, shape (m,)
        Contrast of a straight blurred edge whose second derivative has slope 1 at the crossing.
    gain : ndarray, shape (m,)
        Ideal px across the edge for a recorded px.
    """

    positions: np.ndarray
    offsets: np.ndarray
    pixels: np.ndarray
    kernel: sparse.csr_array
    slope_to_contrast: np.ndarray
    gain: np.ndarray

    @classmethod
    def of(cls, optics: Optics, caliper: Caliper) -> GradientLocator:
        """Prepare the locator of a straight edge."""
        places, normals, gain = caliper.curve()
        return cls.along_curve(optics, caliper.positions, places, normals, gain, caliper.blur(caliper.positions))

    @classmethod
    def along_curve(
        cls, optics: Optics, positions: np.ndarray, places: np.ndarray, normals: np.ndarray,
        gain: np.ndarray | float = 1.0, blur: np.ndarray | float | None = None,
    ) -> GradientLocator:  # fmt: skip
        """Prepare the locator of a recorded curve given by places (m, 2) on it and unit normals (m, 2) there.

        ``gain`` (m,) and ``blur`` (m,) are 1 and the optics' where not given.
        """
        half = int(np.ceil(optics.window_px / STEP))
        offsets = STEP * np.arange(-half, half + 1)
        across = (places[:, None] + offsets[:, None] * normals[:, None]).reshape(-1, 2)
        kernel = second_derivative(across, np.repeat(normals, offsets.size, 0), optics.scale_px, optics.shape)
        pixels = np.unique(kernel.indices)
        total = np.hypot(optics.scale_px, edge_blur(optics.blur_px if blur is None else blur)) * np.ones(len(places))
        to_contrast = np.sqrt(2 * np.pi) * total**3
        return cls(positions, offsets, pixels, kernel[:, pixels], to_contrast, gain * np.ones(len(places)))

    def locate(self, images: np.ndarray) -> EdgePoints:
        """Edge points in a stack of images, shape (n, height, width)."""
        profiles = self._profiles(images)
        turned = _reversed(profiles)
        profiles *= _polarity(profiles)
        return self._points(*_bracket(profiles), profiles, turned)

    def _points(self, crossing, start, found, profiles: np.ndarray, turned: np.ndarray) -> EdgePoints:
        offset, slope = _refine(profiles, crossing, start)
        valid = found & (np.abs(offset - start) < 1)
        offset = np.where(valid, self.offsets[0] + STEP * offset, 0.0)
        slope = np.where(valid, -slope / STEP, 0.0)
        along = np.broadcast_to(self.positions, (profiles.shape[2], self.positions.size))
        contrast, trend, _ = trend_along(along, self.slope_to_contrast * slope.T, 1.0 * valid.T)
        return EdgePoints(along, offset.T * self.gain, valid.T, contrast, turned, trend, trapezoid(self.positions))

    def unit_noise(self) -> UnitNoise:
        """Response to noise on a straight edge of unit contrast: the second derivative's over its slope."""
        middle = self.kernel[self.offsets.size // 2 :: self.offsets.size]
        response = sparse.diags_array(self.slope_to_contrast * self.gain) @ middle
        return UnitNoise(self.positions, trapezoid(self.positions), response)

    def linear_response(self, clean: np.ndarray) -> tuple[EdgePoints, sparse.csr_array]:
        """Edge points of one noise-free image and d(offset) / d(pixel), shape (m, height * width)."""
        profiles = self._profiles(clean[None])
        turned, polarity = _reversed(profiles), _polarity(profiles)
        profiles *= polarity
        crossing, start, found = _bracket(profiles)
        root, slope = _refine(profiles, crossing, start)
        weights = _cubic_weights(root - crossing)
        rows = np.arange(crossing.shape[0])[:, None]
        columns = rows * self.offsets.size + crossing[:, :1] + np.arange(-1, 3)
        values = -STEP * weights[:, 0] / slope[:, :1] * polarity[0] * self.gain[:, None]
        pick = sparse.csr_array(
            (values.ravel(), (np.repeat(rows, 4), columns.ravel())), (rows.size, self.kernel.shape[0])
        )
        near = pick @ self.kernel
        near = sparse.coo_array(near)
        full = sparse.csr_array((near.data, (near.row, self.pixels[near.col])), (rows.size, clean.size))
        return self._points(crossing, start, found, profiles, turned), full

    def _profiles(self, images: np.ndarray) -> np.ndarray:
        """Second derivative at all places, shape (m, T, n)."""
        used = np.ascontiguousarray(images.reshape(len(images), -1)[:, self.pixels].T)
        return (self.kernel @ used).reshape(self.positions.size, self.offsets.size, len(images))


def second_derivative(
    places: np.ndarray, normals: np.ndarray, scale: float, shape: tuple[int, int]
) -> sparse.csr_array:
    """Rows that take the Gaussian second derivative of an image at places (M, 2) along unit normals (M, 2), px.

    The sampled kernel is corrected to sum to exactly zero, so that a constant image gives 0.
    """
    radius = int(np.ceil(_TRUNCATE * scale))
    nearest = np.rint(places).astype(int)
    grid = np.arange(-radius, radius + 1)
    dx = (nearest - places)[:, 0, None, None] + grid
    dy = (nearest - places)[:, 1, None, None] + grid[:, None]
    gauss = np.exp(-(dx**2 + dy**2) / (2 * scale**2)) / (2 * np.pi * scale**2)
    across = dx * normals[:, 0, None, None] + dy * normals[:, 1, None, None]
    values = gauss * (across**2 / scale**2 - 1) / scale**2
    values -= gauss * (values.sum((1, 2)) / gauss.sum((1, 2)))[:, None, None]
    columns = (nearest[:, 1, None, None] + grid[:, None]) * shape[1] + nearest[:, 0, None, None] + grid
    starts = np.arange(len(places) + 1) * grid.size**2
    return sparse.csr_array((values.ravel(), columns.ravel(), starts), (len(places), shape[0] * shape[1]))


def _polarity(profiles: np.ndarray) -> np.ndarray:
    """+1 where the image brightens along the normal, else -1; one sign an image, shape (n,)."""
    return np.where(_rise(profiles).sum(0) >= 0, 1.0, -1.0)


def _rise(profiles: np.ndarray) -> np.ndarray:
    """How much the image brightens along the normal at each position, (m, n)."""
    half = profiles.shape[1] // 2
    return profiles[:, :half].sum(1) - profiles[:, half + 1 :].sum(1)


def _reversed(profiles: np.ndarray) -> np.ndarray:
    """Whether the two halves of the edge brighten in opposite directions, each as clearly as the other, (n,)."""
    rise = _rise(profiles)
    first, second = (part.mean(0) for part in np.array_split(rise, 2))
    noise = np.abs(np.diff(rise, axis=0)).mean(0)
    return (first * second < 0) & (np.minimum(np.abs(first), np.abs(second)) > 2 * noise)


def _bracket(signed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Steepest descent through zero: left index, first estimate (in steps) and whether there is one; shape (m, n)."""
    left, right = signed[:, 1:-2], signed[:, 2:-1]
    fall = (left - right) * ((left >= 0) & (right < 0))
    best = fall.argmax(1)
    here = np.take_along_axis(left, best[:, None], 1)[:, 0]
    drop = np.take_along_axis(fall, best[:, None], 1)[:, 0]
    found = drop > 0
    return best + 1, best + 1 + np.where(found, here / np.where(found, drop, 1), 0), found


def _refine(signed: np.ndarray, crossing: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Root (in steps) of the cubic through the four values around the crossing, and its slope there; shape (m, n)."""
    values = np.stack([np.take_along_axis(signed, crossing[:, None] + k, 1)[:, 0] for k in (-1, 0, 1, 2)])
    c0 = values[1]
    c1 = -values[0] / 3 - values[1] / 2 + values[2] - values[3] / 6
    c2 = (values[0] + values[2]) / 2 - values[1]
    c3 = (values[3] - values[0]) / 6 + (values[1] - values[2]) / 2
    x = start - crossing
    for _ in range(3):
        slope = c1 + x * (2 * c2 + 3 * x * c3)
        x = x - (c0 + x * (c1 + x * (c2 + x * c3))) / np.where(slope < 0, slope, -np.inf)
    return crossing + x, c1 + x * (2 * c2 + 3 * x * c3)


def _cubic_weights(x: np.ndarray) -> np.ndarray:
    """Weights of the values at -1, 0, 1, 2 in the cubic's value at x, shape (m, n, 4) for x (m, n)."""
    return np.stack(
        [
            -x * (x - 1) * (x - 2) / 6,
            (x + 1) * (x - 1) * (x - 2) / 2,
            -(x + 1) * x * (x - 2) / 2,
            (x + 1) * x * (x - 1) / 6,
        ],
        -1,
    )
