"""A picture as the sum of pictures with one light each, for light adds up and each of them is simpler to trace.

Points of light leave nothing to chance where only one of them shines; a light that is itself seen is a picture of its
own, in which everything else is black.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from imaging.geometry.lens import image_centre
from imaging.geometry.projection import frame, rays
from imaging.light.backlight import backlights
from render.texture import pointed
from scenes import Picture


@dataclass(frozen=True)
class Part:
    """What is rendered at once.

    Attributes
    ----------
    picture : Picture
        With one light.
    active : frozenset of str
        Names of effects.
    silhouette : bool
        Whether the light is seen and everything else is black.
    """

    picture: Picture
    active: frozenset[str]
    silhouette: bool = False

    def reduced(self, active: frozenset[str]) -> Part:
        """With fewer effects; its light is a point without ``light_size``."""
        if self.silhouette or "light_size" in active:
            return replace(self, active=active)
        return Part(self.picture.with_scene(pointed(self.picture.scene)), active)


def parts(picture: Picture, active: frozenset[str]) -> list[Part]:
    """Of all lights that shine; their images are added."""
    found, seen = [], backlights(picture.scene)
    for i, light in enumerate(picture.scene.lights):
        lone = _lone(picture, i)
        if i not in seen:
            if light.intensity > 0:
                found.append(Part(lone, active if light.half_size else active - {"light_size"}))
            continue
        if "spill" in active:  # it has a size that nothing can do without
            found.append(Part(lone, active | {"light_size"}))
        found.append(Part(lone, active - {"interreflection", "light_size"}, silhouette=True))
    return found


def _lone(picture: Picture, which: int) -> Picture:
    """The picture with one of its lights."""
    return Picture(picture.scene.lit_by(picture.scene.lights[which]), picture.sensor, (picture.lights[which],))


def within_cone(picture: Picture, crop: tuple[slice, slice], supersample: int) -> np.ndarray:
    """Fine pixels of a crop (rows, columns) whose rays run within the cone in which the picture's backlight shines."""
    camera, light = picture.scene.camera, picture.scene.lights[0]
    towards = frame(np.array(list(picture.lights[0]))).forward
    y, x = (((np.arange(part.start, part.stop) + 0.5) / supersample - 0.5) for part in crop)
    places = np.stack(np.meshgrid(x, y), -1) - image_centre(camera)
    seen = rays(places, np.array(list(picture.sensor)), camera)
    return -(seen @ towards) > np.cos(light.cone) * np.linalg.norm(seen, axis=-1)
