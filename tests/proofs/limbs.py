"""What limbs tell, at random poses: variance as propagated, bias below 0.3 sigma, and what a step would err by.

A ball under a point of light, its diameter and centre; a shaft under two, one on each side, for a point lights but one
of its limbs, also with shoulders' shadows upon it, and within a ring; the shaft and two cones, their tapers too,
against a backlight.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import typer

import measure
import planner
import render
import scenes
from imaging.features.limb_look import limb_look
from imaging.features.limb_outline import LIMB_POINTS, limb_outline
from imaging.features.limbs import limb_rim
from imaging.features.measurand import measurands
from scenes import InvalidInput, Light, Scene
from tests.proofs import centres, silhouettes
from validation.statistics import Verdict, verdict

KINDS = "ball", "shaft-front", "shaft-shadow", "shaft-back", "shaft-ring", "cone-back"
_MOST_LIGHT, _MOST_TILT = 50.0, 12.0  # degrees: of the light from the sensor, of the sensor from the backlight's axis
_MOST_TURN = 65.0  # degrees: so far along the shaft lights stand whose shoulders throw shadows on walls


@dataclass(frozen=True)
class Row:
    """One quantity from one pose: in the scene's unit or degrees, variances not sigmas."""

    name: str
    sensor: tuple[float, float]
    status: str
    calibrated: float
    propagated: float
    measured: float
    count: int
    bias: float
    as_step: float

    @property
    def text(self) -> str:
        """In a line."""
        sigma = self.propagated**0.5
        return (
            f"{self.name} ({self.sensor[0]:.0f}, {self.sensor[1]:.0f}) {self.status}: sigma {sigma:.5f}, "
            f"measured / propagated {self.measured / self.propagated:.3f}, calibrated / propagated "
            f"{self.calibrated / self.propagated:.3f}, bias {self.bias / sigma:+.2f} sigma, "
            f"as a step {self.as_step / sigma:+.1f}"
        )


