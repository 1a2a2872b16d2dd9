"""Light that plane faces of a body send to each other, by radiosity: of an inner edge, a step, a pocket.

Faces on the convex hull see no other, and walls of round through holes have a closed form (`imaging.light.bore`). The
others are divided into patches, whose form factors with visibility are found once for a solid; light and shadow on
them, and so the light exchanged, once for each light.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from imaging.geometry.rays import first_face
from imaging.light.emitters import Emitter
from imaging.light.irradiance import beam
from scenes import Scene, Solid

if TYPE_CHECKING:
    from scipy.interpolate import RectBivariateSpline

_PATCHES = 160  # about, on all faces together
_LEAST = 6  # of a face, each way
_WITHIN = 0.01  # of the first cell's half
_FINE = 4  # places in a patch, each way, where it is asked what light reaches
_AT_ONCE = 256  # points whose form factors are made together
_SMALL = 1e-3  # of the area of all such faces: smaller ones send nothing
_FLAT = 1e-6  # of a cell's side: how far its corners may be below a horizon
_LIFT = 1e-6  # of the object's size: between a patch and its own face


@dataclass(frozen=True, eq=False)
class Sheet:
    """A rectangle about a face, in its plane, with patches at the middles of its cells and nodes there and on its rim.

    Attributes
    ----------
    face : int
    corner, one, two : ndarray, shape (3,)
        A corner of the rectangle and its unit sides.
    u, v : ndarray
        Places of the nodes along the sides.
    patches : ndarray, shape (p, 3)
        Those on the face.
    area : float
        Of one patch: its share of the face.
    """

    face: int
    corner: np.ndarray
    one: np.ndarray
    two: np.ndarray
    u: np.ndarray
    v: np.ndarray
    patches: np.ndarray
    area: float

    @property
    def nodes(self) -> np.ndarray:
        """Shape (u v, 3); those on its rim a little within, for in an inner edge light comes from both sides."""
        u, v = (np.clip(n, _WITHIN * n[1], n[-1] - _WITHIN * n[1]) for n in (self.u, self.v))
        places = self.corner + u[:, None, None] * self.one + v[:, None] * self.two
        return places.reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class Patches:
    """Middles (p, 3) of patches, normals (p, 3), corners from the middles (4, p, 3), areas, and their cells' (p,)."""

    points: np.ndarray
    normals: np.ndarray
    corners: np.ndarray
    areas: np.ndarray
    cells: np.ndarray

    @classmethod
    def of(cls, solid: Solid, sheets: tuple[Sheet, ...]) -> Patches:
        """Of all sheets, one after the other."""
        counts = [len(sheet.patches) for sheet in sheets]
        sides = [(sheet.u[-1] / (sheet.u.size - 2), sheet.v[-1] / (sheet.v.size - 2)) for sheet in sheets]
        corners = [
            [(i * a * sheet.one + j * b * sheet.two) / 2 for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            for sheet, (a, b) in zip(sheets, sides, strict=True)
        ]
        return cls(
            np.concatenate([sheet.patches for sheet in sheets]),
            np.repeat(solid.normals[[sheet.face for sheet in sheets]], counts, 0),
            np.repeat(np.array(corners), counts, 0).swapaxes(0, 1),
            np.repeat([sheet.area for sheet in sheets], counts),
            np.repeat([a * b for a, b in sides], counts),
        )


@dataclass(frozen=True, eq=False)
class Exchange:
    """Patches of all sheets, and form factors between them and from the sheets' nodes."""

    sheets: tuple[Sheet, ...]
    patches: Patches
    between: np.ndarray
    at_nodes: tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class Exchanged:
    """Light that faces have from each other under given lights, irradiance in units of the signal of a white face.

    Attributes
    ----------
    exchange : Exchange
    sent : ndarray, shape (P,)
        What each patch sends.
    told : dict of int to RectBivariateSpline
        What arrives on a face, by its sheet's coordinates.
    """

    exchange: Exchange
    sent: np.ndarray
    told: dict[int, RectBivariateSpline]

    def at(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """What arrives at points (..., 3) on faces (...)."""
        found = np.zeros(faces.shape)
        for sheet in self.exchange.sheets:
            here = faces == sheet.face
            if here.any():
                away = points[here] - sheet.corner
                place = (np.clip(away @ side, 0, n[-1]) for side, n in ((sheet.one, sheet.u), (sheet.two, sheet.v)))
                found[here] = self.told[sheet.face].ev(*place)
        return found


@lru_cache(maxsize=4)
def exchange_of(solid: Solid, without: tuple[int, ...]) -> Exchange | None:
    """Of the faces that are not on the convex hull, those ``without`` left out; None where fewer than two are."""
    areas = np.bincount(solid.triangle_faces, _areas(solid.triangles), len(solid.faces))
    inner = [f for f in np.flatnonzero(~solid.outer) if f not in without]
    inner = [f for f in inner if areas[f] > _SMALL * areas[inner].sum()]
    if len(inner) < 2:
        return None
    cell = np.sqrt(areas[inner].sum() / _PATCHES)
    sheets = tuple(_sheet(solid, int(face), cell) for face in inner)
    patches = Patches.of(solid, sheets)
    at_nodes = [
        _seen_factors(solid, sheet.nodes, np.broadcast_to(solid.normals[sheet.face], sheet.nodes.shape), patches)
        for sheet in sheets
    ]
    return Exchange(sheets, patches, _seen_factors(solid, patches.points, patches.normals, patches), tuple(at_nodes))


def _areas(triangles: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=-1) / 2


def _sheet(solid: Solid, face: int, cell: float) -> Sheet:
    """The rectangle along the face's longest edge."""
    corners, normal = solid.vertices[list(solid.faces[face])], solid.normals[face]
    sides = np.roll(corners, -1, 0) - corners
    one = max(sides, key=np.linalg.norm)
    one = one / np.linalg.norm(one)
    two = np.cross(normal, one)
    low, high = ((corners @ np.stack([one, two], 1)).min(0), (corners @ np.stack([one, two], 1)).max(0))
    corner = normal * solid.offsets[face] + low[0] * one + low[1] * two
    counts = np.maximum(np.ceil((high - low) / cell).astype(int), _LEAST)
    middles = [(np.arange(n) + 0.5) / n * size for n, size in zip(counts, high - low, strict=True)]
    nodes = [np.concatenate([[0.0], m, [size]]) for m, size in zip(middles, high - low, strict=True)]
    places = (corner + middles[0][:, None, None] * one + middles[1][:, None] * two).reshape(-1, 3)
    places = places[_on(solid.triangles[solid.triangle_faces == face], places)]
    area = _areas(solid.triangles[solid.triangle_faces == face]).sum() / max(len(places), 1)
    return Sheet(face, corner, one, two, *nodes, places, float(area))


def _on(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Which points (n, 3) of their plane lie on triangles (t, 3, 3)."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inside = np.ones((len(points), len(triangles)), bool)
    for k in range(3):
        side = triangles[:, (k + 1) % 3] - triangles[:, k]
        away = points[:, None] - triangles[:, k]
        inside &= np.einsum("nti,ti->nt", np.cross(side[None], away), normals) >= 0
    return inside.any(1)


def form_factors(points: np.ndarray, normals: np.ndarray, patches: Patches) -> np.ndarray:
    """From points (n, 3) to patches, nothing between them, (n, p).

    By Lambert's contour integral over a patch' rectangle where all of it is over the point's horizon; else as a disc.
    """
    parts = [
        _form_factors(points[at : at + _AT_ONCE], normals[at : at + _AT_ONCE], patches)
        for at in range(0, len(points), _AT_ONCE)
    ]
    return np.concatenate(parts) if parts else np.zeros((0, len(patches.points)))


def _form_factors(points: np.ndarray, normals: np.ndarray, patches: Patches) -> np.ndarray:
    away = patches.points - points[:, None]
    distance2 = (away**2).sum(-1)
    here = np.einsum("npi,ni->np", away, normals)
    there = -np.einsum("npi,pi->np", away, patches.normals)
    corners = [away + offset for offset in patches.corners]
    heights = np.stack([np.einsum("npi,ni->np", corner, normals) for corner in corners])
    whole = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        disc = np.maximum(here, 0) / distance2 * there / (np.pi * distance2 + patches.areas) * patches.areas
        for k, corner in enumerate(corners):
            onward = corners[(k + 1) % 4]
            turn = np.cross(corner, onward)
            size = np.linalg.norm(turn, axis=-1)
            angle = np.arctan2(size, (corner * onward).sum(-1))
            whole = whole + angle / size * np.einsum("npi,ni->np", turn, normals)
        whole = np.abs(whole) / (2 * np.pi) * patches.areas / patches.cells
    over = (heights >= -_FLAT * patches.cells**0.5).all(0) & np.isfinite(whole)
    return np.where(there > 0, np.nan_to_num(np.where(over, whole, disc)), 0.0)


def _seen_factors(solid: Solid, points: np.ndarray, normals: np.ndarray, patches: Patches) -> np.ndarray:
    """The same, 0 where something stands between."""
    found = form_factors(points, normals, patches)
    start, stop = np.nonzero(found)
    lift = _LIFT * solid.extent
    origin, end = points[start] + lift * normals[start], patches.points[stop] + lift * patches.normals[stop]
    _, t = first_face(solid, origin, end - origin, ())
    found[start[t < 1], stop[t < 1]] = 0.0
    return found


@lru_cache(maxsize=8)
def exchanged(scene: Scene, emitters: tuple[Emitter, ...], without: tuple[int, ...]) -> Exchanged | None:
    """What the faces of a scene's object send to each other under some emitters."""
    exchange = exchange_of(scene.solid, without)
    if exchange is None:
        return None
    white = np.concatenate(
        [np.full(len(sheet.patches), scene.surfaces.of(sheet.face).diffuse()) for sheet in exchange.sheets]
    )
    direct = _direct(scene, exchange.patches, emitters)
    sent = np.linalg.solve(np.eye(direct.size) - white[:, None] * exchange.between, white * direct)
    from scipy.interpolate import RectBivariateSpline  # slow to load, and rarely needed

    told = {
        sheet.face: RectBivariateSpline(sheet.u, sheet.v, (factors @ sent).reshape(sheet.u.size, sheet.v.size))
        for sheet, factors in zip(exchange.sheets, exchange.at_nodes, strict=True)
    }
    return Exchanged(exchange, sent, told)


def _direct(scene: Scene, patches: Patches, emitters: tuple[Emitter, ...]) -> np.ndarray:
    """What arrives on patches from the lights, (p,): the mean over places in their cells, for shadows cross them."""
    share = (np.arange(_FINE) + 0.5) / _FINE
    a, b = np.stack(np.meshgrid(share, share), -1).reshape(-1, 2).T[:, :, None, None]
    first, right, _, left = patches.corners
    points = patches.points + first + a * (right - first) + b * (left - first)  # (cells, p, 3)
    start, found = points + _LIFT * scene.solid.extent * patches.normals, 0.0
    for emitter in emitters:
        at = np.array(emitter.at)
        blocker, t = first_face(scene.bodies, np.broadcast_to(at, start.shape), start - at, ())
        arriving = beam(emitter, points)
        cosine = np.maximum(np.einsum("cpi,pi->cp", arriving.to_light, patches.normals), 0)
        found = found + np.where((blocker < 0) | (t >= 1), arriving.strength * cosine, 0.0)
    return found.mean(0)


def factors_through(
    exchange: Exchange, points: np.ndarray, normals: np.ndarray, free: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Form factors from points (n, 3) of unit normals (n, 3) to the patches, (n, p).

    ``free`` says which ways to their middles (p, 3) are, bool (n, p).
    """
    patches = exchange.patches
    return np.where(free(patches.points), form_factors(points, normals, patches), 0.0)
