"""Are the effects that were left out as small as was said? Each is switched on alone, and all together."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

import render
from render.phenomena import EffectTolerance, Influence
from scenes import Picture, Scene, Setting

RENDERED = (
    "cast_shadow", "interreflection", "floor", "specular_lobe", "polarisation", "analyser", "wavelength", "light_size",
    "depth_of_field", "lens_distortion",
)  # fmt: skip
_SAMPLING_N = 1000  # renders of `ice validate`, whose variance is known to sqrt(2 / (n - 1))
_SEEDS = (0, 1, 2, 3, 4)
_FALSE_ALARM = 1e-3  # of one comparison whose estimate is true
_ROUNDING = Influence(2e-4, 1e-3)  # of single precision, in which the smallest aperture is no pinhole


@dataclass(frozen=True)
class Switched:
    """One setting with one more effect (or ``all``) than ``auto`` chose.

    Attributes
    ----------
    name : str
    estimated : Influence
        Bound before the render; the tolerance for ``all``.
    bias_px, variance : float
        Measured: change of the noise-free distance, px, and relative change of its propagated variance.
    resolution_px, resolution_variance : float
        What the renderer itself may contribute to them: its scatter over the seeds (Student's t, 0.1 %), and single
        precision.
    seconds : float
        Time of one render with it; ``seconds_auto`` without.
    """

    setting: Setting
    name: str
    estimated: Influence
    bias_px: float
    variance: float
    resolution_px: float
    resolution_variance: float
    seconds: float
    seconds_auto: float

    @property
    def holds(self) -> bool:
        """Whether the estimate bounds what was measured, as far as the renderer can tell."""
        small = abs(self.bias_px) <= self.estimated.bias_px + self.resolution_px
        return small and abs(self.variance) <= self.estimated.variance + self.resolution_variance


def check(
    scene: Scene,
    tolerance: EffectTolerance = EffectTolerance(),
    quality: render.Quality = render.Quality(),
    settings: tuple[Setting, ...] | None = None,
    only: tuple[str, ...] = (*RENDERED, "all"),
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> list[Switched]:
    """Compare ``auto`` with ``all``, and with each left-out effect of the image alone, in each setting.

    ``only`` names what to switch on. Effects of the exposure (noise, digits) cost nothing and are never left out where
    they matter.
    """
    rows: list[Switched] = []
    settings = scene.settings if settings is None else settings
    for done, setting in enumerate(settings):
        progress("settings", done, len(settings))
        chosen = render.choose(scene, "auto", tolerance, Picture.of(scene, setting.sensor, setting.light))
        base = _Runs(scene, setting, chosen.active, quality)
        for name in RENDERED:
            if name in only and name not in chosen.active:
                runs = _Runs(scene, setting, chosen.active | {name}, quality)
                estimated = next(each.influence for each in chosen.decisions if each.effect.name == name)
                rows.append(_row(setting, name, estimated, base, runs))
        sampling = Influence(tolerance.bias_px, float(np.sqrt(2 / (_SAMPLING_N - 1))))
        if "all" not in only:
            continue
        rows.append(_row(setting, "all", sampling, base, _Runs(scene, setting, "all", quality)))
    return rows


class _Runs:
    """Distance and variance of one setting with some effects, for each seed."""

    def __init__(self, scene: Scene, setting: Setting, effects, quality: render.Quality) -> None:
        import measure  # what a scene calls for is said without it

        found, self.seconds = [], float("inf")
        for seed in _SEEDS:
            started = time.perf_counter()
            image = render.image(scene, setting.sensor, setting.light, replace(quality, seed=seed), effects=effects)
            self.seconds = min(self.seconds, time.perf_counter() - started)  # the first compiles
            result = measure.propagate(image, scene, setting.sensor)
            found.append((result.value_px, result.variance_px2))
        self.values, self.variances = np.array(found).T


def _row(setting: Setting, name: str, estimated: Influence, base: _Runs, runs: _Runs) -> Switched:
    bias, change = runs.values - base.values, runs.variances / base.variances - 1
    errors = -special.stdtrit(len(_SEEDS) - 1, _FALSE_ALARM / 2) / np.sqrt(len(_SEEDS))
    resolution = [
        float(errors * differences.std(ddof=1)) + rounding
        for differences, rounding in zip((bias, change), _ROUNDING, strict=True)
    ]
    return Switched(
        setting, name, estimated, float(bias.mean()), float(change.mean()), *resolution, runs.seconds, base.seconds
    )
