"""What ``ice budget --box`` says of an installation box, in words and as a document."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from scenes.results import picked

if TYPE_CHECKING:
    from planner import InstallationBox

HELD = ("distance of the sensor", "distance of the light")  # as the scene says them, in all of the box


def facts(box: InstallationBox) -> dict[str, Any]:
    """``box`` of the document."""
    rows = zip(box.picture.scene.quantities, box.limits, box.U, strict=True)
    return {
        **picked(box, "k", "sensor_deg", "light_deg", "share", "pairs"),
        "measurands": [{"name": each.name, "limit": limit, "U": most} for each, limit, most in rows],
        "limited_by": box.limited_by and asdict(box.limited_by)
        | {"sensor": list(box.limited_by.sensor), "light": list(box.limited_by.light)},
        "held": list(HELD),
    }  # fmt: skip


def said(box: InstallationBox) -> list[str]:
    """In lines."""
    lines = [
        f"Installation box: {box.told} (proved; along the meridian and around, all at once).",
        f"  U (p = {box.p:g}) is that of the gradient locator's noise and of all inputs; held are the "
        f"{' and the '.join(HELD)}.",
    ]
    if box.limited_by is None:
        return [*lines, "  Nothing up to there is known to be too large."]
    poses = box.limited_by.sensor, box.limited_by.light
    sensor, light = (", ".join(f"{angle:.4g}" for angle in pose) for pose in poses)
    return [
        *lines,
        f"  These are {100 * box.share:.0f} % of the least errors that are known to be too large: sensor ({sensor}), "
        f"light ({light}): {box.limited_by.why}.",
    ]
