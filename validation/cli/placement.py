"""Where a part was found in a picture, for ``ice measure``: keys and words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from scenes.status import is_trusted
from validation.strict_json import plain

if TYPE_CHECKING:
    import measure


def facts(found: measure.Located) -> dict[str, Any]:
    """The place, and standard deviations of its components; null where it is not found."""
    shift, turn = np.split(found.placement, 2)
    sigma = np.sqrt(np.diag(found.covariance))
    return plain({
        "shift": shift, "turn_deg": turn, "sigma_shift": sigma[:3], "sigma_turn_deg": sigma[3:],
        "explained": found.explained, "status": found.status, "reason": found.reason,
    })  # fmt: skip


def text(found: measure.Located) -> str:
    """In a line."""
    if not is_trusted(found.status):
        return f"The part is not found: {found.status}, {found.reason}"
    sigma, unit = np.sqrt(np.diag(found.covariance)), found.picture.scene.units
    shift, turn = (
        ", ".join(f"{value:.4g} +- {one:.1g}" for value, one in zip(values, sds, strict=True))
        for values, sds in zip(np.split(found.placement, 2), np.split(sigma, 2), strict=True)
    )
    what = "its edges are seen there" if found.picture.scene.placement.board is None else "the board's points are found"
    return (
        f"The part lies beside where the scene says by ({shift}) {unit}, turned by ({turn}) degrees (1 sigma);"
        f" {100 * found.explained:.0f} % of {what}"
    )
