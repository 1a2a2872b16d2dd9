"""The outline of a circular edge as the mesh has it, a polygon, and where a locator finds its smooth image."""

from __future__ import annotations

import numpy as np

from imaging.geometry.projection import from_axis
from imaging.pictures import Pictures
from scenes import Circle, Solid

_SPACING, _FARTHEST = 0.25, 4.0  # standard deviations: of the lines beside a place, and how far they go
_LEAST = 2.5  # as far they must meet the outline
_STEPS = 5  # of Newton's method
_AT_ONCE = 1 << 20  # numbers


def facets(solid: Solid, circle: Circle, angle: np.ndarray) -> np.ndarray:
    """Radius of the mesh's rim, a polygon, over the circle's at angles (m,).

    The picture is one of the mesh: between its vertices, which lie on the circle, the rim runs inside it.
    """
    one, two = circle.axes
    first, last = np.moveaxis((_pieces(solid, circle) - circle.centre) @ np.stack([one, two], -1), 1, 0)
    toward = np.stack([np.cos(angle), np.sin(angle)], -1)
    along = last - first
    turn = toward[:, None, 0] * along[:, 1] - toward[:, None, 1] * along[:, 0]  # (m, pieces)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (first[:, 0] * along[:, 1] - first[:, 1] * along[:, 0]) / turn
        share = (first[:, 0] * toward[:, None, 1] - first[:, 1] * toward[:, None, 0]) / turn
    hit = (share >= -1e-9) & (share <= 1 + 1e-9) & (far > 0)
    found = np.where(hit, far, np.nan)
    return np.nan_to_num(np.fmax.reduce(found, axis=1) / circle.radius, nan=1.0)


def _pieces(solid: Solid, circle: Circle) -> np.ndarray:
    """Ends of the straight edges that stand for a circle, (pieces, 2, 3)."""
    return solid.vertices[[solid.edge(name).ends for name in circle.edges]]


def outline_beside(
    pictures: Pictures, circle: Circle, places: np.ndarray, normals: np.ndarray, beside: np.ndarray
) -> np.ndarray:
    """How far outwards a rim's outline runs ``beside`` places on it, ideal px, of one picture.

    Parameters
    ----------
    circle : Circle
        As it is expected; the object's outline is scaled and shifted to it.
    places, normals : ndarray, shape (m, 2)
        Image points from the image's middle (`from_axis`), ideal px, and unit normals away from the rim's middle.
    beside : ndarray, shape (m, J)
        Distances along the rim's tangent (-n_y, n_x), ideal px.

    Returns
    -------
    ndarray, shape (m, J)
        Along the normal; NaN where the outline does not reach so far.
    """
    solid = pictures.scene.solid
    nominal = solid.circle(circle.name)
    ends = circle.centre + (_pieces(solid, nominal) - nominal.centre) * (circle.radius / nominal.radius)
    ends = from_axis(ends.reshape(-1, 3), pictures.sensors, pictures.scene.camera).reshape(-1, 2, 2)
    found = np.empty(beside.shape)
    many = max(1, _AT_ONCE // (len(ends) * beside.shape[1]))
    for k in range(0, len(places), many):
        part = slice(k, k + many)
        found[part] = _crossed(ends, places[part], normals[part], beside[part])
    return found


def _crossed(ends: np.ndarray, places: np.ndarray, normals: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Where lines along the normals first cross pieces (p, 2, 2), counted from the tangent, (m, J)."""
    away = ends - places[:, None, None]  # (m, p, 2, 2)
    across = np.einsum("mpei,mi->mpe", away, normals)
    along = np.einsum("mpei,mi->mpe", away, np.stack([-normals[:, 1], normals[:, 0]], -1))
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = (across[..., 1] - across[..., 0]) / (along[..., 1] - along[..., 0])
    hit = (beside[:, None] < along[..., :1]) != (beside[:, None] < along[..., 1:])  # (m, p, J), few of them
    line, piece, which = (each.ravel() for each in np.nonzero(hit))
    place = across[line, piece, 0] + rate[line, piece] * (beside[line, which] - along[line, piece, 0])
    order = np.argsort(np.abs(place), kind="stable")[::-1]
    found = np.full(beside.shape, np.nan)
    found[line[order], which[order]] = place[order]  # the nearest last
    return found


def smooth_outline(
    pictures: Pictures, circle: Circle, places: np.ndarray, normals: np.ndarray, width: np.ndarray
) -> np.ndarray:
    """How far outwards the zero crossing lies for the outline is no straight line, ideal px, shape (m,); NaN where the
    outline turns away within `_LEAST` standard deviations.

    Of an image of two levels under a Gaussian of ``width`` (m,), blur and smoothing together, ideal px.
    """
    steps = np.arange(-_FARTHEST, _FARTHEST + _SPACING / 2, _SPACING)
    weight = np.exp(-(steps**2) / 2)
    where = outline_beside(pictures, circle, places, normals, width[:, None] * steps) / width[:, None]
    missed, needed = ~np.isfinite(where), np.abs(steps) <= _LEAST
    found = width * zero_of_steps(np.where(missed, 0.0, where), np.where(missed, 0.0, weight))
    return np.where((missed & needed).any(1), np.nan, found)


def zero_of_steps(where: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Zero crossing (m,) of the second derivative of unit steps at places (m, J) of weights (..., J), in sigma."""
    found = np.zeros(len(where))
    for _ in range(_STEPS):
        away = where - found[:, None]
        bell = weight * np.exp(-(away**2) / 2)
        found = found + (bell * away).sum(-1) / (bell * (1 - away**2)).sum(-1)
    return found
