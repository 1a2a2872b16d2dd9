"""Photographs that are not what the picture's model says: is the result unbiased with a true sigma, or not ``ok``?

A quadrilateral on a background, exactly blurred and pixel-averaged, contrast over noise 90, and one thing wrong with it
at a time. Optics and noise are estimated from each image, as `ice measure PHOTO` does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Annotated

import cv2
import numpy as np
import typer

import measure
from scenes.cameras import mosaic, tone
from scenes.photograph import Photograph
from tests.oracle import polygon_image

SHAPE = (200, 260)
CORNERS = np.array([[61.3, 52.2], [201.6, 63.9], [190.4, 150.7], [50.8, 139.1]])
CONTRAST, NOISE, BLUR, BACKGROUND = 135.0, 1.5, 0.8, 50.0
_ENOUGH = 40


@lru_cache(maxsize=1)
def _clean(blur: float = BLUR) -> np.ndarray:
    return BACKGROUND + CONTRAST / 100 * polygon_image(CORNERS, SHAPE, blur)


def _noisy(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return np.clip(np.rint(image + NOISE * rng.standard_normal(SHAPE)), 0, 255)


def _plain(rng):
    return _noisy(_clean(), rng)


def _motion(rng):
    return _noisy(cv2.blur(_clean(), (6, 1), borderType=cv2.BORDER_REPLICATE), rng)


def _gamma(rng):
    return np.clip(np.rint(255 * ((_clean() + NOISE * rng.standard_normal(SHAPE)).clip(0) / 255) ** 0.45), 0, 255)


def _jpeg(quality: int, rng):
    good, packed = cv2.imencode(".jpg", _plain(rng).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert good
    return cv2.imdecode(packed, cv2.IMREAD_GRAYSCALE).astype(float)


def _written(light: np.ndarray) -> np.ndarray:
    """sRGB's curve (IEC 61966-2-1), 0 to 1."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light.clip(1e-9) ** (1 / 2.4) - 0.055)


def _coded(noise: float, rng) -> np.ndarray:
    return np.clip(np.rint(255 * _written(_clean() / 255) + noise * rng.standard_normal(SHAPE)), 0, 255)


def _gamma_weak(rng):
    return _coded(2.0, rng)


def _unmarked(rng):
    """In a file that does not say what it is."""
    return Photograph(_coded(6.0, rng), 255.0, tone_known=False)


def _gamma_undone(rng):
    light = (_clean() + NOISE * rng.standard_normal(SHAPE)).clip(0, 255) / 255
    return Photograph(255 * tone.SRGB.light(np.rint(255 * _written(light)) / 255), 255.0)


def _mosaic(rng) -> np.ndarray:
    """A grey scene under light in which red and blue sites see 0.7 and 0.85 of what green ones do."""
    shares = np.ones(SHAPE)
    shares[::2, ::2], shares[1::2, 1::2] = 0.7, 0.85
    return _noisy(_clean() * shares, rng).astype(np.uint8)


def _demosaicked(rng):
    """White balance, then OpenCV's edge-aware interpolation, as a camera does; the green channel."""
    raw, _ = mosaic.balanced(_mosaic(rng), "RGGB")
    found = cv2.demosaicing(np.clip(np.rint(raw), 0, 255).astype(np.uint8), cv2.COLOR_BayerBG2BGR_EA)
    return found[..., 1].astype(float)


def _raw(rng):
    return mosaic.balanced(_mosaic(rng), "RGGB")[0].astype(float)


def _astigmatic(rng):
    return _noisy(cv2.GaussianBlur(_clean(), (0, 0), sigmaX=1.0, sigmaY=0.01), rng)


def _one_sided(rng):
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return _noisy(_clean() * (0.8 + 0.3 * x / SHAPE[1] + 0.1 * y / SHAPE[0]), rng)


def _quiet(rng):
    """Noise of 0.4 of a grey level, which rounding makes twice as much of."""
    return np.clip(np.rint(_clean() + 0.4 * rng.standard_normal(SHAPE)), 0, 255)


def _weak(rng):
    """Contrast over noise 5."""
    return np.clip(np.rint(BACKGROUND + (_clean() - BACKGROUND) / 18 + NOISE * rng.standard_normal(SHAPE)), 0, 255)


@lru_cache(maxsize=1)
def _dimmed() -> np.ndarray:
    """Less light from what is far from the middle, blurred afterwards: of x f the blur of variance s^2 makes
    x F + s^2 dF/dx, if of f it makes F."""
    y, x = (axis - size / 2 for axis, size in zip(np.mgrid[: SHAPE[0], : SHAPE[1]], SHAPE, strict=True))
    variance, image = BLUR**2 + 1 / 12, _clean()

    def moment(of: np.ndarray, place: np.ndarray, axis: int) -> np.ndarray:
        return place * of + variance * np.gradient(of, axis=axis)

    squares = sum(moment(moment(image, place, axis), place, axis) for axis, place in enumerate((y, x)))
    return image - 0.3 * squares / (SHAPE[0] ** 2 + SHAPE[1] ** 2) * 4


def _vignette(rng):
    return _noisy(_dimmed(), rng)


def _texture(rng):
    grain = cv2.GaussianBlur(rng.standard_normal(SHAPE), (0, 0), 1.5)
    return _noisy(_clean() + 10 * grain / grain.std(), rng)


