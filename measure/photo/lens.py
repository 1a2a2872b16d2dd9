"""A camera's intrinsics and distortion (OpenCV's model), undone on points rather than on the image."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
from pydantic import AfterValidator, Field, ValidationError

from imaging.features.locator import reach
from imaging.geometry.lens import unbent
from measure.estimators.gradient import gradient_along
from measure.features.calipers import edge_calipers
from measure.features.corners import corner_response, intersect, line_equations
from measure.features.layout import Layout
from measure.features.lines import fit_lines, regression
from measure.features.points import EdgePoints
from scenes import InvalidInput
from scenes.cameras import Splined
from scenes.errors import describe
from scenes.files.door import read_toml
from scenes.model import Model


def _not_tiny(value: float) -> float:
    if value < 1e-3:
        raise ValueError(f"a focal length must be at least 0.001 px, got {value:g}")
    return value


_Focal = Annotated[float, Field(gt=0, le=1e12), AfterValidator(_not_tiny)]


class Intrinsics(Model):
    """Intrinsics in px and distortion coefficients k1, k2, p1, p2, k3 (OpenCV's order, the rest 0)."""

    fx: _Focal
    fy: _Focal
    cx: Annotated[float, Field(ge=-1e9, le=1e9)]
    cy: Annotated[float, Field(ge=-1e9, le=1e9)]
    distortion: Annotated[tuple[Annotated[float, Field(ge=-1e6, le=1e6)], ...], Field(max_length=5)] = ()

    @property
    def matrix(self) -> np.ndarray:
        """Camera matrix, shape (3, 3)."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @property
    def coefficients(self) -> np.ndarray:
        """All five, shape (5,)."""
        return np.array([*self.distortion, *[0.0] * (5 - len(self.distortion))])

    def straighten(self, points: np.ndarray) -> np.ndarray:
        """Where image points (..., 2), px, would be without distortion, px of the same camera matrix."""
        flat = np.asarray(points, float).reshape(-1, 1, 2)
        if not flat.size:  # OpenCV answers nothing
            return np.empty(np.shape(points))
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
        straight = cv2.undistortPoints(flat, self.matrix, self.coefficients, None, None, self.matrix, criteria)
        return straight.reshape(np.shape(points))

    def distort(self, points: np.ndarray) -> np.ndarray:
        """The inverse of `straighten`."""
        points = np.asarray(points, float)
        x = (points[..., 0] - self.cx) / self.fx
        y = (points[..., 1] - self.cy) / self.fy
        rays = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 1, 3)
        zero = np.zeros(3)
        if not rays.size:
            return np.empty(points.shape)
        bent, _ = cv2.projectPoints(rays, zero, zero, self.matrix, self.coefficients)
        return bent.reshape(points.shape)


class SplinedIntrinsics(Model):
    """One focal length, the image's middle and displacements that are splines, px and focal lengths."""

    fx: _Focal
    cx: Annotated[float, Field(ge=-1e9, le=1e9)]
    cy: Annotated[float, Field(ge=-1e9, le=1e9)]
    spline: Splined

    @property
    def fy(self) -> float:
        """As fx: what differs is the splines'."""
        return self.fx

    def straighten(self, points: np.ndarray) -> np.ndarray:
        """As `Intrinsics.straighten`; NaN where nothing is known of the lens."""
        return self._middle + self.fx * unbent((np.asarray(points, float) - self._middle) / self.fx, self.spline)

    def distort(self, points: np.ndarray) -> np.ndarray:
        """The inverse of `straighten`."""
        return self._middle + self.fx * self.spline.bent((np.asarray(points, float) - self._middle) / self.fx)

    @property
    def _middle(self) -> np.ndarray:
        return np.array([self.cx, self.cy])


AnyIntrinsics = Intrinsics | SplinedIntrinsics


def load_lens(path: Path) -> AnyIntrinsics:
    """Read a lens from TOML; a splined one has a table ``spline``.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is no TOML, or a value in it is bad.
    """
    try:
        told = read_toml(path)
        return (SplinedIntrinsics if "spline" in told else Intrinsics).model_validate(told)
    except ValidationError as error:
        raise InvalidInput(f"{path}: {describe(error)}") from None


@dataclass(frozen=True, eq=False)
class Straightened:
    """Corners of a polygon freed from distortion: (x, y) px (k, 2), joint covariance (2 k, 2 k) px^2, points used."""

    corners: np.ndarray
    covariance: np.ndarray
    used: np.ndarray


def straight_corners(image: np.ndarray, layout: Layout, lens: AnyIntrinsics) -> Straightened:
    """Corners of a layout given in straightened coordinates, from edge points found in the distorted image.

    Edge points are sought along the bent image of each side, straightened one by one, and fitted by straight lines.

    Raises
    ------
    InvalidInput
        If on a side no edge points are found.
    """
    optics = layout.optics
    clear = reach(optics.scale_px, optics.most_blur_px)
    calipers = edge_calipers(layout, clear, 0.0)
    lines, blocks, used = [], [], []
    for caliper in calipers:
        t, place, toward = _bent(caliper, lens)
        inside = _room(place, optics)
        if inside.sum() < 3:
            raise InvalidInput(f"side {caliper.name} must have edge points in the image, got none")
        locator = gradient_along(optics, t[inside], place[inside], toward[inside])
        found = locator.locate(image[None])
        points = lens.straighten(place[inside] + found.offset[0][:, None] * toward[inside])
        along, offset = caliper.coordinates(points)
        line = fit_lines(EdgePoints(along[None], offset[None], found.valid, found.contrast, found.reversed))
        if not np.isfinite(line.tilt).all() or found.valid.mean() < 0.5:
            raise InvalidInput(f"side {caliper.name} must stand out of the noise, got {found.valid.sum()} edge points")
        slope = float(np.tan(line.tilt[0]))
        lines.append((float(line.mean_offset[0] - slope * line.mean_along[0]), slope))
        response = regression(along) @ locator.unit_noise().response / max(float(found.contrast[0]), 1e-12)
        to_start = np.array([[1, -along.mean()], [0, 1]])
        blocks.append(to_start @ (optics.noise_variance * response @ response.T) @ to_start.T)
        used.append(int(found.valid.sum()))
    return _corners(layout, calipers, np.array(lines), blocks, np.array(used))


def _bent(caliper, lens: AnyIntrinsics) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stations of a side, their places in the distorted image, and the unit normals there."""
    t = caliper.positions
    straight = caliper.at(t, np.zeros(1))
    step = 1e-3
    place = lens.distort(straight)
    ahead = lens.distort(straight + step * caliper.direction) - lens.distort(straight - step * caliper.direction)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    return t, place, np.stack([-ahead[:, 1], ahead[:, 0]], 1)


def _room(place: np.ndarray, optics) -> np.ndarray:
    margin = optics.window_px + 4 * optics.scale_px + 1
    return ((place >= margin) & (place <= np.array(optics.shape[::-1]) - 1 - margin)).all(1)


def _corners(layout: Layout, calipers, lines: np.ndarray, blocks, used: np.ndarray) -> Straightened:
    normals, points = line_equations(calipers, lines[None, :, 0], lines[None, :, 1])
    corners = [intersect(normals[:, list(pair)], points[:, list(pair)])[0][0] for pair in layout.corners]
    response = np.concatenate([corner_response(calipers, pair) for pair in layout.corners])
    whole = np.zeros((2 * len(calipers), 2 * len(calipers)))
    for e, block in enumerate(blocks):
        whole[2 * e : 2 * e + 2, 2 * e : 2 * e + 2] = block
    return Straightened(np.array(corners), response @ whole @ response.T, used)
