"""Where a part was found in a picture, for ``ice measure``: keys and words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from scenes.cameras.estimated import K1
from scenes.numbers import number_at
from scenes.status import is_trusted
from validation.strict_json import plain

if TYPE_CHECKING:
    import measure


def facts(found: measure.Located) -> dict[str, Any]:
    """The place, the camera's numbers that are estimated, and standard deviations; null where it is not found."""
    shift, turn, _ = np.split(found.placement, (3, 6))
    sigma = np.sqrt(np.diag(found.covariance))
    camera = {name: {"value": value, "sigma": sd} for name, value, sd in _of_camera(found)}
    return plain({
        "shift": shift, "turn_deg": turn, "sigma_shift": sigma[:3], "sigma_turn_deg": sigma[3:6], "camera": camera,
        "explained": found.explained, "status": found.status, "reason": found.reason,
    })  # fmt: skip


def text(found: measure.Located) -> str:
    """In a line."""
    if not is_trusted(found.status):
        return f"The part is not found: {found.status}, {found.reason}"
    sigma, unit = np.sqrt(np.diag(found.covariance)), found.picture.scene.units
    shift, turn = (
        ", ".join(f"{value:.4g} +- {one:.1g}" for value, one in zip(values, sds, strict=True))
        for values, sds in zip(np.split(found.placement[:6], 2), np.split(sigma[:6], 2), strict=True)
    )
    camera = "".join(f"; {name} {value:.6g} +- {sd:.1g}" for name, value, sd in _of_camera(found))
    what = "its edges are seen there" if found.picture.scene.placement.board is None else "the board's points are found"
    return (
        f"The part lies beside where the scene says by ({shift}) {unit}, turned by ({turn}) degrees (1 sigma);"
        f" {100 * found.explained:.0f} % of {what}{camera}"
    )


def _of_camera(found: measure.Located) -> list[tuple[str, float, float]]:
    """Names, values and standard deviations of what is estimated of the camera: focal_px, k1."""
    scene, rows = found.picture.scene, []
    for name, sd in zip(scene.placement.camera, np.sqrt(np.diag(found.covariance))[6:], strict=True):
        told = is_trusted(found.status)
        focal = scene.camera.focal_px
        label, value, scale = ("focal_px", focal, focal) if name == "focal" else (name, number_at(scene, K1), 1.0)
        rows.append((label, value if told else np.nan, scale * sd))
    return rows
