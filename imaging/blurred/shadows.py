"""The borders of shadows beside places of the image, as boundaries of brightness there."""

from __future__ import annotations

import numpy as np

from imaging.blurred.boundaries import Boundaries
from imaging.blurred.segment import Segments
from imaging.light.behind import shadow_steps
from imaging.pictures import Pictures

_FIRST, _STEP = 0.05, 0.25  # px from the place, and from one point that is looked at to the next
_LONG = 1e3  # px: a border goes on along the edge


def with_shadows(near: Boundaries, pictures: Pictures, image: np.ndarray, normal: np.ndarray, far: float) -> Boundaries:
    """The boundaries near places of one picture and the shadows' that end beside them, taken as along the edge.

    Parameters
    ----------
    near : Boundaries
    pictures : Pictures
        With one leading axis, of one.
    image, normal : ndarray, shape (1, E, n, 2)
        The places, ideal px from the middle, and unit directions across their edges.
    far : float
        How far it is looked, px.
    """
    away = np.concatenate([[_FIRST], np.arange(_STEP, far, _STEP)])
    sides = np.array([-1.0, 1.0])[:, None] * away
    looked = image[..., None, None, :] + sides[..., None] * normal[..., None, None, :]
    picture = pictures.at(pictures.sensors[0], tuple(poses[0] for poses in pictures.lights))
    step = shadow_steps(picture, looked.reshape(-1, len(away), 2)).reshape(-1, 2, len(away) - 1)
    place, side, k = np.nonzero(step)
    if not place.size:
        return near
    way = np.array([-1.0, 1.0])[side]
    apart, level, none = way * (away[k] + away[k + 1]) / 2, way * step[place, side, k], np.zeros(place.size)
    borders = Segments(none - _LONG, none + _LONG, apart, none + 1, none, level, none, none)
    return Boundaries(
        np.concatenate([near.place, place]), np.concatenate([near.own, none > 0]),
        Segments(*(np.concatenate(both) for both in zip(near.segments, borders, strict=True))),
        *(np.concatenate([each, np.zeros((place.size, 2))]) for each in (near.sides, near.kinks)), near.unknown,
    )  # fmt: skip
