"""A board beside the part in a render: its geometry, and the part of the image in which it is seen.

It is rendered as a part of the image of its own, in which every edge gets its rays; light that it sends to the part is
left out as long as no other effect calls for light between surfaces.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from imaging.geometry.lens import recorded, undistorted
from imaging.geometry.projection import project_ideal
from render.meshes import mesh
from scenes import Picture

_ALONG = np.linspace(0, 1, 33)[:, None]  # of a side, which a lens may bend


def board_shapes(mitsuba: Any, picture: Picture, passed: float) -> dict[str, Any]:
    """Shapes of a picture's board by name, none without one; ``passed`` is what a filter leaves of their light."""
    board = picture.scene.placement.board
    if board is None:
        return {}
    return {
        name: mesh(mitsuba, triangles, _diffuse(shade * passed))
        for name, shade, triangles in zip(("bright", "dark"), (board.bright, board.dark), board.triangles, strict=True)
    }


def _diffuse(reflectance: float) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "spectrum", "value": reflectance}}


def board_window(picture: Picture) -> tuple[slice, slice] | None:
    """Rows and columns in which a picture's board, and its blur, are seen; None where there are none."""
    board, camera = picture.scene.placement.board, picture.scene.camera
    if board is None:
        return None
    start, stop = board.outline[:, None], np.roll(board.outline, -1, 0)[:, None]
    around = (start + _ALONG * (stop - start)).reshape(-1, 3)
    seen = recorded(project_ideal(around, np.array(list(picture.sensor)), camera), camera)
    size = np.array([camera.width, camera.height])
    low, high = (
        np.clip(edge, 0, size).astype(int)
        for edge in (
            np.floor(np.nanmin(seen, 0) - _margin(picture)),
            np.ceil(np.nanmax(seen, 0) + _margin(picture) + 1),
        )
    )
    return (slice(low[1], high[1]), slice(low[0], high[0])) if (high > low).all() else None


def is_board(picture: Picture, window: tuple[slice, slice]) -> np.ndarray:
    """Which pixels of a window are the board's: those within its outline, or as near to it as blur reaches."""
    board, camera = picture.scene.placement.board, picture.scene.camera
    outline = project_ideal(board.outline, np.array(list(picture.sensor)), camera)
    y, x = np.mgrid[window]
    places = undistorted(np.stack([x, y], -1).astype(float), camera)
    side = np.roll(outline, -1, 0) - outline
    normal = np.stack([side[:, 1], -side[:, 0]], -1) / np.linalg.norm(side, axis=1)[:, None]
    away = np.einsum("...si,si->...s", places[..., None, :] - outline, normal)
    away = away * np.sign(((outline - outline.mean(0)) * normal).sum(1))
    return away.max(-1) <= _margin(picture)


def _margin(picture: Picture) -> float:
    return 2 + 6 * picture.scene.camera.most_blur_px
