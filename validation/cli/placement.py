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
    from scenes import Scene


def facts(found: measure.Located) -> dict[str, Any]:
    """The place, the camera's numbers that are estimated, and standard deviations; null where it is not found."""
    told = of_place(found.picture.scene, found.placement, np.sqrt(np.diag(found.covariance)))
    return told | plain({"explained": found.explained, "status": found.status, "reason": found.reason})


def text(found: measure.Located) -> str:
    """In a line."""
    if not is_trusted(found.status):
        return f"The part is not found: {found.status}, {found.reason}"
    scene = found.picture.scene
    what = "its edges are seen there" if scene.placement.board is None else "the board's points are found"
    lies = where(scene, found.placement, np.sqrt(np.diag(found.covariance)))
    return f"{lies}; {100 * found.explained:.0f} % of {what}"


def of_place(scene: Scene, place: np.ndarray, sigma: np.ndarray) -> dict[str, Any]:
    """A part's place and a camera's numbers, (6 + c,), with standard deviations; null of what is not told."""
    shift, turn, _ = np.split(place, (3, 6))
    camera = {name: {"value": value, "sigma": sd} for name, value, sd in _of_camera(scene, place, sigma)}
    return plain({
        "shift": shift, "turn_deg": turn, "sigma_shift": sigma[:3], "sigma_turn_deg": sigma[3:6], "camera": camera,
    })  # fmt: skip


def where(scene: Scene, place: np.ndarray, sigma: np.ndarray) -> str:
    """The same in words."""
    shift, turn = (
        ", ".join(f"{value:.4g} +- {one:.1g}" for value, one in zip(values, sds, strict=True))
        for values, sds in zip(np.split(place[:6], 2), np.split(sigma[:6], 2), strict=True)
    )
    camera = "".join(f"; {name} {value:.6g} +- {sd:.1g}" for name, value, sd in _of_camera(scene, place, sigma))
    return (
        f"The part lies beside where the scene says by ({shift}) {scene.units}, turned by ({turn}) degrees"
        f" (1 sigma){camera}"
    )


def _of_camera(scene: Scene, place: np.ndarray, sigma: np.ndarray) -> list[tuple[str, float, float]]:
    """Names, values and standard deviations of what is estimated of the camera: focal_px, k1; the scene is of the
    picture where they are found."""
    rows = []
    for name, sd, off in zip(scene.placement.camera, sigma[6:], place[6:], strict=True):
        focal = scene.camera.focal_px
        label, value, scale = ("focal_px", focal, focal) if name == "focal" else (name, number_at(scene, K1), 1.0)
        rows.append((label, value if np.isfinite(off) else np.nan, scale * sd))
    return rows
