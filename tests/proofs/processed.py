"""What programs do to photographs before they are measured: sigma is that of re-shots within 15 %, or it is not ok."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Annotated, NamedTuple
from zlib import crc32

import cv2
import numpy as np
import typer

import measure
from scenes.photograph import Photograph
from tests.oracle import polygon_image
from tests.proofs.conditions import CORNERS, SHAPE

SHOTS = ((135.0, 1.5), (135.0, 6.0), (40.0, 1.5))  # contrast and noise, grey levels
_BACKGROUND, _BLUR = 50.0, 0.8
_NONE_OK = 12  # shots after which a kind that is never ok needs no more
_SCATTER = 0.15


def rounded(image: np.ndarray) -> np.ndarray:
    """As 8 bits hold it."""
    return np.clip(np.rint(image), 0, 255)


def jpeg(quality: int, image: np.ndarray) -> np.ndarray:
    """Through a JPEG file."""
    good, packed = cv2.imencode(".jpg", rounded(image).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert good
    return cv2.imdecode(packed, cv2.IMREAD_GRAYSCALE).astype(float)


def sharpened(amount: float, image: np.ndarray) -> np.ndarray:
    """By an unsharp mask of 1 px."""
    whole = rounded(image)
    return rounded(whole + amount * (whole - cv2.GaussianBlur(whole, (0, 0), 1.0)))


def smoothed(sigma: float, image: np.ndarray) -> np.ndarray:
    return rounded(cv2.GaussianBlur(rounded(image), (0, 0), sigma))


def resized(factor: float, how: int, image: np.ndarray) -> np.ndarray:
    return rounded(cv2.resize(rounded(image), None, fx=factor, fy=factor, interpolation=how))


def _of_bytes(filtered: Callable, image: np.ndarray) -> np.ndarray:
    return filtered(rounded(image).astype(np.uint8)).astype(float)


_AREA, _LINEAR, _CUBIC = cv2.INTER_AREA, cv2.INTER_LINEAR, cv2.INTER_CUBIC
KINDS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "none": rounded,
    **{f"JPEG {quality}": partial(jpeg, quality) for quality in (50, 75, 90, 95, 98, 100)},
    **{f"sharpened {amount:g}": partial(sharpened, amount) for amount in (0.05, 0.1, 0.2, 0.5, 1.0)},
    **{f"smoothed {sigma:g} px": partial(smoothed, sigma) for sigma in (0.3, 0.4, 0.6)},
    **{f"0.5 x, {name}": partial(resized, 0.5, how) for name, how in (("linear", _LINEAR), ("cubic", _CUBIC))},
    "0.8 x, area": partial(resized, 0.8, _AREA), "0.9 x, cubic": partial(resized, 0.9, _CUBIC),
    **{f"2 x, {name}": partial(resized, 2.0, how) for name, how in (("linear", _LINEAR), ("cubic", _CUBIC))},
    "bilateral 15": partial(_of_bytes, lambda image: cv2.bilateralFilter(image, 5, 15, 2)),
    "bilateral 3": partial(_of_bytes, lambda image: cv2.bilateralFilter(image, 5, 3, 2)),
    "median 3 px": partial(_of_bytes, lambda image: cv2.medianBlur(image, 3)),
    **{f"non-local means {h}": partial(_of_bytes, partial(cv2.fastNlMeansDenoising, h=h)) for h in (2, 5, 10)},
    "JPEG 75, 0.5 x": lambda image: resized(0.5, _LINEAR, jpeg(75, image)),
    "JPEG 90, smoothed": lambda image: smoothed(0.6, jpeg(90, image)),
    "steps of 4": lambda image: np.rint(rounded(image) / 4) * 4,
}  # fmt: skip


class Shots(NamedTuple):
    """Statuses of re-shots, and of those that are ok: scatter over told sigma, bias in sigmas (root mean squares over
    the eight coordinates of the corners), and how many independent deviations they are about."""

    statuses: Counter
    scatter: float
    bias: float
    freedom: float

    @property
    def honest(self) -> bool:
        """Hardly ever ok, or scatter within 15 % and bias within half a sigma, each plus two standard errors."""
        ok, count = self.statuses["ok"], sum(self.statuses.values())
        if ok <= max(0.1 * count, 1):
            return True
        close = abs(self.scatter - 1) < _SCATTER + 2 / np.sqrt(2 * self.freedom)
        return bool(close and self.bias < 0.5 + 2 / np.sqrt(ok))


def judged(shot: Callable[[], tuple[Photograph, np.ndarray]], count: int) -> Shots:
    """Measure re-shots, each a photograph and its true corners (4, 2), px; 12 where none of them is ok."""
    states, away, told = [], [], []
    for number in range(count):
        if number == _NONE_OK and "ok" not in states:
            break
        photo, corners = shot()
        found = measure.measure_quadrilateral(photo, corners=corners)
        states.append(found.status)
        if found.status == "ok":
            away.append((found.corners - corners).ravel())
            told.append(np.diag(found.covariance))
    if len(away) < 2:
        return Shots(Counter(states), np.nan, np.nan, 1.0)
    variance = np.mean(told, 0)
    scatter = np.sqrt(np.mean(np.var(away, 0, ddof=1) / variance))
    # opposite corners share no side: of eight coordinates about four are independent
    return Shots(Counter(states), scatter, np.sqrt(np.mean(np.mean(away, 0) ** 2 / variance)), 4 * (len(away) - 1))


def shots_of(name: str, contrast: float, noise: float, seed: int = 1) -> Callable[[], tuple[Photograph, np.ndarray]]:
    """Re-shots of the quadrilateral of `conditions`, processed in one way."""
    clean = _BACKGROUND + contrast / 100 * polygon_image(CORNERS, SHAPE, _BLUR)
    rng = np.random.default_rng([seed, crc32(name.encode()), int(10 * contrast + noise)])

    def shot():
        image = KINDS[name](clean + noise * rng.standard_normal(SHAPE))
        return Photograph(image, 255.0), image.shape[1] / SHAPE[1] * (CORNERS + 0.5) - 0.5

    return shot


def processed(
    count: Annotated[int, typer.Option(help="Shots of each kind; 12 where none is ok.")] = 60,
    seed: Annotated[int, typer.Option()] = 1,
    only: Annotated[str, typer.Option(help="Semicolon-separated kinds; all when empty.")] = "",
) -> None:
    """Photographs that a program changed, at three contrasts and noises; exit status 1 if one is ok that is not."""
    good = True
    print(f"{'kind':20s} {'contrast':>8s} {'noise':>5s} {'scatter':>7s} {'bias':>5s}  honest  statuses")
    for name in only.split(";") if only else KINDS:
        for contrast, noise in SHOTS:
            found = judged(shots_of(name, contrast, noise, seed), count)
            good &= found.honest
            print(f"{name:20s} {contrast:8.0f} {noise:5.1f} {found.scatter:7.2f} {found.bias:5.2f}  "
                  f"{'yes' if found.honest else 'NO':6s}  {dict(found.statuses)}", flush=True)  # fmt: skip
    raise typer.Exit(0 if good else 1)
