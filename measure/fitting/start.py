"""From a scene's nominal pose to near the true one: size and place of the object, then ever sharper images."""

from __future__ import annotations

from itertools import product

import numpy as np

from measure.fitting.likelihood import Problem, most_likely, seen_coarsely
from measure.fitting.parameters import Parameters, radius_px
from measure.fitting.photograph import Pixels, Shots
from scenes import Noise

_COARSE = (
    0.25,
    0.12,
    0.06,
    0.03,
)  # of the object's radius: how much images are shrunk and smoothed, one after the other
_SMOOTH, _SHARP = 1.5, 1.0  # shrunk px of the Gaussian; at least
_TURNS = (-12.0, 0.0, 12.0)
_KEPT = 3
_POOR = 1.0  # of the best attempt's misfit to be expected from noise: then other starts are tried
_GLANCE = 256  # px of a photograph's larger side, to see where the object is
_FEW, _FAINT = 4, 20.0  # pixels that are averaged; standard deviations, of which white noise spans 8


def shows_something(shots: Shots, noise: Noise) -> bool:
    """Whether anything stands out of the noise once 4 x 4 pixels are averaged and smoothed."""
    sigma = np.sqrt(noise.variance / shots.count) / (_FEW * 2 * np.sqrt(np.pi))
    return float(np.ptp(shots.coarse(_FEW, 1.0))) > _FAINT * sigma


def near(parameters: Parameters, shots: tuple[Shots, ...], noise: Noise) -> np.ndarray:
    """Values (q,) from which the likelihood's maximum is found.

    The nominal pose comes first; where what it leads to leaves much of the photograph unexplained, poses 12 degrees
    around it are tried, and the best taken.
    """
    first = _aligned(parameters, shots, parameters.start(), noise)
    best, left = _followed(parameters, shots, first, noise)
    if left < _POOR:
        return best
    tried = []
    for turn in product(_TURNS, repeat=3):
        if any(turn):
            values = _aligned(parameters, shots, _turned(parameters, first, turn), noise)
            tried.append((_left(parameters, shots, values, noise, _COARSE[0]), values))
    tried.sort(key=lambda each: each[0])
    for _, values in tried[:_KEPT]:
        found, rest = _followed(parameters, shots, values, noise)
        best, left = (found, rest) if rest < left else (best, left)
        if left < _POOR:
            break
    return best


def aligned_difference(parameters: Parameters, shots: tuple[Shots, ...], noise: Noise) -> float:
    """Mean squared difference of smoothed images at the nominal pose, once size, place and brightness are alike."""
    return _left(parameters, shots, _aligned(parameters, shots, parameters.start(), noise), noise, _COARSE[0])


def _turned(parameters: Parameters, values: np.ndarray, turn: tuple[float, float, float]) -> np.ndarray:
    """All sensors turned in polar angle and azimuth, and the camera in roll, degrees."""
    found = values.copy()
    for i, each in enumerate(parameters.free):
        if each.kind == "sensor":
            polar = values[i - each.where[-1]]
            found[i] += turn[0] if each.where[-1] == 0 else turn[1] / max(np.sin(np.radians(polar)), 0.2)
    found[parameters.names.index("camera.roll_deg")] += turn[2]
    return found


def _movable(parameters: Parameters) -> np.ndarray:
    """What is sought while images are smooth: all but level of darkness, blur and lens."""
    still = ("noise.dark_level", "camera.blur_px", "camera.focal_px", "camera.lens.distortion[0]")
    return np.array([i for i, name in enumerate(parameters.names) if name not in still])


def _problem(parameters: Parameters, shots, values: np.ndarray, share: float) -> Problem:
    size = radius_px(parameters.pictures[0])
    shrink = max(round(share * size / _SMOOTH), 1)
    smooth = max(share * size / shrink, _SHARP)
    seen = [seen_coarsely(parameters.pictures_at(values, k), shrink, smooth) for k in range(len(shots))]
    return Problem(parameters, shots, tuple(map(Pixels.around, seen)), shrink, smooth)


def _followed(parameters: Parameters, shots, values: np.ndarray, noise: Noise) -> tuple[np.ndarray, float]:
    which = _movable(parameters)
    for share in _COARSE:
        values = most_likely(_problem(parameters, shots, values, share), values, noise, which, 1.0)
    return values, _left(parameters, shots, values, noise, _COARSE[-1])


def _left(parameters: Parameters, shots, values: np.ndarray, noise: Noise, share: float) -> float:
    """Mean square of what smoothed images leave over a percent of the squared exposure's, as a part of the noise."""
    problem = _problem(parameters, shots, values, share)
    rest = problem.observed() - problem.expected(values, noise)
    range_ = np.ptp(problem.observed())
    return float(np.mean(rest**2) / (noise.variance + (0.01 * range_) ** 2))


def _aligned(parameters: Parameters, shots, values: np.ndarray, noise: Noise) -> np.ndarray:
    """Level of darkness, and the first photograph's place, size and brightness of the object."""
    names, found = parameters.names, values.copy()
    camera = parameters.scene.camera
    shrink = max(max(camera.width, camera.height) // _GLANCE, 1)
    image = shots[0].coarse(shrink, _SHARP)
    found[names.index("noise.dark_level")] = _dark(image)
    for _ in range(2):
        there, here = _outline(image), _outline(_whole(parameters, found, noise, shrink))
        if there is None or here is None:
            return values
        camera = parameters.scene_at(found).camera
        away = (there[0] - here[0]) * shrink * camera.distance / camera.focal_px
        found = parameters.resized(found, float(np.clip(np.sqrt(there[1] / here[1]), 1 / 1.4, 1 / 0.7)))
        found[names.index("aim.right")] -= away[0]
        found[names.index("aim.down")] -= away[1]
        found[names.index("camera.exposure")] *= np.clip(there[2] / here[2], 0.2, 5.0)
    low, high = (np.array([getattr(each, side) for each in parameters.free]) for side in ("low", "high"))
    return np.clip(found, low, high)


def _whole(parameters: Parameters, values: np.ndarray, noise: Noise, shrink: int) -> np.ndarray:
    camera = parameters.scene.camera
    y, x = np.mgrid[: camera.height // shrink, : camera.width // shrink]
    pixels = Pixels(x.ravel(), y.ravel(), (1, *x.shape))
    return Problem(parameters, (), (pixels,), shrink, _SHARP).levels(values, noise, 0).reshape(x.shape)


def _dark(image: np.ndarray) -> float:
    frame = np.concatenate([image[:3].ravel(), image[-3:].ravel(), image[:, :3].ravel(), image[:, -3:].ravel()])
    return float(np.median(frame))


def _outline(image: np.ndarray) -> tuple[np.ndarray, float, float] | None:
    """Middle (2,), area and mean signal of what is brighter than darkness by a tenth of the brightest."""
    dark = _dark(image)
    signal = image - dark
    inside = signal > 0.1 * np.quantile(signal, 0.999)
    if not inside.any() or signal.max() <= 0:
        return None
    y, x = np.nonzero(inside)
    return np.array([x.mean(), y.mean()]), float(x.size), float(signal[inside].mean())
