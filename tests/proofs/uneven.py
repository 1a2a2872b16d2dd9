"""Do rendered parts of an uneven scene scatter as predicted, and does each shift as predicted?"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
import typer
from scipy import stats

import measure
import render
import scenes
from imaging.models.texture import texture_errors
from imaging.pictures import Pictures
from scenes import Picture, Scene


class Shifts(NamedTuple):
    """Of one setting's parts: measured and predicted shifts, px, and the predicted variance over parts, px^2."""

    measured: np.ndarray
    predicted: np.ndarray
    variance: float

    @property
    def ratio(self) -> float:
        """Measured over predicted variance; the mean is known to be 0."""
        return float(np.mean(self.measured**2) / self.variance)

    @property
    def p_value(self) -> float:
        """Two-sided, of the hypothesis that the parts scatter with the predicted variance."""
        count = self.measured.size
        return float(2 * min(stats.chi2.cdf(count * self.ratio, count), stats.chi2.sf(count * self.ratio, count)))


def rolled(scene: Scene, seed: int) -> Scene:
    """Another part of the scene; what is printed stays."""
    parts = (t.model_copy(update={"seed": seed}) if t.kind == "statistical" else t for t in scene.textures)
    return scene.model_copy(update={"textures": tuple(parts)})


def shifts(scene: Scene, number: int, parts: int) -> Shifts:
    """Noise-free distances of parts 0, 1, ... in one of a scene's settings, less that of an even one."""
    poses = scene.settings[number].sensor, scene.settings[number].light
    printed = tuple(t for t in scene.textures if t.kind == "image")

    def distance(part: Scene) -> float:
        return float(measure.distance(render.image(part, *poses), part, *poses).value_px)

    even, measured, predicted, found = distance(scene.model_copy(update={"textures": printed})), [], [], None
    for seed in range(parts):
        part = rolled(scene, seed)
        found = texture_errors(Pictures.of(Picture.of(part, *poses)))
        predicted.append(found.shifts[0][0])
        measured.append(distance(part) - even)
    return Shifts(np.array(measured), np.array(predicted), float(found.variances[0][0]))


def uneven(
    scene: Annotated[str, typer.Argument(help="A bundled scene or a TOML file.")] = "printed_label",
    parts: Annotated[int, typer.Option(help="Parts a setting.")] = 150,
) -> None:
    """Print the scatter of rendered parts over the predicted one, and how far each is from its predicted shift."""
    loaded = scenes.load(scene)
    for number, setting in enumerate(loaded.settings):
        found = shifts(loaded, number, parts)
        missed = np.sqrt(np.mean((found.measured - found.predicted) ** 2))
        print(
            f"{setting.sensor} {setting.light}: {parts} parts scatter by {np.sqrt(np.mean(found.measured**2)):.5f} px, "
            f"predicted {np.sqrt(found.variance):.5f}, ratio of variances {found.ratio:.3f} (standard error "
            f"{np.sqrt(2 / parts):.3f}), p-value {found.p_value:.2g}; shifts missed by {missed:.5f} px"
        )
