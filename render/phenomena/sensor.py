"""What the sensor adds (EMVA 1288): shot noise, dark noise, fixed pattern, digits, saturation."""

from __future__ import annotations

import numpy as np

from imaging.light.backlight import backlights
from imaging.models import DEFAULT_MODEL, variance_model
from imaging.pictures import Pictures
from imaging.sensor import shot_noise
from render.phenomena.base import EVERYTHING, NOTHING, Effect, Influence, changed
from render.phenomena.edges import brightest
from scenes import Scene


def _brightest(pictures: Pictures) -> float:
    """Highest level above darkness that is measured, or behind it."""
    scene = pictures.scene
    floor = scene.camera.exposure * scene.floor.reflectance if scene.floor else 0.0
    behind = sum(scene.camera.exposure * scene.lights[which].intensity for which in backlights(scene))
    return max(brightest(pictures), floor, behind)


def _relative(part: float, rest: float) -> Influence:
    """Noise of one source beside the others; noise as such moves no mean."""
    return Influence(0.0, float("inf") if rest <= 0 else part / rest)


class ShotNoise(Effect):
    """Photons arrive at random: variance gain x signal, of a linear sensor."""

    name = "shot_noise"
    switch = "noise.gain in the exposure; costs nothing beside the rays"

    def absent(self, pictures: Pictures) -> str | None:
        return "gain is 0" if pictures.scene.noise.gain == 0 else None

    def influence(self, pictures: Pictures) -> Influence:
        return _relative(float(shot_noise(pictures.scene.noise, _brightest(pictures))), pictures.scene.noise.variance)

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "noise", gain=0.0, excess=())


class ReadNoise(Effect):
    """Gaussian noise that is there in darkness, too."""

    name = "read_noise"
    switch = "noise.sigma in the exposure; costs nothing beside the rays"

    def absent(self, pictures: Pictures) -> str | None:
        return "sigma is 0" if pictures.scene.noise.sigma == 0 else None

    def influence(self, pictures: Pictures) -> Influence:
        return _relative(pictures.scene.noise.sigma**2, pictures.scene.noise.variance - pictures.scene.noise.sigma**2)

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "noise", sigma=0.0)


class FixedPattern(Effect):
    """Pixels differ in sensitivity (PRNU) and offset (DSNU), in every picture alike."""

    name = "fixed_pattern"
    switch = "noise.prnu and noise.dsnu in the exposure; costs nothing beside the rays"

    def absent(self, pictures: Pictures) -> str | None:
        return "prnu and dsnu are 0" if pictures.scene.noise.prnu == 0 and pictures.scene.noise.dsnu == 0 else None

    def influence(self, pictures: Pictures) -> Influence:
        """One camera's pattern moves the mean, by less than 4 standard deviations of what cameras differ by."""
        scene = pictures.scene
        noise, temporal = scene.noise, max(scene.noise.variance, 1e-12)
        pattern = noise.dsnu**2 + (noise.prnu * _brightest(pictures)) ** 2
        reference = scene.model_copy(
            update={"noise": noise.model_copy(update={"sigma": temporal**0.5, "bits": None, "gain": 0.0})}
        )
        spread = float(variance_model(DEFAULT_MODEL)(pictures.with_scene(reference)).variance.max())
        return Influence(4 * float(np.sqrt(spread * pattern / temporal)), 0.0)

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "noise", prnu=0.0, dsnu=0.0)


class Quantisation(Effect):
    """Grey levels are whole numbers."""

    name = "quantisation"
    switch = "noise.bits in the exposure; costs nothing beside the rays"

    def absent(self, pictures: Pictures) -> str | None:
        return "noise.bits is not given" if pictures.scene.noise.bits is None else None

    def influence(self, pictures: Pictures) -> Influence:
        """1/12 beside the rest; below half a grey level of noise it is not noise any more."""
        scene = pictures.scene
        rest = scene.noise.variance - 1 / 12
        return EVERYTHING if rest < 0.25 else _relative(1 / 12, rest)


class Saturation(Effect):
    """The highest number ends the scale."""

    name = "saturation"
    switch = "clipping in the exposure; costs nothing beside the rays"
    _MARGIN = 6.0  # standard deviations

    def absent(self, pictures: Pictures) -> str | None:
        scene = pictures.scene
        if scene.noise.bits is None:
            return "noise.bits is not given"
        top = self._top(pictures)
        full = 2**scene.noise.bits - 1
        return f"levels reach {top:.0f} of {full}, {self._MARGIN:.0f} sigma included" if top < full else None

    def influence(self, pictures: Pictures) -> Influence:
        return EVERYTHING if self._top(pictures) >= 2**pictures.scene.noise.bits - 1 else NOTHING

    def _top(self, pictures: Pictures) -> float:
        noise, brightest = pictures.scene.noise, _brightest(pictures)
        pattern = (noise.prnu * brightest) ** 2 + noise.dsnu**2
        sigma = np.sqrt(noise.variance + shot_noise(noise, brightest) + pattern)
        return noise.dark_level + brightest + self._MARGIN * float(sigma)
