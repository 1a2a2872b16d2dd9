"""What the estimators have to know of camera and sensor, and of the locators' settings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.colour import by_raw, raw_variance
from imaging.features.demosaiced import place_shifts
from imaging.geometry.blur import blur_times
from imaging.geometry.lens import lens_jacobian, recorded, undistorted
from imaging.row_noise import shared
from imaging.sensor import headroom
from imaging.sensor import recorded as expected
from scenes import Camera, Noise, Scene
from scenes.cameras.colour import Colour


@dataclass(frozen=True)
class Optics:
    """The image's size, blur and noise, the lens, and the locators' settings.

    Attributes
    ----------
    shape : tuple of int
        (height, width), px.
    blur_px : float
        Standard deviation of the lens' blur, px; the pixels' own box comes on top. Where it varies over the image, that
        in its middle.
    noise_variance : float
        Variance of a grey level (in darkness, where it depends on the light).
    scale_px, window_px : float
        Smoothing scale and half search window of the point locators, px.
    noise : Noise, optional
        How the noise depends on the light; everywhere ``noise_variance`` when not given.
    dark_level : float
        Grey level of darkness.
    camera : Camera, optional
        Whose lens bends straight edges; straight edges are recorded straight when not given.
    field : Camera, optional
        Whose blur varies over the image; it is ``blur_px`` everywhere when not given.
    dimmed : bool
        Whether its light varies over the image, so that an even background is not recorded as even.
    """

    shape: tuple[int, int]
    blur_px: float = 0.6
    noise_variance: float = 1.0
    scale_px: float = 1.0
    window_px: float = 3.0
    noise: Noise | None = None
    camera: Camera | None = None
    dark_level: float = 0.0
    field: Camera | None = None
    dimmed: bool = False

    @classmethod
    def of(cls, scene: Scene) -> Optics:
        """The scene's camera, noise and locator settings."""
        camera, locator, noise = scene.camera, scene.locator, scene.noise
        is_white = noise.gain == 0 and noise.bits is None and noise.colour is None and not noise.is_shared
        uneven = None if is_white else noise
        bent = camera if camera.lens.bends else None
        shape = camera.height, camera.width
        return cls(
            shape, camera.blur_px, noise.variance, locator.scale_px, locator.window_px, uneven, bent, noise.dark_level,
            None if camera.blur_field is None else camera, camera.is_dimmed,
        )  # fmt: skip

    @property
    def most_blur_px(self) -> float:
        """The largest standard deviation of the lens' blur within the image, px."""
        return self.blur_px if self.field is None else self.blur_px * self.field.blur_field.most

    def blur_at(self, places: np.ndarray) -> np.ndarray | float:
        """Standard deviation of the lens' blur of what is recorded at places (..., 2), px; one number where even."""
        if self.field is None:
            return self.blur_px
        return self.blur_px * blur_times(self.field, places[..., 0], places[..., 1])

    @property
    def sagitta(self) -> float:
        """How far a straight edge across the image may be bent, px; about."""
        if self.camera is None:
            return 0.0
        height, width = self.shape
        border = np.array([[0, 0], [width / 2, 0], [width, 0], [width, height / 2], [width, height]], float)
        return float(np.nan_to_num(np.abs(self.ideal(border) - border), nan=max(self.shape)).max())

    @property
    def colour(self) -> Colour | None:
        """The sensor's colour filters."""
        return None if self.noise is None else self.noise.colour

    @property
    def sensor(self) -> Noise:
        """The sensor's noise as a whole."""
        return self.noise or Noise(sigma=float(np.sqrt(self.noise_variance)), dark_level=self.dark_level)

    def noise_at(self, levels: np.ndarray) -> np.ndarray | None:
        """Variance of the noise at grey levels; None where it is ``noise_variance`` for all of them."""
        if self.noise is None:
            return None
        if self.noise.gain == 0 and levels.max(initial=-np.inf) <= headroom(self.noise) + self.noise.dark_level:
            return None
        return expected(self.noise, levels).noise_variance

    def independent(
        self, rows: np.ndarray, pixels: np.ndarray, levels: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray | float]:
        """Linear functions of pixels as functions of what has independent noise, and the variance of that.

        Where the noise depends on the light each pixel's variance is taken at the level that it shows: what its own
        noise does to that averages out over the pixels. Of a colour sensor it is raw pixels that are independent; one
        beside the pixels counts at the level of those that it is a part of. What rows and columns share comes last.

        Parameters
        ----------
        rows : ndarray, shape (..., P)
            Derivatives by the pixels.
        pixels : ndarray of int, shape (P,)
            Flat indices.
        levels : ndarray, shape (n, P)
            Grey levels of n images.

        Returns
        -------
        rows : ndarray, shape (..., Q)
        variance : ndarray, shape (n, Q), or float
            Grey levels^2.
        """
        colour = self.colour
        if colour is None:
            variance = self.noise_at(levels)
            variance = self.noise_variance if variance is None else variance
            return self._with_shared(rows, pixels, variance) if self.sensor.is_shared else (rows, variance)
        taken, found = by_raw(colour, pixels, self.shape)
        used = levels @ taken.multiply(1 / taken.sum(0)[None]).tocsr() if colour.interpolates else levels
        made = (rows.reshape(-1, rows.shape[-1]) @ taken).reshape(*rows.shape[:-1], len(found))
        return made, raw_variance(self.noise, used, found, self.shape[1])

    def _with_shared(
        self, rows: np.ndarray, pixels: np.ndarray, variance: np.ndarray | float
    ) -> tuple[np.ndarray, np.ndarray]:
        parts, known = shared(self.sensor, pixels, self.shape[1])
        variance = np.broadcast_to(variance, (*np.shape(variance)[:-1], len(pixels)))
        own = np.broadcast_to(known, (*variance.shape[:-1], len(known)))
        sums = (rows.reshape(-1, len(pixels)) @ parts).reshape(*rows.shape[:-1], len(known))
        return np.concatenate([rows, sums], -1), np.atleast_2d(np.concatenate([variance, own], -1))

    def mixed_at(self, places: np.ndarray, normals: np.ndarray) -> np.ndarray | float:
        """How far demosaicing moves crossings at recorded places (..., 2) along unit normals there, px."""
        return place_shifts(self.colour, places, normals, self.blur_px, self.scale_px)

    def has_room(self, places: np.ndarray) -> np.ndarray:
        """Whether a locator that stands at places (m, 2) looks at the image alone, bool (m,)."""
        margin = self.window_px + 4 * self.scale_px + 1
        return ((places >= margin) & (places <= np.array(self.shape[::-1]) - 1 - margin)).all(1)

    def recorded(self, ideal: np.ndarray) -> np.ndarray:
        """Where ideal image points (..., 2) are recorded, px."""
        return ideal if self.camera is None else recorded(ideal, self.camera)

    def ideal(self, seen: np.ndarray) -> np.ndarray:
        """Ideal coordinates of recorded image points (..., 2), px."""
        return seen if self.camera is None else undistorted(seen, self.camera)

    def gradient(self, ideal: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Gradient by the recorded coordinates of ``normals . ideal coordinates`` at ideal points (..., 2).

        Its direction is the recorded normal of a line with that ideal normal; its size the ideal px across the line for
        a recorded px.
        """
        if self.camera is None:
            return np.broadcast_to(normals, ideal.shape)
        (a, b), (c, d) = np.moveaxis(lens_jacobian(ideal, self.camera), (-2, -1), (0, 1))
        nx, ny = np.moveaxis(np.broadcast_to(normals, ideal.shape), -1, 0)
        return np.stack([d * nx - c * ny, a * ny - b * nx], -1) / (a * d - b * c)[..., None]
