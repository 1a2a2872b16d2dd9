"""The camera of a scene in one line: how large its image is, how large the part is in it, how noisy it is."""

from __future__ import annotations

import math

import numpy as np

from imaging.sensor import full_scale, recorded
from scenes import Camera, Noise, Scene, Telecentric


def told(scene: Scene) -> str:
    """Without a stop at its end; the scale is that at the point that the camera looks at.

    >>> import scenes
    >>> told(scenes.load("task1"))
    '256 x 240 px, 8 px per cm at the part, noise sigma 2.4 grey levels'
    """
    camera = scene.camera
    scale = camera.focal_px / camera.distance
    image = f"{camera.width} x {camera.height} px, {scale:.3g} px per {scene.units} at the part"
    return f"{image}, noise sigma {_noise(scene.noise)}"


def lens(camera: Camera, unit: str) -> str:
    """What a telecentric lens is, in a line; nothing of a pinhole.

    >>> import scenes
    >>> lens(scenes.load("telecentric_plate").camera, "mm")
    'Telecentric lens of magnification 0.18, chief rays parallel'
    >>> lens(scenes.load("task1").camera, "cm")
    ''
    """
    if not isinstance(camera, Telecentric):
        return ""
    angle = camera.telecentricity_deg
    told = f"Telecentric lens of magnification {camera.magnification:g}, chief rays "
    told += f"inclined by {angle:g} degrees at the image's corner" if angle else "parallel"
    deep = camera.depth_of_field(1.0)
    return f"{told}, {deep:.3g} {unit} deep within 1 px of blur" if math.isfinite(deep) else told


def _noise(noise: Noise) -> str:
    """Standard deviation of a level in darkness, without rounding; also at half of the scale where light adds noise.

    >>> _noise(Noise(sigma=2.0)), _noise(Noise(sigma=1.0))
    ('2 grey levels', '1 grey level')
    >>> _noise(Noise(sigma=1.0, gain=0.05, bits=8))
    '1 grey level in darkness, 2.7 at half of the scale'
    >>> _noise(Noise(sigma=1.5, gain=0.05))
    '1.5 grey levels in darkness, and that of the light'
    """
    dark = f"{noise.sigma:.3g} grey level{'s' * (noise.sigma != 1)}"
    if not noise.gain > 0:
        return dark
    middle = full_scale(noise) / 2
    if not math.isfinite(middle):
        return f"{dark} in darkness, and that of the light"
    lit = math.sqrt(recorded(noise, np.array([middle])).noise_variance[0])
    return f"{dark} in darkness, {lit:.2g} at half of the scale"
