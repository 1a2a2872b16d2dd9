"""Places along the limb of a curved surface, seen from many sensors, and what its parameters do to them."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from imaging.contours import OK, Strand, limb
from imaging.features.locator import MOST_PLACES, SPACING, reach
from imaging.geometry.projection import viewpoint
from scenes import Camera, Curved, Scene
from scenes.parts.surfaces import Sphere

LIMB_POINTS = 64
_STRANDS = 2  # of a wall between two ends


@dataclass(frozen=True, eq=False)
class LimbOutline:
    """n places on a limb from sensors of leading shape (...); NaN where it is not seen.

    A wall's two lines follow each other, with a place that is not seen between them.

    Attributes
    ----------
    points, normals : ndarray, shape (..., n, 3)
        In space.
    at, outward : ndarray, shape (..., n, 2)
        Images from the image's middle, px, and unit normals away from the body.
    arc, from_end, curvature : ndarray, shape (..., n)
        Length of image that each stands for, and to the nearer end of its line, px; curvature of the image, 1 / px.
    design : ndarray, shape (..., n, p)
        Derivative of the place along ``outward`` by those of `Curved.parameters`.
    """

    points: np.ndarray
    normals: np.ndarray
    at: np.ndarray
    outward: np.ndarray
    arc: np.ndarray
    from_end: np.ndarray
    curvature: np.ndarray
    design: np.ndarray

    @property
    def seen(self) -> np.ndarray:
        """Which places there are, bool, shape (..., n)."""
        return np.isfinite(self.arc)


def limb_outline(curved: Curved, sensors: np.ndarray, camera: Camera, count: int = LIMB_POINTS) -> LimbOutline:
    """About ``count`` places on the limb of a surface from sensors (..., 2)."""
    flat = np.ascontiguousarray(sensors, float).reshape(-1, 2)
    poses, back = np.unique(flat, axis=0, return_inverse=True)
    made = [_from_one(curved, pose, camera, count) for pose in poses]
    lead = sensors.shape[:-1]
    parts = {f.name: np.stack([getattr(each, f.name) for each in made])[back.ravel()] for f in fields(LimbOutline)}
    return LimbOutline(**{name: part.reshape(*lead, *part.shape[1:]) for name, part in parts.items()})


def _from_one(curved: Curved, pose: np.ndarray, camera: Camera, count: int) -> LimbOutline:
    found = limb(curved.surface, pose, camera, count if isinstance(curved.surface, Sphere) else count // _STRANDS)
    strands = found.strands if found.status == OK else ()
    take = curved.parameters(viewpoint(camera, pose)) if strands else np.zeros((1, curved.count))
    if isinstance(curved.surface, Sphere):
        pieces = [_piece(strand, take, count) for strand in strands]
        return _joined(pieces, count, curved.count)
    return _joined([_piece(strand, take, count // _STRANDS + 1) for strand in strands], count + _STRANDS, curved.count)


def _piece(strand: Strand, take: np.ndarray, size: int) -> list[np.ndarray]:
    """A strand's arrays, filled up to ``size`` with NaN."""
    length = strand.arc.sum()
    from_end = np.full(len(strand.u), np.inf) if strand.closed else np.minimum(strand.u, 1 - strand.u) * length
    parts = strand.points, strand.normals, strand.at, strand.outward, strand.arc, from_end, strand.curvature
    return [_filled(part, size) for part in (*parts, strand.design @ take)]


def _filled(part: np.ndarray, size: int) -> np.ndarray:
    whole = np.full((size, *part.shape[1:]), np.nan)
    whole[: len(part)] = part
    return whole


def _joined(pieces: list[list[np.ndarray]], size: int, parameters: int) -> LimbOutline:
    shapes = (3,), (3,), (2,), (2,), (), (), (), (parameters,)
    parts = zip(*pieces, strict=True) if pieces else ((np.empty((0, *shape)),) for shape in shapes)
    return LimbOutline(*(_filled(np.concatenate(part), size) for part in parts))


def limb_places(outline: LimbOutline, scale: float) -> int:
    """How many places along an outline of `LIMB_POINTS` are measured: about `SPACING` smoothing scales (px) apart, a
    multiple of its own."""
    length = np.nansum(outline.arc)
    return LIMB_POINTS * int(np.clip(np.ceil(length / (SPACING * scale * LIMB_POINTS)), 1, MOST_PLACES))


def framed(outline: LimbOutline, scene: Scene) -> np.ndarray:
    """Which places are far enough within the image to be measured, bool, shape (..., n)."""
    camera, locator = scene.camera, scene.locator
    margin = locator.window_px + 4 * locator.scale_px + 1
    half = np.array([camera.width - 1, camera.height - 1]) / 2 - margin
    with np.errstate(invalid="ignore"):
        return (np.abs(outline.at) <= half).all(-1)


def clear_of_ends(outline: LimbOutline, scene: Scene) -> np.ndarray:
    """Which places no end of their line disturbs, bool, shape (..., n)."""
    with np.errstate(invalid="ignore"):
        return outline.from_end >= reach(scene.locator.scale_px, scene.camera.most_blur_px)
