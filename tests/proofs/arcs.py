"""Arcs of circles - rounded corners, half bores, round ends of slots - predicted, rendered, exposed and measured.

The truth is the dimensions that a part is made with. Beside each prediction stands what a whole circle of the same
radius and contrast would have: a control that has to fail.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import trimesh
import typer
from scipy.stats import chi2

import measure
import planner
import render
import scenes
from imaging.features.circles import calibrated_circle, rim
from imaging.features.locator import MIN_CONTRAST, kappa2
from imaging.features.rim_sides import outward_normals
from imaging.pictures import Pictures
from scenes import Circle, Picture, Scene
from tests import parts
from validation.statistics import sidak

PARTS: dict[str, Callable[[], trimesh.Trimesh]] = {
    "corner 60": lambda: parts.cornered(60, 16.0),
    "corner 90": lambda: parts.cornered(90),
    "corner 150": lambda: parts.cornered(150),
    "notch 60": lambda: parts.notched(60, 20.0),
    "notch 120": lambda: parts.notched(120, 10.0),
    "half bore": parts.notched,
    "slot": parts.slotted,
}
TRUE = {"corner 60": 32.0, "corner 90": 20.0, "corner 150": 20.0, "notch 60": 40.0, "notch 120": 20.0,
        "half bore": 16.0, "slot": 12.0}  # fmt: skip
APART = 20.0  # mm, of the slot's ends
POSES = (((12, 85), (35, 265)), ((28, 80), (35, 335)), ((20, 230), (40, 20)))
MOST_OFF = 0.3  # sigma
_POINTS = 256


@dataclass(frozen=True)
class Row:
    """A value in many pictures: ratio of measured to predicted variance, and to the control's; mean error, sigma, and
    its standard deviation by the rays of a few renders, 0 of one."""

    part: str
    sensor: tuple[float, float]
    name: str
    status: str
    measured: float
    ratio: float
    off: float
    rays: float
    control: float

    def holds(self, low: float, high: float) -> bool:
        """Whether the variance is as predicted, and not as of a whole circle, and the mean is near the truth."""
        plain = self.control < low or self.control > high
        return self.status == "ok" and low < self.ratio < high and plain and abs(self.off) < MOST_OFF + 2 * self.rays

    def __str__(self) -> str:
        return (
            f"{self.part:<11}{self.sensor!s:<10}{self.name:<13}{self.status:<13}{self.measured:4.0%} ok  variance"
            f" {self.ratio:5.3f}, of a whole circle's {self.control:9.3g};"
            f" mean error {self.off:+.2f} +- {self.rays:.2f} sigma"
        )


def scene_of(mesh: trimesh.Trimesh, folder: Path, sigma: float = 2.4, size: tuple[int, int] = (420, 360)) -> Scene:
    """A scene of a part in mm that looks at its upper arcs, and asks for their diameters and a distance between two."""
    file = folder / "part.ply"
    mesh.export(file)
    data = scenes.load("plate").model_dump(exclude={"measurands", "settings"})
    data["object"] = {"kind": "mesh", "file": str(file)}
    upper = [arc for arc in scenes.Mesh.model_validate(data["object"]).solid.arcs if arc.axis[2] > 0.5]
    centres = [{"circle": arc.name} for arc in upper]
    asked = [{"name": f"diameter {c['circle']}", "kind": "diameter", "features": [c]} for c in centres]
    asked += [{"name": "apart", "kind": "distance", "features": centres}] if len(upper) == 2 else []
    look_at = np.mean([arc.around(3)[1] for arc in upper], 0).tolist()
    camera = {"width": size[0], "height": size[1], "focal_px": 2800.0, "distance": 400.0, "blur_px": 0.6,
              "exposure": 200.0, "look_at": look_at}  # fmt: skip
    data |= {"units": "mm", "camera": camera, "light": {"kind": "point", "distance": 400.0}, "measurands": asked}
    data["noise"]["sigma"] = sigma
    return scenes.Scene.model_validate(data)


def as_if_whole(picture: Picture, arc: Circle) -> np.ndarray:
    """Covariance (3, 3) were the circle seen all around with the arc's mean contrast, the scene's unit squared."""
    pictures, scene = Pictures.of(picture), picture.scene
    own, around = rim(pictures, arc), replace(arc, ends=None)
    angle = around.angles(_POINTS)
    normal, slope, speed = outward_normals(pictures, around, angle)
    across = np.einsum("ni,nij->nj", normal, slope)
    columns = [*(across @ axis for axis in arc.axes), (across * arc.spokes(angle)).sum(-1)]
    whole = replace(
        own, design=np.stack(columns, -1), arc=speed * 2 * np.pi / _POINTS, known=np.ones(_POINTS),
        squared=np.full(_POINTS, own.squared[own.squared > 0].mean()), noise_variance=scene.noise.variance,
        turn=1.0, off_ends=None,
    )  # fmt: skip
    scale = scene.locator.scale_px
    return calibrated_circle(whole, kappa2(scale, scene.camera.blur_px), scale, MIN_CONTRAST**2)


def rows(
    part: str, picture: Picture, quality: render.Quality, count: int, rng: np.random.Generator, renders: int = 1
) -> list[Row]:
    """All values of a part in so many noisy pictures of each of some renders."""
    scene, sensor, every = picture.scene, tuple(picture.sensor), []
    expected = planner.predict(picture).measurands
    clean = (render.image(picture, quality=replace(quality, seed=seed)) for seed in range(renders))
    found = [measure.measure(render.expose(image, scene.noise, rng, count), picture) for image in clean]
    values, states = np.stack([each.value for each in found]), np.stack([each.status for each in found])
    means, variances = values.mean(1), values.var(1, ddof=1).mean(0)
    rays = means.std(0, ddof=1) / np.sqrt(renders) if renders > 1 else np.zeros(means.shape[1])
    for k, each in enumerate(expected):
        used = [scene.solid.circle(feature.circle) for feature in scene.measurands[k].features]
        whole = sum(_whole_variance(as_if_whole(picture, arc), len(used)) for arc in used)
        sigma, true = float(np.sqrt(each.variance_object)), TRUE[part] if len(used) == 1 else APART
        off, ok = float(means[:, k].mean()) - true, float((states[..., k] == "ok").mean())
        ratio, control = float(variances[k]) / sigma**2, float(variances[k]) / whole
        every.append(Row(part, sensor, each.name, each.status, ok, ratio, off / sigma, rays[k] / sigma, control))
    return every


def _whole_variance(covariance: np.ndarray, features: int) -> float:
    """Of a diameter; of what one of two centres adds to their distance, the mean over directions."""
    return float(4 * covariance[2, 2] if features == 1 else np.trace(covariance[:2, :2]) / 2)


def limits(free: int, tests: int) -> tuple[float, float]:
    """Interval of a ratio of variances of so many degrees of freedom at 1 % over all rows."""
    level = sidak(0.01, tests)
    low, high = chi2.ppf([level / 2, 1 - level / 2], free) / free
    return float(low), float(high)


def arcs(
    count: Annotated[int, typer.Option(help="Noisy pictures a render.")] = 100,
    renders: Annotated[int, typer.Option(help="Of each pose, with other rays.")] = 3,
    seed: Annotated[int, typer.Option()] = 5,
    only: Annotated[str, typer.Option(help="Parts that begin so.")] = "",
) -> None:
    """Arcs of 60 to 180 degrees on corners, notches and a slot; exit status 1 if a claim does not hold."""
    rng, every = np.random.default_rng(seed), []
    for part, make in PARTS.items():
        if not part.startswith(only):
            continue
        with tempfile.TemporaryDirectory() as folder:
            scene = scene_of(make(), Path(folder))
        for sensor, light in POSES:
            found = rows(part, Picture.of(scene, sensor, light), render.Quality(), count, rng, renders)
            every += found
            print(*found, sep="\n", flush=True)
    low, high = limits(renders * (count - 1), len(every))
    wrong = [row for row in every if not row.holds(low, high)]
    print(f"interval {low:.3f} to {high:.3f}; {len(every) - len(wrong)} of {len(every)} rows hold")
    for row in wrong:
        print(f"not: {row}")
    raise typer.Exit(1 if wrong else 0)
