"""The blur at a place of the image: of the camera, the place that is recorded, and the depth of what is seen there.

The lens' Gaussian, which may vary over the image (`scenes.cameras.blur_field`), and a disc of what is out of focus, a
quarter of whose squared radius is added to its variance.

A point's light is spread by the blur where the point is recorded. The edge of a face then appears blurred as at its own
place, and displaced by half the gradient of the blur's variance towards where the image is sharper, whatever locates
it. Calibrations see places so displaced: a lens' distortion (`imaging.geometry.lens`) says where edges appear, and so
the displacement is part of it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scenes import Camera
from scenes.materials.vectors import NUMPY, Ops

_STEP = 0.5  # px, of a difference: a field changes over hundreds of px


def height2(camera: Camera, x: Any, y: Any) -> Any:
    """Squared image height of recorded places, px: 0 in the image's middle, 1 at its corner."""
    x, y = x - (camera.width - 1) / 2, y - (camera.height - 1) / 2
    return (x * x + y * y) / ((camera.width / 2) ** 2 + (camera.height / 2) ** 2)


def blur_times(camera: Camera, x: Any, y: Any, ops: Ops = NUMPY) -> Any:
    """The blur in focus at recorded places, px, over that in the image's middle, in the arithmetic of ``ops``."""
    return 1.0 if camera.blur_field is None else camera.blur_field.times(height2(camera, x, y), ops)


def blur_in_focus(camera: Camera, place: np.ndarray) -> np.ndarray | float:
    """Standard deviation of the blur of what is in focus, recorded at places (..., 2), px; one number where even."""
    return camera.blur_px if camera.blur_field is None else camera.blur_px * blur_times(camera, *_xy(place))


def blur_at(camera: Camera, depth: np.ndarray, place: np.ndarray) -> np.ndarray | float:
    """Standard deviation of the blur of what lies at depths (..., scene units), recorded at places (..., 2), px."""
    blur = blur_in_focus(camera, place)
    return blur if camera.aperture_radius == 0 else np.sqrt(blur**2 + confusion(camera, depth) ** 2 / 4)


def drift(camera: Camera, place: np.ndarray) -> np.ndarray:
    """Half the gradient of the blur's variance in focus at recorded places (..., 2), px: minus what it moves edges by.

    It is by so much, outwards where the corners are less sharp, that a point's light is centred beyond where edges
    appear.
    """
    if camera.blur_field is None:
        return np.zeros(np.shape(place))
    steps = _STEP * np.eye(2)
    around = [blur_in_focus(camera, place + step) ** 2 - blur_in_focus(camera, place - step) ** 2 for step in steps]
    return np.stack(around, -1) / (4 * _STEP)


def signed_confusion(camera: Camera, depth: np.ndarray) -> np.ndarray:
    """Radius of the circle of confusion of a thin lens at depths (scene units), px; negative beyond the focus.

    R f (F - z) / (D(z) D(F)), R the aperture's radius, f the ``focal_px``, F the focus, D the camera's divisor. Of a
    pinhole with an aperture D is the depth, and this R f (1 / z - 1 / F).
    """
    focus = camera.lens.focus or camera.distance
    return camera.aperture_radius * camera.focal_px * (focus - depth) / (camera.divisor(depth) * camera.divisor(focus))


def confusion(camera: Camera, depth: np.ndarray) -> np.ndarray:
    """The same without sign."""
    return np.abs(signed_confusion(camera, depth))


def _xy(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    place = np.asarray(place, float)
    return place[..., 0], place[..., 1]
