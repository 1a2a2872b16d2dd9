"""Pieces of faces, and the light that each sends on of what other faces sent it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from imaging.light.emitters import emitters, plain
from imaging.light.exchange import Exchange, exchanged
from imaging.light.places import shifts
from imaging.pictures import Pictures
from scenes import Picture
from scenes.lights import GLANCE
from scenes.parts.rows import different
from scenes.parts.shading import normals_at

_OF_WAY = 0.5  # of the way to what it sees nearest: the side of a piece
_FINER, _LOOKS = 4.0, 16  # times smaller than cells it is at most; rays that look for it
_WITHIN = 0.02  # of the way from a corner to the middle
_SAME = 1e-6  # of a cell, and of a unit normal: corners nearer to each other are one


@dataclass(frozen=True, eq=False)
class Senders:
    """All faces of the bodies, and the floor about them as one more, in pieces.

    Attributes
    ----------
    triangles : ndarray, shape (n, 3, 3)
        Scene units, counter-clockwise from outside.
    normals : ndarray, shape (n, 3, 3)
        Of the surfaces in their corners.
    faces : ndarray of int, shape (n,)
        The face of each.
    sent : ndarray, shape (n, 3)
        Grey levels, in their corners: what of their light has met another face before it.
    """

    triangles: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    sent: np.ndarray


@lru_cache(maxsize=8)
def senders(picture: Picture) -> Senders | None:
    """Of diffuse faces under the picture's lights; None where no two of them see each other."""
    scene = picture.scene
    shining = tuple(plain(each) for each in emitters(scene, Pictures.of(picture).lights, GLANCE))
    light = exchanged(scene, shining)
    if light is None:
        return None
    exchange = light.exchange
    triangles, faces = _pieces(exchange)
    normals = np.broadcast_to(normals_at(exchange.solid, faces[:, None], triangles), triangles.shape)
    points, owners, which = _places(triangles, normals, faces, scene.surfaces.kinds, exchange.cell)
    return Senders(triangles, normals, faces, scene.camera.exposure * light.sent_at(points, owners)[which])


def _pieces(exchange: Exchange) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (n, 3, 3) of all faces, and the face of each: no larger than cells, and smaller the nearer what they
    see is."""

    def limit(triangles: np.ndarray, faces: np.ndarray) -> np.ndarray:
        return np.where(exchange.has[faces], exchange.cell, np.inf)

    def less(triangles: np.ndarray, faces: np.ndarray) -> np.ndarray:
        near = np.maximum(_OF_WAY * _nearest(exchange, triangles.mean(1), faces), exchange.cell / _FINER)
        return np.minimum(near, limit(triangles, faces))

    return _halved(*_halved(exchange.solid.triangles, exchange.solid.triangle_faces, limit), less)


def _halved(
    triangles: np.ndarray, faces: np.ndarray, limit: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (n, 3, 3) of faces (n,), halved across their longest side until that is below the limit."""
    done = []
    while len(triangles):
        sides = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=-1)
        large = sides.max(1) > limit(triangles, faces)
        done.append((triangles[~large], faces[~large]))
        turned = (sides[large].argmax(1)[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(triangles[large], turned[:, :, None], 1), 1, 0)
        middle = (a + b) / 2
        triangles = np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
        faces = np.tile(faces[large], 2)
    found, owners = zip(*done, strict=True)
    return np.concatenate(found), np.concatenate(owners)


def _nearest(exchange: Exchange, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """How far the nearest of what points (n, 3) within faces (n,) see is, (n,); infinite where that is nothing."""
    found, some = np.full(len(points), np.inf), np.flatnonzero(exchange.has[faces])
    normals = exchange.solid.normals[faces[some]]
    met = exchange.met(points[some], normals, _LOOKS, shifts(len(some)))
    np.minimum.at(found, some[met.starts], np.linalg.norm(met.points - points[some[met.starts]], axis=1))
    return found


def _places(
    triangles: np.ndarray, normals: np.ndarray, faces: np.ndarray, kinds: np.ndarray, cell: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (k, 3) that stand for the corners of triangles (n, 3, 3), a face of each (k,), and which each is, (n, 3).

    They lie a little within the triangles of one surface about them: in an inner edge light comes from both sides.
    """
    owners = np.repeat(faces, 3)
    same = np.column_stack([triangles.reshape(-1, 3) / cell, normals.reshape(-1, 3), np.append(kinds, -1.0)[owners]])
    rows, which = different(np.rint(same / _SAME))
    inner = (triangles + _WITHIN * (triangles.mean(1, keepdims=True) - triangles)).reshape(-1, 3)
    points = np.column_stack([np.bincount(which, axis) for axis in inner.T]) / np.bincount(which)[:, None]
    some = np.zeros(len(rows), int)
    some[which] = owners
    return points, some, which.reshape(-1, 3)
