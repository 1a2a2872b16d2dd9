"""Is a fitted scene the one that was photographed? Hidden scenes, rendered, fitted from a start off by degrees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
import typer
from scipy.stats import chi2

import measure
import planner
import render
import scenes
from imaging.geometry.projection import frame
from measure.fitting.result import Fit
from scenes import Block, Picture, Pose, Scene

_SHOTS = 200  # of a hidden scene, whose measured variance is set beside what the fitted scene predicts
_SPOILT = ("jpeg", "gamma", "motion", "lens")  # what the model does not know, or was not told
_STREAK, _BENT = 3, 0.3  # px; k1, which is not freed
POSE = ("camera.distance", "camera.roll_deg", "aim.right", "aim.down", "sensor.polar", "sensor.azimuth")


@dataclass(frozen=True)
class Hidden:
    """What was photographed, and where the fit begins.

    Attributes
    ----------
    truth : Picture
    known : Scene
        The same part, and a camera as the user believes it.
    sensor, light : Pose
        Where the search begins.
    """

    truth: Picture
    known: Scene
    sensor: Pose
    light: Pose

    @classmethod
    def drawn(cls, rng: np.random.Generator, lens: bool = False) -> Hidden:
        """A block of random size, its poses, camera, light and noise."""
        size = tuple(np.round(rng.uniform([8, 5, 2], [14, 9, 5]), 2).tolist())
        base = scenes.load("task1")
        sides = {"object": Block(kind="block", size=size), "settings": (), "same_scale": ()}
        known = base.model_copy(update={**sides, "camera": base.camera.model_copy(update=_smaller(base))})
        start = [Pose(rng.uniform(15, 55), rng.uniform(0, 360)), Pose(rng.uniform(20, 55), rng.uniform(0, 360))]
        off = [Pose(*(np.array(list(pose)) + rng.uniform(-8, 8, 2)).tolist()) for pose in start]
        axes = frame(np.array(list(start[0])))
        aim = rng.uniform(-0.8, 0.8, 2)
        camera = known.camera.model_copy(update={
            "distance": float(100 * rng.uniform(0.93, 1.07)), "roll_deg": float(rng.uniform(-8, 8)),
            "exposure": float(rng.uniform(120, 200)), "blur_px": float(rng.uniform(0.5, 1.3)),
            "look_at": tuple((aim[0] * axes.right + aim[1] * axes.down).tolist()),
        })  # fmt: skip
        if lens:
            bent = camera.lens.model_copy(update={"distortion": (float(rng.uniform(-0.4, 0.4)), 0.0, 0.0, 0.0, 0.0)})
            camera = camera.model_copy(update={"lens": bent})
        noise = base.noise.model_copy(update={
            "sigma": float(rng.uniform(0.8, 3)), "gain": float(rng.uniform(0.01, 0.05)),
            "dark_level": float(rng.uniform(16, 30)),
        })  # fmt: skip
        truth = Picture.of(known.model_copy(update={"camera": camera, "noise": noise}), *off)
        return cls(truth, known, *start)

    def values(self) -> dict[str, float]:
        """The true value of every parameter of a fit."""
        scene, axes = self.truth.scene, frame(np.array(list(self.sensor)))
        camera, noise, at = scene.camera, scene.noise, np.array(scene.camera.look_at)
        return {
            "camera.distance": camera.distance, "camera.roll_deg": camera.roll_deg, "camera.exposure": camera.exposure,
            "noise.dark_level": noise.dark_level, "camera.blur_px": camera.blur_px,
            "camera.focal_px": camera.focal_px, "camera.lens.distortion[0]": camera.lens.coefficients[0],
            "aim.right": float(at @ axes.right), "aim.down": float(at @ axes.down),
            **dict(zip(("sensor.polar", "sensor.azimuth"), self.truth.sensor, strict=True)),
            **dict(zip(("light.polar", "light.azimuth"), self.truth.lights[0], strict=True)),
            "noise.sigma": noise.sigma, "noise.gain": noise.gain,
        }  # fmt: skip

    def fit(self, photographs: list[np.ndarray], free: tuple[str, ...] = ()) -> Fit:
        return measure.fit(self.known, photographs, self.sensor, self.light, free=free)


def _smaller(base: Scene) -> dict[str, float]:
    return {"width": 192, "height": 180, "focal_px": 600.0, "blur_px": base.camera.blur_px}


def pulls(hidden: Hidden, found: Fit, scale: float = 1.0) -> dict[str, float]:
    """(fitted - true) / standard error of what is told; angles by the shorter way. ``scale`` is put on the errors."""
    true, result = hidden.values(), {}
    rows = zip(found.names, found.units, found.values, found.standard_errors, found.statuses, strict=True)
    for name, unit, value, error, status in rows:
        if status == "ok" and error > 0:
            off = value - true[name]
            result[name] = ((off + 180) % 360 - 180 if unit == "deg" else off) / (scale * error)
    return result


def joint(hidden: Hidden, found: Fit, scale: float = 1.0) -> tuple[float, int]:
    """Squared distance from the truth by the covariance of all that is told, chi-square of so many degrees of freedom.

    Parameters are correlated, so the squares of their pulls do not add up to one.
    """
    each = pulls(hidden, found, scale)
    index = [found.names.index(name) for name in each]
    errors = found.standard_errors[index]
    correlation = found.covariance[np.ix_(index, index)] / errors[:, None] / errors
    pull = np.array(list(each.values()))
    return float(pull @ np.linalg.solve(correlation, pull)), len(index)


def predicted_beside_measured(hidden: Hidden, clean: np.ndarray, found: Fit, seed: int) -> tuple[float, float] | None:
    """Variance of repeated shots over what the fitted scene predicts; None where that says it is not ok.

    By the closed form (`planner.predict`), and by propagation through the fitted scene's own picture: the fit's errors
    are in both, the closed form's in the first alone.
    """
    picture = found.pictures[0]
    told = planner.predict(picture)
    if told.status != "ok":
        return None
    shots = render.expose(clean, hidden.truth.scene.noise, np.random.default_rng(seed), _SHOTS)
    values = measure.distance(shots, picture).value_px
    if not np.isfinite(values).all():
        return None
    variance = values.var(ddof=1)
    propagated = measure.propagate(planner.image(picture), picture).variance_px2
    return float(variance / told.variance_px2), float(variance / propagated)


def spoilt(photograph: np.ndarray, how: str) -> np.ndarray:
    """A photograph as a camera saves it that does more than the model: JPEG of quality 85, or a curve of 0.7."""
    if how == "gamma":
        return np.rint(255 * (photograph / 255) ** 0.7)
    data = cv2.imencode(".jpg", photograph.astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 85])[1]
    return cv2.imdecode(data, cv2.IMREAD_GRAYSCALE).astype(float)


def unfit(hidden: Hidden, clean: np.ndarray, how: str, rng: np.random.Generator) -> tuple[str, float]:
    """What a fit says of a photograph that the model does not know so, and the largest pull of what it tells."""
    scene = hidden.truth.scene
    if how == "lens":
        lens = scene.camera.lens.model_copy(update={"distortion": (_BENT, 0.0, 0.0, 0.0, 0.0)})
        bent = scene.model_copy(update={"camera": scene.camera.model_copy(update={"lens": lens})})
        clean = planner.image(hidden.truth.with_scene(bent))
    elif how == "motion":
        clean = cv2.blur(clean, (_STREAK, 1))
    photograph = render.expose(clean, scene.noise, rng, 1)[0]
    found = hidden.fit([spoilt(photograph, how) if how in ("jpeg", "gamma") else photograph])
    return found.status, max(map(abs, pulls(hidden, found).values()), default=0.0)


def table(rows: list[dict[str, float]]) -> tuple[list[str], float]:
    """A line for each parameter, and the share of all pulls that are within 3."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    lines = [f"{'parameter':26s} {'n':>4} {'mean':>7} {'sd':>6} {'within 3':>9} {'largest':>8} {'p':>8}"]
    for name in names:
        each = np.array([row[name] for row in rows if name in row])
        square = float(each @ each)
        p = 2 * min(chi2.cdf(square, each.size), chi2.sf(square, each.size))
        lines.append(
            f"{name:26s} {each.size:4d} {each.mean():+7.2f} {each.std():6.2f} {(np.abs(each) <= 3).mean():9.3f} "
            f"{np.abs(each).max():8.2f} {p:8.2g}"
        )
    every = np.array([value for row in rows for value in row.values()])
    return lines, float((np.abs(every) <= 3).mean())