def scene_of(kind: str, small: bool = False) -> Scene:
    """One of `KINDS`; ``small`` with a quarter of the pixels."""
    found = scenes.load({"shaft-ring": "shaft_ring"}.get(kind, kind.split("-")[0].replace("cone", "shaft")))
    if kind == "cone-back":
        found = silhouettes.cone_of(found)
    if kind in ("shaft-front", "shaft-shadow"):
        found = found.lit_by(Light(distance=500.0), Light(distance=500.0))
    camera = found.camera
    if small:
        half = {"width": camera.width // 2, "height": camera.height // 2, "focal_px": camera.focal_px / 2}
        camera = camera.model_copy(update=half)
    return found.model_copy(update={"settings": (), "camera": camera})


def poses(kind: str, rng: np.random.Generator) -> tuple[tuple[float, float], tuple | None]:
    """A sensor and its lights; a shaft lies along x, and along the image."""
    across = float(rng.choice([90.0, 270.0]))
    if kind in ("shaft-back", "shaft-ring", "cone-back"):
        return (float(rng.uniform(1, _MOST_TILT)), across + float(rng.uniform(-20, 20))), None
    if kind in ("shaft-front", "shaft-shadow"):
        most = 20 if kind == "shaft-front" else _MOST_TURN
        sides = [(float(rng.uniform(45, 75)), turn + float(rng.uniform(-most, most))) for turn in (90.0, 270.0)]
        return (float(rng.uniform(1, 25)), across + float(rng.uniform(-20, 20))), tuple(sides)
    polar, azimuth = float(rng.uniform(10, 80)), float(rng.uniform(0, 360))
    turn = rng.uniform(-_MOST_LIGHT, _MOST_LIGHT, 2)
    return (polar, azimuth), (float(np.clip(polar + turn[0], 0, 85)), azimuth + float(turn[1]))


def step_model_error(pictures: planner.Pictures, curved: scenes.Curved) -> np.ndarray:
    """What the p parameters would be off by if the limb of one picture were taken for a step, (p,).

    By least squares, weighted as they are found; NaN where they are not.
    """
    outline = limb_outline(curved, pictures.sensors, pictures.scene.camera, LIMB_POINTS)
    seen, each = limb_look(pictures, curved, outline), limb_rim(pictures, curved)
    weight = np.where(each.clear, each.arc * each.squared / each.noise_variance, 0.0)
    size = np.sqrt(weight @ each.design**2)
    if not (size > 0).all():
        return np.full(curved.count, np.nan)
    root = np.sqrt(weight)
    return np.linalg.lstsq(root[:, None] * each.design / size, root * seen.shift, rcond=None)[0] / size


def rows_at(scene: Scene, sensor, light, images: int, seed: int, quality: render.Quality = render.Quality()):
    """Every quantity of a scene from one pose."""
    picture = scenes.Picture.of(scene, sensor, light)
    told, clean = planner.predict(picture), render.image(picture, quality=quality)
    known = measure.propagate(clean, picture, estimator="gradient").measurands
    noisy = render.expose(clean, scene.noise, np.random.default_rng(seed), images)
    found = measure.measure(noisy, picture, estimator="gradient")
    pictures, rows = planner.Pictures.of(picture), []
    expected = measurands(pictures)
    for m, forecast in enumerate(told.measurands):
        values = found.value[np.isfinite(found.value[:, m]), m]
        status = forecast.status if forecast.status != "ok" else known.status[m]
        name = scene.quantities[m].features[0].surface
        pull = expected.of_circle(expected.gradient_object, expected.circles.index(name))[m]
        as_step = float(pull @ step_model_error(pictures, scene.solid.round(name)))
        rows.append(
            Row(
                forecast.name, sensor, status, forecast.variance_object, float(known.covariance[m, m]),
                float(values.var(ddof=1)) if len(values) > 1 else np.nan, len(values),
                float(values.mean() - forecast.nominal) if len(values) else np.nan, as_step,
            )
        )  # fmt: skip
    return rows


def judged(rows: list[Row], images: int) -> Verdict:
    """Of those that promise to be right."""
    good = [row for row in rows if row.status == "ok"]
    return verdict(
        [row.measured / row.propagated for row in good],
        [row.count for row in good],
        lost=[images - row.count for row in good],
        bias_px=[row.bias for row in good],
        sigma_px=[row.propagated**0.5 for row in good],
    )


def limbs(
    count: Annotated[int, typer.Option(help="Poses a scene.")] = 20,
    images: Annotated[int, typer.Option(help="Noisy images a pose.")] = 200,
    only: Annotated[str, typer.Option(help="One of the kinds, render, centre, or all.")] = "all",
    rays: Annotated[int, typer.Option(help="Of a fine pixel at an edge.")] = 64,
    seed: int = 1995,
) -> None:
    """Variance and bias of what limbs tell at random poses; and where limbs are rendered, by a million rays."""
    failed, quality = False, render.Quality(edge_samples=rays)
    if only in ("render", "all"):
        shaft = scenes.load("shaft")
        failed = not silhouettes.proved(
            {"ball": scenes.load("ball"), "shaft": shaft, "cone": silhouettes.cone_of(shaft)}, count, seed
        )
    if only in ("centre", "all"):
        failed |= not centres.proved(count, seed)
    if only in ("render", "centre"):
        raise typer.Exit(int(failed))
    for kind in KINDS if only == "all" else (only,):
        scene, rng, rows = scene_of(kind), np.random.default_rng(seed), []
        while len({row.sensor for row in rows}) < count:
            try:
                new = rows_at(scene, *poses(kind, rng), images, int(rng.integers(1 << 31)), quality)
            except InvalidInput:  # a sensor within the shaft
                continue
            rows += new
            print("\n".join(f"{kind} {row.text}" for row in new), flush=True)
        found = judged(rows, images)
        good = sum(row.status == "ok" for row in rows)
        print(f"{kind}: {good} of {len(rows)} ok; {found.text}")
        failed |= not found.agrees
    raise typer.Exit(int(failed))
