"""Limbs where the renderer puts them: of a million rays beside a limb, how many meet the shape.

At each of 1024 places along the limb 1024 rays, one in each of as many strata, cross half a pixel across it; the share
that meets the shape tells where the limb is. Rays are those of the rendered picture's own sensor, and the shapes those
that are rendered, so single precision and the pieces of a cone's mesh are in what is found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from imaging.contours import limb
from imaging.geometry.lens import image_centre
from render import variant
from render.build import view
from render.curved import shape
from scenes import Curved, InvalidInput, Picture, Pose, Scene, Turned

LIMIT_PX = 1e-3
_ENDS = 0.02  # of a wall's line, at both ends: a ray may pass its rim
_HALF = 0.25  # px to each side of the limb
_CONE = Turned(kind="turned", axis="x", profile=((-30.0, 6.0), (-10.0, 10.0), (30.0, 8.5)))


@dataclass(frozen=True)
class Silhouette:
    """How far outside its closed form the limb of one surface is met, px: mean, and the largest of all places."""

    name: str
    sensor: tuple[float, float]
    rays: int
    mean: float
    largest: float

    @property
    def agrees(self) -> bool:
        """Whether every place is within `LIMIT_PX`."""
        return self.largest < LIMIT_PX  # margin: rays 1/1024 px apart: half a step, and one is allowed


def cone_of(scene: Scene) -> Scene:
    """A shaft's scene with two cones in its place, one steep and one slight; their tapers are measured, too."""
    data = scene.model_dump(mode="json", exclude_defaults=True)
    asked = [
        {"name": f"{kind} of {name}", "kind": kind, "features": [{"surface": name}]}
        for kind in ("diameter", "taper")
        for name in ("d1", "d2")
    ]
    return Scene.model_validate(data | {"object": _CONE, "measurands": asked})


def silhouettes(
    scene: Scene, sensor: tuple[float, float], places: int, rays: int, rng: np.random.Generator, grown: float = 0.0
) -> Iterator[Silhouette]:
    """Of every curved surface whose limb is seen; ``grown`` px is added to the radius of what is rendered."""
    for curved in scene.solid.curved:
        found = _silhouette(scene, curved, sensor, places, rays, rng, grown)
        if found is not None:
            yield found


def _silhouette(scene: Scene, curved: Curved, sensor, places: int, rays: int, rng, grown: float) -> Silhouette | None:
    strands = limb(curved.surface, sensor, scene.camera, _ENDS + (1 - 2 * _ENDS) * rng.random(places)).strands
    if not strands:
        return None
    at, outward, size = (np.concatenate([getattr(s, k) for s in strands]) for k in ("at", "outward", "magnification"))
    keep = rng.permutation(len(at))[:places]
    keep = keep[(np.abs(at[keep]) < image_centre(scene.camera)).all(1)]
    if not keep.size:
        return None
    made = replace(curved, surface=replace(curved.surface, radius=curved.radius + grown / size.mean()))
    meets = _Meets(scene, made, sensor)
    away = _HALF * (2 * (np.arange(rays) + rng.random((len(keep), rays))) / rays - 1)
    share = [
        sum(meets(*place) for place in row)
        for row in at[keep, None] + image_centre(scene.camera) + away[..., None] * outward[keep, None]
    ]
    shift = _HALF * (2 * np.array(share) / rays - 1)
    return Silhouette(curved.name, sensor, away.size, float(shift.mean()), float(np.abs(shift).max()))


class _Meets:
    """Whether the ray of a place in the image meets a shape as it is rendered."""

    def __init__(self, scene: Scene, curved: Curved, sensor: tuple[float, float]) -> None:
        self._mi, camera = variant.use("scalar_rgb"), scene.camera
        self._size = camera.width, camera.height
        seen = Picture(scene, Pose(*sensor), tuple(Pose(0.0, 0.0) for _ in scene.lights))
        crop = slice(0, camera.height), slice(0, camera.width)
        lens = view(self._mi, seen, frozenset(), self._size, crop, 1)
        made = shape(self._mi, curved, {"type": "diffuse"})
        self._scene = self._mi.load_dict({"type": "scene", "sensor": lens, "shape": made}, parallel=False)
        self._sensor = self._scene.sensors()[0]

    def __call__(self, x: float, y: float) -> bool:
        place = [(x + 0.5) / self._size[0], (y + 0.5) / self._size[1]]
        ray, _ = self._sensor.sample_ray(0.0, 0.5, place, [0.5, 0.5])
        return self._scene.ray_test(ray)


def random_pose(name: str, rng: np.random.Generator) -> tuple[float, float]:
    """Anywhere above for a ball; of parts turned about x from where both limbs are in the image."""
    if name == "ball":
        return float(rng.uniform(5, 85)), float(rng.uniform(0, 360))
    return float(rng.uniform(1, 30)), float(rng.choice([90.0, 270.0]) + rng.uniform(-25, 25))


def proved(scenes_: dict[str, Scene], count: int, seed: int, places: int = 1024, rays: int = 1024) -> bool:
    """Print each surface at ``count`` random poses of each scene; whether all agree, and none that is 2 limits off."""
    agree, rng = True, np.random.default_rng(seed)
    for name, scene in scenes_.items():
        done = 0
        while done < count:
            try:
                sensor = random_pose(name, rng)
                rows = list(silhouettes(scene, sensor, places, rays, rng))
            except InvalidInput:  # a sensor within the part
                continue
            done += 1
            for row in rows:
                print(
                    f"{name} {row.name} ({row.sensor[0]:.0f}, {row.sensor[1]:.0f}): {row.rays} rays, limb off by "
                    f"{row.mean:+.1e} px on average, {row.largest:.1e} px at most"
                )
                agree &= row.agrees
        wrong = next(silhouettes(scene, sensor, places // 8, rays, rng, grown=2 * LIMIT_PX))
        print(f"{name} {wrong.name}, drawn {2 * LIMIT_PX:g} px too large: {wrong.mean:+.1e} px on average")
        agree &= not wrong.agrees
    return agree