def fits(
    count: Annotated[int, typer.Option(help="Hidden scenes.")] = 100,
    seed: Annotated[int, typer.Option(help="Root of all random numbers.")] = 1,
    first: Annotated[int, typer.Option(help="Number of the first, to continue.")] = 0,
    free: Annotated[list[str], typer.Option(help="Free focal or k1, too; k1 is hidden then.")] = [],  # noqa: B006
    shots: Annotated[int, typer.Option(help="Photographs of each pose.")] = 1,
    curves: Annotated[int, typer.Option(help="So many of them also spoilt by JPEG and the like.")] = 10,
    repeated: Annotated[int, typer.Option(help="So many of them beside repeated shots.")] = 25,
) -> None:
    """Pulls of all parameters, predictions beside repeated shots, and what the model does not know."""
    rows, ratios, called, lost = [], [], {how: [] for how in _SPOILT}, 0
    statuses: list[str] = []
    squares, freedom = 0.0, 0
    for number in range(first, first + count):
        rng = np.random.default_rng([seed, number])
        hidden = Hidden.drawn(rng, "k1" in free)
        clean = render.image(hidden.truth)
        found = hidden.fit(list(render.expose(clean, hidden.truth.scene.noise, rng, shots)), tuple(free))
        statuses.append(found.status)
        each = pulls(hidden, found)
        worst = max(each, key=lambda name: abs(each[name]))
        lost += found.statuses.count("ill_conditioned")
        print(f"{number}: {found.status}, p {found.p_value:.2g}, largest {worst} {each[worst]:+.2f}", flush=True)
        rows.append(each)
        whole = joint(hidden, found)
        squares, freedom = squares + whole[0], freedom + whole[1]
        if number - first < repeated:
            ratios.append(predicted_beside_measured(hidden, clean, found, number))
        if number - first < curves:
            for how in _SPOILT:
                called[how].append(unfit(hidden, clean, how, rng))
    lines, within = table(rows)
    print("\n".join(lines))
    print(f"within 3 standard errors: {within:.4f} of all pulls; {lost} parameters held")
    needed = {*POSE, "camera.exposure", "camera.blur_px"}
    good = np.mean([all(abs(row[name]) <= 3 for name in needed & row.keys()) for row in rows])
    some = np.array([abs(row[name]) for row in rows for name in needed & row.keys()])
    print(
        f"pose, exposure, blur: {(some <= 3).mean():.4f} within 3; all eight at once in {good:.3f} of the photographs"
    )
    chance = chi2.ppf([0.025, 0.975], freedom) / freedom
    print(f"joint chi-square of all photographs: {squares / freedom:.3f} of its expectation (95 %: {chance[0]:.3f} to "
          f"{chance[1]:.3f})")  # fmt: skip
    print("statuses:", {status: statuses.count(status) for status in sorted(set(statuses))})
    told = np.array([ratio for ratio in ratios if ratio is not None])
    low, high = chi2.ppf([0.025, 0.975], _SHOTS - 1) / (_SHOTS - 1)
    for name, each in zip(("closed form", "propagated"), told.T, strict=False):
        freedom = each.size * (_SHOTS - 1)
        pooled = chi2.ppf([0.025, 0.975], freedom) / freedom
        inside = ((each >= low) & (each <= high)).sum()
        print(
            f"repeated shots, {name}: measured / predicted variance {each.mean():.3f} (95 % of chance alone "
            f"{pooled[0]:.3f} to {pooled[1]:.3f}), {inside} of {each.size} in [{low:.3f}, {high:.3f}], "
            f"{len(ratios) - each.size} not ok"
        )
    for how, each in called.items():
        said = [status for status, _ in each]
        largest = ", ".join(f"{pull:.1f}" for status, pull in each if status != "misfit")
        counted = {status: said.count(status) for status in sorted(set(said))}
        print(f"{how}: {counted}; largest pulls of those that are no misfit: {largest or 'none'}")
