"""Pieces of faces, and the light that each sends on of what other faces sent it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from imaging.geometry.measured import measured_pieces
from imaging.light.emitters import emitters, plain
from imaging.light.exchange import Exchange
from imaging.light.exchanged import exchanged
from imaging.light.places import shifts
from imaging.pictures import Pictures
from scenes import Picture
from scenes.lights import GLANCE
from scenes.parts.rows import different
from scenes.parts.shading import normals_at

_OF_WAY = 0.7  # of the way to what it sees nearest: the side of a piece
_PLACES, _LOOKS = 4, 4  # from which a piece looks for it, its corners and its middle, and rays from each
_AT_ONCE = 1 << 14  # pieces whose rays are asked for together
_FINER, _FINEST = 4.0, 16.0  # times smaller than cells pieces are at most, and beside what is measured
_OF_DISTANCE = 0.5  # of that from what is measured: so small pieces may be there
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
    triangles, faces = _pieces(exchange, measured_pieces(scene))
    normals = normals_at(exchange.solid, faces[:, None], triangles)
    points, owners, which = _places(triangles, normals, faces, scene.surfaces.kinds, exchange.cell)
    return Senders(triangles, normals, faces, scene.camera.exposure * light.sent_at(points, owners)[which])


def _pieces(exchange: Exchange, measured: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (n, 3, 3) of all faces, and the face of each: no larger than cells, and smaller the nearer what they
    see is; beside what is ``measured``, edges from end to end (k, 2, 3), smaller than elsewhere."""
    away = _distance(measured, exchange.cell / _FINEST)

    def limit(triangles: np.ndarray, faces: np.ndarray) -> np.ndarray:
        return np.where(exchange.has[faces], exchange.cell, np.inf)

    def less(triangles: np.ndarray, faces: np.ndarray) -> np.ndarray:
        least = exchange.cell / np.array([_FINEST, _FINER])
        least = np.clip(_OF_DISTANCE * away(_looking(triangles)).min(1), *least)
        near = np.maximum(_OF_WAY * _nearest(exchange, triangles, faces), least)
        return np.minimum(near, limit(triangles, faces))

    return _halved(*_halved(exchange.solid.triangles, exchange.solid.triangle_faces, limit), less)


def _distance(edges: np.ndarray, apart: float) -> Callable[[np.ndarray], np.ndarray]:
    """Of points (..., 3) from the nearest of edges (k, 2, 3), (...), to about half of ``apart``; infinite from none."""
    from scipy.spatial import KDTree  # slow to load, and rarely needed

    counts = np.ceil(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1) / apart).astype(int) + 1
    places = [np.linspace(*ends, count) for ends, count in zip(edges, counts, strict=True)]
    tree = KDTree(np.concatenate([np.zeros((0, 3)), *places]))
    return lambda points: tree.query(points)[0]


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


def _nearest(exchange: Exchange, triangles: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """How far the nearest of what triangles (n, 3, 3) of faces (n,) see is, (n,); infinite where that is nothing.

    They look from their corners, too: from its middle one whose side lies at the foot of a narrow step rarely sees it.
    """
    found, some = np.full(len(triangles), np.inf), np.flatnonzero(exchange.has[faces])
    shifted = shifts(_PLACES * len(some)).reshape(-1, _PLACES, 2)
    for at in range(0, len(some), _AT_ONCE):  # in blocks, which bounds the memory
        here = some[at : at + _AT_ONCE]
        points, normals = _looking(triangles[here]).reshape(-1, 3), exchange.solid.normals[faces[here]]
        met = exchange.met(points, normals.repeat(_PLACES, 0), _LOOKS, shifted[at : at + _AT_ONCE].reshape(-1, 2))
        away = np.linalg.norm(met.points - points[met.starts], axis=1)
        np.minimum.at(found, here.repeat(_PLACES)[met.starts], away)
    return found


def _looking(triangles: np.ndarray) -> np.ndarray:
    """Places of triangles (n, 3, 3) that look at others: beside their corners, and their middles, (n, 4, 3)."""
    return np.concatenate([_inner(triangles), triangles.mean(1, keepdims=True)], 1)


def _inner(triangles: np.ndarray) -> np.ndarray:
    """Places a little within triangles (n, 3, 3) that stand for their corners: in an inner edge light comes from both
    sides."""
    return triangles + _WITHIN * (triangles.mean(1, keepdims=True) - triangles)


def _places(
    triangles: np.ndarray, normals: np.ndarray, faces: np.ndarray, kinds: np.ndarray, cell: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (k, 3) that stand for the corners of triangles (n, 3, 3), a face of each (k,), and which each is, (n, 3).

    They lie a little within the triangles of one surface about them: in an inner edge light comes from both sides.
    """
    owners = np.repeat(faces, 3)
    same = np.column_stack([triangles.reshape(-1, 3) / cell, normals.reshape(-1, 3), np.append(kinds, -1.0)[owners]])
    same /= _SAME
    rows, which = different(np.rint(same, out=same))
    inner = _inner(triangles).reshape(-1, 3)
    points = np.column_stack([np.bincount(which, axis) for axis in inner.T]) / np.bincount(which)[:, None]
    some = np.zeros(len(rows), int)
    some[which] = owners
    return points, some, which.reshape(-1, 3)
