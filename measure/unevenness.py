"""What uneven surfaces do to measured values: they move each by its derivatives by the pixels, of whatever estimator.

A field that multiplies a face's diffuse reflectance changes a pixel's level by the mean of (factor - 1) times the
diffuse signal over what the lens' blur and the pixel's area gather. Times the value's derivatives by the pixels that is
a sum over the field; of filtered white noise, the same filter applied to the sum's weights gives the variance over
parts (`imaging.models.texture` has the same of the gradient locator in closed form, without an image).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.ndimage import gaussian_filter

from imaging.geometry.blur import blur_at
from imaging.geometry.lens import undistorted
from imaging.geometry.looked_at import looked_at
from imaging.geometry.projection import depth
from imaging.geometry.rays import reaches
from imaging.light.appearance import diffuse_signal
from imaging.light.between import light_between
from imaging.light.sheets import Sheet, sheets
from imaging.models.texture import field_covariance
from imaging.pictures import Pictures
from scenes import Picture

_FINE, _MOST = 4, 4_000_000  # places along a pixel's side, and in all
_REACH = 4.0  # standard deviations at which the lens' blur ends


@dataclass(frozen=True, eq=False)
class _Face:
    """An uneven face where it is seen: at k places, numbered, whose points (k, 3) would have a diffuse signal (k,)."""

    sheet: Sheet
    places: np.ndarray
    points: np.ndarray
    signal: np.ndarray
    blur_px: float


@dataclass(frozen=True, eq=False)
class Unevenness:
    """The statistical textures of a picture, seen through each pixel at some places.

    Attributes
    ----------
    picture : Picture
        Whose lights are known.
    window : pair of slice
        Rows and columns of the image that are looked at.
    """

    picture: Picture
    window: tuple[slice, slice]

    @classmethod
    def about(cls, picture: Picture, response: sparse.csr_array) -> Unevenness:
        """About the pixels by which values have derivatives, (M, height * width)."""
        camera = picture.scene.camera
        reach = math.ceil(2 * _REACH * camera.most_blur_px) + 1
        used = np.divmod(np.unique(response.indices), camera.width)
        sizes = camera.height, camera.width
        window = (
            slice(max(int(each.min()) - reach, 0), min(int(each.max()) + reach + 1, n)) if each.size else slice(0, 0)
            for each, n in zip(used, sizes, strict=True)
        )
        return cls(picture, tuple(window))

    def variances(self, response: sparse.csr_array) -> np.ndarray:
        """Variances (M,) over parts of values with such derivatives by the pixels, (M, height * width)."""
        camera, count = self.picture.scene.camera, response.shape[0]
        derivatives = response.toarray().reshape(count, camera.height, camera.width)[:, *self.window]
        finely = derivatives.repeat(self._fine, 1).repeat(self._fine, 2) / self._fine**2
        found = np.zeros(count)
        for face in self._faces:
            weights = self._blurred(finely, face).reshape(count, -1)[:, face.places] * face.signal
            terms = [(slice(0, count), face.sheet.nodes(face.points), weights)]
            found += np.diag(field_covariance(face.sheet, terms, count))
        return found

    @cached_property
    def change(self) -> np.ndarray:
        """What the textures that the seeds roll change levels by, (height, width); 0 beside the window."""
        camera = self.picture.scene.camera
        found, shape = np.zeros((camera.height, camera.width)), self._shape
        for face in self._faces:
            finely = np.zeros(math.prod(shape) * self._fine**2)
            finely[face.places] = face.signal * (face.sheet.at(face.points) - 1)
            finely = self._blurred(finely.reshape(1, shape[0] * self._fine, -1), face)
            found[self.window] += finely.reshape(shape[0], self._fine, shape[1], self._fine).mean((1, 3))
        return found

    @property
    def _shape(self) -> tuple[int, int]:
        rows, columns = (each.stop - each.start for each in self.window)
        return rows, columns

    @property
    def _fine(self) -> int:
        """Places along a pixel's side."""
        return int(np.clip(math.isqrt(_MOST // max(math.prod(self._shape), 1)), 1, _FINE))

    @cached_property
    def _faces(self) -> tuple[_Face, ...]:
        fields = {face: sheet for face, sheet in sheets(self.picture.scene).items() if sheet.field is not None}
        if not fields or not all(self._shape):
            return ()
        camera, pictures = self.picture.scene.camera, Pictures.of(self.picture)
        rows, columns = ((np.arange(self._fine * n) + 0.5) / self._fine - 0.5 for n in self._shape)
        x, y = np.meshgrid(columns + self.window[1].start, rows + self.window[0].start)
        seen_at = np.stack([x.ravel(), y.ravel()], -1)
        seen, points = looked_at(self.picture, undistorted(seen_at, camera))
        found = []
        for face, sheet in fields.items():
            places = np.flatnonzero(seen == face)
            if places.size:
                away = depth(points[places], pictures.sensors, camera)
                blur = float(np.mean(blur_at(camera, away, seen_at[places])))
                found.append(_Face(sheet, places, points[places], _signal(pictures, points[places], face), blur))
        return tuple(found)

    def _blurred(self, finely: np.ndarray, face: _Face) -> np.ndarray:
        """Each of some images (n, rows, columns) of places."""
        width = self._fine * face.blur_px
        return gaussian_filter(finely, (0, width, width), mode="constant", truncate=_REACH)


def _signal(pictures: Pictures, points: np.ndarray, face: int) -> np.ndarray:
    """Diffuse signal (k,) of points (k, 3) of a face, of the lights that reach them and of light from other faces."""
    bodies, faces = pictures.scene.bodies, np.full(len(points), face)
    lit = tuple(reaches(bodies, points, faces, emitter.at) for emitter in pictures.emitters)
    return diffuse_signal(pictures, points, face, 1, lit) + light_between(pictures, points, faces)
