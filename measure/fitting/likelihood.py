"""The most likely parameters of a scene, given photographs of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.blurred.whole import signal_at
from imaging.geometry.projection import facing, light_position
from imaging.pictures import Pictures
from imaging.sensor import recorded
from measure.fitting.parameters import Parameters
from measure.fitting.photograph import Pixels, Shots
from scenes import Noise

_EVALUATIONS, _FEW = 30, 12  # of sharp and of coarse images
_BESIDE = 0.5  # degrees
_SETTLED, _NEARLY = 1e-6, 1e-3  # relative changes at which the search ends, of sharp and of coarse images


@dataclass(frozen=True, eq=False)
class Problem:
    """Photographs, the pixels of them that count, and how they are weighted.

    Attributes
    ----------
    parameters : Parameters
    shots : tuple of Shots
        One for each pose.
    pixels : tuple of Pixels
    shrink : int
        Photographs and camera are made so many times smaller, for a first look at them.
    smooth : float
        By so many (shrunk) px the photographs are smoothed, and so is the model.
    """

    parameters: Parameters
    shots: tuple[Shots, ...]
    pixels: tuple[Pixels, ...]
    shrink: int = 1
    smooth: float = 0.0

    def signal(self, values: np.ndarray, k: int) -> np.ndarray:
        """Signal above darkness at the pixels of the k-th pose, (P,)."""
        pictures = seen_coarsely(self.parameters.pictures_at(values, k), self.shrink, self.smooth)
        return signal_at(pictures, self.pixels[k].x, self.pixels[k].y)

    def levels(self, values: np.ndarray, noise: Noise, k: int) -> np.ndarray:
        """Expected grey levels there, cut off at the end of the scale as the sensor does, (P,)."""
        return recorded(noise, self.signal(values, k) + self._dark(values, noise)).level

    def _dark(self, values: np.ndarray, noise: Noise) -> float:
        names = self.parameters.names
        return float(values[names.index("noise.dark_level")]) if "noise.dark_level" in names else noise.dark_level

    def observed(self) -> np.ndarray:
        """All photographs at their pixels, one after the other."""
        return np.concatenate(
            [p.of(s.coarse(self.shrink, self.smooth)) for p, s in zip(self.pixels, self.shots, strict=True)]
        )

    def beside(self, values: np.ndarray, which: np.ndarray) -> list[np.ndarray]:
        """Values (q,) with each light's angles a little away, where some face is lit by that that was not, or dark."""
        angles = [i for i in which if self.parameters.free[i].kind == "light"]
        there = [values + away * np.eye(values.size)[i] for i in angles for away in (-_BESIDE, _BESIDE)]
        lit = [self._lit(each) for each in (values, *there)]
        return there if any(np.not_equal(each, lit[0]).any() for each in lit) else []

    def _lit(self, values: np.ndarray) -> np.ndarray:
        """Which faces each light of each pose shines upon, one after the other."""
        scene = self.parameters.scene_at(values)
        poses = (pose for k in range(len(self.shots)) for pose in self.parameters.poses_at(values, k)[1])
        lights = scene.lights * len(self.shots)
        return np.concatenate([np.empty(0, bool)] + [
            facing(scene.solid, light_position(scene.camera, light, pose))
            for light, pose in zip(lights, poses, strict=True)
        ])  # fmt: skip

    def expected(self, values: np.ndarray, noise: Noise) -> np.ndarray:
        return np.concatenate([self.levels(values, noise, k) for k in range(len(self.shots))])

    def variance(self, values: np.ndarray, noise: Noise) -> np.ndarray:
        """Variance of the noise of the means of repeated photographs; the fixed pattern does not average out."""
        found = []
        for k, shots in enumerate(self.shots):
            signal, dark = self.signal(values, k), self._dark(values, noise)
            temporal = recorded(noise.tried(dark_level=dark), signal + dark).noise_variance
            temporal = np.broadcast_to(np.maximum(temporal, 1e-6), signal.shape)
            found.append(temporal / shots.count + noise.dsnu**2 + (noise.prnu * np.maximum(signal, 0.0)) ** 2)
        return np.concatenate(found)

    def jacobian(self, values: np.ndarray, noise: Noise, which: np.ndarray) -> np.ndarray:
        """Derivative of what is expected by the parameters ``which`` (f,), (P, f): differences of one side."""
        middle = self.expected(values, noise)
        found = np.empty((middle.size, len(which)))
        for column, i in enumerate(which):
            step = np.zeros(values.size)
            step[i] = self.parameters.free[i].step
            found[:, column] = (self.expected(values + step, noise) - middle) / step[i]
        return found


def seen_coarsely(pictures: Pictures, shrink: int, smooth: float) -> Pictures:
    """The same with a camera of fewer, larger pixels and more blur; half a pixel may be lost at the image's border."""
    if shrink == 1 and not smooth:
        return pictures
    scene, camera = pictures.scene, pictures.scene.camera
    blur, field = camera.blur_px / shrink, camera.blur_field
    fewer = {
        "width": camera.width // shrink, "height": camera.height // shrink, "focal_px": camera.focal_px / shrink,
        "blur_px": float(np.hypot(blur, smooth)), "blur_field": field and field.smoothed(blur, smooth),
    }  # fmt: skip
    return pictures.with_scene(scene.tried(camera=camera.tried(**fewer)))


def most_likely(
    problem: Problem,
    start: np.ndarray,
    noise: Noise,
    which: np.ndarray,
    variance: np.ndarray | float,
    nearly: bool = False,
) -> np.ndarray:
    """Values (q,) of least weighted squares; only the parameters ``which`` move, within their bounds.

    Where light just grazes a face the squares have a kink, and least ones on both of its sides: where the search ends
    near one it begins anew beside it. ``nearly`` ends the search sooner, as it does of smoothed images.
    """
    observed, sigma = problem.observed(), np.sqrt(variance)
    settled, most = (_NEARLY, _FEW) if nearly or problem.smooth else (_SETTLED, _EVALUATIONS)
    free = [problem.parameters.free[i] for i in which]
    low, high = (np.array([getattr(each, side) for each in free]) for side in ("low", "high"))
    inner = 1e-6 * np.where(np.isfinite(high - low), high - low, 1.0)

    def full(part: np.ndarray) -> np.ndarray:
        values = start.copy()
        values[which] = part
        return values

    from scipy.optimize import least_squares  # slow to load, and rarely needed

    def searched(values: np.ndarray):
        return least_squares(
            lambda part: (problem.expected(full(part), noise) - observed) / sigma,
            np.clip(values[which], low + inner, high - inner),
            lambda part: problem.jacobian(full(part), noise, which) / np.reshape(sigma, (-1, 1)),
            bounds=(low, high), x_scale="jac", max_nfev=most, xtol=settled, ftol=settled, gtol=None,
        )  # fmt: skip

    best = searched(start)
    if not problem.smooth and not nearly:
        around = problem.beside(full(best.x), which)
        best = min((best, *(searched(each) for each in around)), key=lambda found: found.cost)
    return full(best.x)