@lru_cache(maxsize=1)
def _bent() -> np.ndarray:
    middle = np.array(SHAPE[::-1]) / 2
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    away = np.stack([x, y], -1) - middle
    bent = middle + away * (1 + 0.01 * (away**2).sum(-1, keepdims=True) / (middle**2).sum())
    fine = BACKGROUND + CONTRAST / 100 * polygon_image(4 * CORNERS + 1.5, (4 * SHAPE[0], 4 * SHAPE[1]), 4 * BLUR)
    return cv2.remap(fine, (4 * bent + 1.5).astype(np.float32), None, cv2.INTER_CUBIC)


def _distorted(rng):
    return _noisy(_bent(), rng)


def _poisson(rng):
    clean = _clean()
    return np.clip(np.rint(clean + np.sqrt(NOISE**2 + 0.15 * clean) * rng.standard_normal(SHAPE)), 0, 255)


def _sharpened(rng):
    image = _plain(rng)
    return np.clip(np.rint(image + (image - cv2.GaussianBlur(image, (0, 0), 1.0))), 0, 255)


def _smoothed(rng):
    return np.rint(cv2.GaussianBlur(_plain(rng), (0, 0), 0.6))


CONDITIONS = {
    "as the model says": _plain, "motion blur 6 px": _motion, "astigmatic blur": _astigmatic,
    "gamma 0.45": _gamma, "sRGB at c/n 42": _gamma_weak, "unmarked at c/n 14": _unmarked, "gamma undone": _gamma_undone,
    **{f"JPEG {quality}": partial(_jpeg, quality) for quality in (50, 75, 90, 95)},
    "vignette 30 %": _vignette, "light from a side": _one_sided, "texture of sd 10": _texture,
    "distortion 1 %": _distorted, "Poisson noise": _poisson, "noise of 0.4": _quiet, "contrast/noise 5": _weak,
    "sharpened": _sharpened, "smoothed": _smoothed, "demosaicked": _demosaicked, "raw mosaic": _raw,
}  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """Diagonals in ``count`` images: bias, px, largest of both, of the images that are ok (of all where none is),
    their scatter over the told sigma, and how many are ok."""

    bias: float
    told: float
    scatter_over_told: float
    ok: int
    count: int
    statuses: dict[str, int]

    @property
    def honest(self) -> bool:
        """At most a twentieth of the images are ok (or one), or the ok ones are unbiased and scatter as told."""
        if self.ok <= max(0.05 * self.count, 1):
            return True
        error = 1 / np.sqrt(2 * max(self.ok - 1, 1))
        scatters = abs(self.scatter_over_told - 1) < max(0.15, 4 * error)
        # margin: 4 standard errors past the 0.3 of a sigma that `ok` allows
        return self.bias < (0.3 + 4 / np.sqrt(self.ok)) * self.told and scatters


def outcome(name: str, estimator: str, count: int, rng: np.random.Generator) -> Outcome:
    """Measure ``count`` images of one condition, or 40 of which none is ok."""
    true, found = [np.linalg.norm(CORNERS[i] - CORNERS[i + 2]) for i in (0, 1)], []
    while len(found) < count and not (len(found) == _ENOUGH and all(one.status != "ok" for one in found)):
        near = CORNERS + rng.uniform(-1.5, 1.5, CORNERS.shape)
        found.append(measure.measure_quadrilateral(CONDITIONS[name](rng), estimator, corners=near))
    states, count = [one.status for one in found], len(found)
    ok = sum(state == "ok" for state in states)
    used = [one for one in found if one.measurands and (one.status == "ok" or not ok)]
    diagonals = np.array([[m.value for m in one.measurands if m.name.startswith("diagonal")] for one in used])
    sigma = np.array([[m.sigma for m in one.measurands if m.name.startswith("diagonal")] for one in used]).mean(0)
    scatter = diagonals.std(0, ddof=1) / sigma if len(used) > 1 else np.full(2, np.nan)
    worst = int(np.argmax(np.abs(np.log(np.nan_to_num(scatter, nan=1.0)))))
    counts = {state: states.count(state) for state in sorted(set(states))}
    return Outcome(
        float(np.abs(diagonals.mean(0) - true).max()), float(sigma.max()), float(scatter[worst]), ok, count, counts
    )


def conditions(
    count: Annotated[int, typer.Option(help="Images a condition; 40 where none is ok.")] = 400,
    seed: Annotated[int, typer.Option()] = 1,
    only: Annotated[str, typer.Option(help="Comma-separated conditions; all when empty.")] = "",
    estimators: Annotated[str, typer.Option(help="Comma-separated.")] = "arrangement",
) -> None:
    """Measure photographs with one thing wrong at a time; exit status 1 if one is called ok that is not."""
    rng, honest = np.random.default_rng(seed), True
    print(f"{'condition':18s} {'estimator':12s} bias px  told px  scatter/told  honest  statuses")
    for name in only.split(",") if only else CONDITIONS:
        for estimator in estimators.split(","):
            found = outcome(name, estimator, count, rng)
            honest &= found.honest
            print(
                f"{name:18s} {estimator:12s} {found.bias:7.4f} {found.told:8.4f} {found.scatter_over_told:13.2f}"
                f"  {'yes' if found.honest else 'NO':6s}  {found.statuses}",
                flush=True,
            )
    raise typer.Exit(0 if honest else 1)
