"""What of a camera a picture may tell itself, together with where its part lies (`scenes.placement`).

``focal`` is the logarithm of the focal length, or of a telecentric camera's magnification, over the scene's: a
deviation of 0.001 is a longer one by a thousandth. ``k1`` is the deviation of the first coefficient of distortion.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from scenes.cameras.lens import Lens
from scenes.numbers import number_at, with_number

if TYPE_CHECKING:
    from scenes.cameras.pinhole import Camera
    from scenes.scene import Scene

_LENGTHS = ("focal_px", "focal_length_mm", "pixel_pitch_um", "magnification", "image_side_deg", "flange_mm")
Estimated = Literal["focal", "k1"]
UNTOLD = 0.1
"""Standard deviation of each before a picture, of which a scene tells nothing."""
K1 = "camera.lens.distortion[0]"
"""Key of the first coefficient of distortion."""
_INPUTS = {
    "focal": (*(f"camera.{key}" for key in _LENGTHS), "fx", "fy"), "k1": (K1, "k1"),
}  # fmt: skip


def names(which: tuple[Estimated, ...]) -> tuple[str, ...]:
    """Of such deviations, as budgets and reasons name them."""
    return tuple(f"placement.camera.{name}" for name in which)


def inputs(which: tuple[Estimated, ...]) -> tuple[str, ...]:
    """Names of a budget's inputs that such deviations stand for."""
    return (*names(which), *(each for name in which for each in _INPUTS[name]))


def covariance(scene: Scene) -> np.ndarray:
    """Of the deviations before a picture, (c, c) in the order of ``placement.camera``: what the scene says of its
    camera's numbers, or of their calibration.

    Examples
    --------
    >>> import scenes
    >>> scene = scenes.load("board_block").with_(
    ...     placement={"camera": ["focal", "k1"]}, uncertain=[{"key": "camera.focal_px", "sd": 5.4}]
    ... )
    >>> np.sqrt(np.diag(covariance(scene))).round(4).tolist()
    [0.005, 0.1]
    """
    which = scene.placement.camera
    calibrated = scene.uncertainty.covariance
    whole = np.zeros((len(which), len(which)))
    if calibrated is not None:
        rows = np.zeros((len(which), len(calibrated.names)))
        for i, name in enumerate(which):
            rows[i] = [_by_calibrated(name, each, calibrated.names, scene.camera) for each in calibrated.names]
        whole = rows @ np.array(calibrated.matrix) @ rows.T
    return whole + np.diag(uncalibrated(scene))


def uncalibrated(scene: Scene) -> np.ndarray:
    """Variances of the deviations before a picture, (c,), beside those that a calibration leaves open."""
    own = np.array([_of_numbers(scene, name) for name in scene.placement.camera])
    return own + UNTOLD**2 * is_untold(scene)


def is_untold(scene: Scene) -> np.ndarray:
    """Of which deviations of ``placement.camera`` the scene tells nothing, bool (c,)."""
    given = scene.uncertainty.covariance
    named = () if given is None else tuple(n for n, sd in zip(given.names, given.sd, strict=True) if sd > 0)
    calibrated = {"focal": bool({"fx", "fy"} & set(named)), "k1": "k1" in named}
    return np.array([not (calibrated[name] or _of_numbers(scene, name) > 0) for name in scene.placement.camera], bool)


def adjusted(camera: Camera, which: tuple[Estimated, ...], deviations: np.ndarray) -> Camera:
    """The camera with such deviations, unchecked."""
    for name, off in zip(which, deviations.tolist(), strict=True):
        if name == "focal":
            camera = camera.enlarged(float(np.exp(off)))
        elif isinstance(camera.lens, Lens):
            k1, *others = camera.lens.coefficients
            camera = camera.tried(lens=camera.lens.tried(distortion=(k1 + off, *others)))
    return camera


def _by_calibrated(name: Estimated, each: str, given: tuple[str, ...], camera: Camera) -> float:
    """Derivative of a deviation by a parameter of a calibration; the mean of two focal lengths is the one."""
    if name == "focal" and each in ("fx", "fy"):
        return 1 / camera.focal_px / len({"fx", "fy"} & set(given))
    return float(name == each)


def _of_numbers(scene: Scene, name: Estimated) -> float:
    """Variance of a deviation by the scene's own uncertain numbers."""
    if name == "k1":
        return sum(each.u**2 for each in scene.uncertain if each.key == K1)
    camera, total = scene.camera, 0.0
    for each in scene.uncertain:
        if each.key.removeprefix("camera.") in _LENGTHS:
            ends = (with_number(scene, each.key, number_at(scene, each.key) + sign * each.u) for sign in (1, -1))
            longer, shorter = (end.camera.focal_px for end in ends)
            total += ((longer - shorter) / (2 * camera.focal_px)) ** 2
    return total
