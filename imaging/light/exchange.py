"""What faces see of each other, by rays: of an inner edge, a step, a pocket, an obstacle, the floor.

Faces on the convex hull of all bodies see no other, but the floor where they do not look up. All that see others,
however many, have places spread evenly over them, each of which stands for a patch: what is nearer to it than to others
and looks the same way, so that facets of a fillet share one. Where light is told roughly, a patch is that of many
places. Rays tell once for a solid which share of what a patch sees is each other one. On a face that is asked for nodes
see others by more rays. Which light goes that way: `imaging.light.exchanged`.

Rays follow Lambert's cosine and a low-discrepancy sequence: a share is off by about their number to the power -0.75,
and all shares of a place add to 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from imaging.geometry.rays import first_face
from imaging.light.annulus import Annulus, about
from imaging.light.kept import kept
from imaging.light.nodes import Frame, along, frame_of, goes_on, onto
from imaging.light.places import Places, areas_of, in_unit_square, shift_of, shifts, ways_about
from imaging.light.walls import Wall, wall
from imaging.threads import each
from scenes import Circle, Floor, Solid
from scenes.parts.shading import normals_at
from scenes.parts.solid import assembled

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix
    from scipy.spatial import KDTree

_CELLS = 400  # of the whole body
_RIM_CELLS, _RIM_SCALE = 400, 0.5  # as many places more beside measured rims, and cells that count as one there
_PLACES, _RAYS = 15, 32  # of a cell, about, and from each of them; an odd number, or some are midway between two
_FROM_NODE, _FROM_SMALL = 1024, 256  # rays, the latter on a plane face that is narrower than a cell
_FROM_RIM = 4096  # of a node beside a measured rim
_FROM_WALL = 1024  # of a curved surface all of whose facets are told together
_ROUGH_RAYS, _ROUGH_NODE = 8, 64  # of a place and of a node where the light is told roughly, by patches of a cell
_NODES = 160  # of the whole body; nodes on a face that is asked for stand so dense,
_DENSER, _FROM_DENSE = 3, 512  # told finely times denser each way on a plane one, and rays from there
_WITHIN = 0.01  # of the first cell's half
_APART = 2.0  # cells: how far normals of 90 degrees keep places apart
_FLOOR = 1.0  # of the bodies' size: how far about them the floor has patches; beyond it is like the nearest of them
_FLOOR_CELLS = 900  # of it, besides those of the bodies
_UP = 1 - 1e-9  # cosine of a normal that sees no floor
AT_ONCE = 1 << 15  # rays
_NUMBER = np.int32  # of what rays meet there are millions, which are kept
LIFT = 1e-6  # of the object's size: between a place and its own face
MARGIN = 1e-6  # of the object's size: what passes an edge more closely is decided in double precision


class Hits(NamedTuple):
    """What rays meet, k of them: the ray's point and its number, where and on which face, in which patch it ends."""

    starts: np.ndarray
    rays: np.ndarray
    points: np.ndarray
    faces: np.ndarray
    patches: np.ndarray


NOT_TOLD = -1
NOTHING_MET = Hits(*(np.zeros((0, 3)) if name == "points" else np.zeros(0, _NUMBER) for name in Hits._fields))


@dataclass(frozen=True, eq=False)
class Exchange:
    """Patches of the faces of a solid that see others.

    Attributes
    ----------
    solid : Solid
        All bodies, and the floor as its last face (`room`).
    faces : ndarray of int
        Those faces.
    cell : float
        Its side, about; scene units.
    scale : float
        As far apart places are no nearer than those of normals that differ by half of 90 degrees.
    places : Places
    patches : ndarray of int, shape (m,)
        The patch of each place.
    tree : KDTree
        Of the places that stand for patches.
    floor : Floor or None
        Which reaches beyond its patches.
    roughly : bool
        Whether few rays tell the light, and patches of a cell, also that of faces that are smaller.
    rims : tuple of Circle
        Beside which the light is told closely.
    finely : bool
        Whether it is told at more nodes of plane faces.
    """

    solid: Solid
    faces: np.ndarray
    cell: float
    scale: float
    places: Places
    patches: np.ndarray
    tree: KDTree
    floor: Floor | None = None
    roughly: bool = False
    rims: tuple[Circle, ...] = ()
    finely: bool = False

    @cached_property
    def fine(self) -> Exchange:
        """The same told finely."""
        return replace(self, finely=True)

    @cached_property
    def annuli(self) -> dict[int, Annulus]:
        """Beside rims on faces that see others, by numbers beyond those of the faces."""
        some = [Annulus.beside(self.solid, circle, _apart(self)) for circle in self.rims if self.has[circle.face]]
        return dict(enumerate(some, len(self.solid.faces)))

    @cached_property
    def small(self) -> np.ndarray:
        """Whether a face is told by patches alone, bool (F,): roughly, and it is narrower and shorter than one."""
        low, high = (np.full((len(self.solid.faces), 3), end) for end in (np.inf, -np.inf))
        np.minimum.at(low, self.solid.triangle_faces, self.solid.triangles.min(1))
        np.maximum.at(high, self.solid.triangle_faces, self.solid.triangles.max(1))
        return self.roughly & (np.linalg.norm(high - low, axis=1) < self.cell)

    def wall(self, number: int) -> Wall | None:
        """The curved surface of a number below -1 (`told_as`)."""
        return wall(self.solid, -2 - number, _apart(self))

    def told_as(self, faces: np.ndarray) -> np.ndarray:
        """Of which number the light on faces (n,) is told: their own, or their curved surface's, below -1; -1 where
        none is."""
        found = np.where(self.has[faces] & ~self.small[faces], faces, NOT_TOLD)
        if self.solid.regions is None:
            return found
        curved = np.flatnonzero((found >= 0) & ~self.solid.plane[faces])
        regions = self.solid.regions[faces[curved]]
        for region in np.unique(regions).tolist():
            if self.wall(-2 - region) is not None:
                found[curved[regions == region]] = -2 - region
        return found

    @cached_property
    def has(self) -> np.ndarray:
        """Whether a face is one of those, bool (F + 1,); the last says that nothing is not."""
        found = np.zeros(len(self.solid.faces) + 1, bool)
        found[self.faces] = True
        return found

    @property
    def rays(self) -> int:
        """From each place."""
        return _ROUGH_RAYS if self.roughly else _RAYS

    @cached_property
    def seen(self) -> Hits:
        """What rays from all places meet."""
        return self.met(self.places.points, self.places.normals, self.rays, shifts(len(self.places.points)))

    @cached_property
    def between(self) -> csr_matrix:
        """Form factors between patches, (p, p)."""
        from scipy.sparse import csr_matrix  # slow to load, and rarely needed

        patches, count = self.patches[self.seen.starts], self.tree.n
        share = 1 / (self.rays * np.bincount(self.patches)[patches])
        return csr_matrix((share, (patches, self.seen.patches)), (count, count))

    def of_patches(self, values: np.ndarray) -> np.ndarray:
        """Means (p,) over the patches of what there is at places (m,)."""
        return np.bincount(self.patches, values) / np.bincount(self.patches)

    def met(
        self, points: np.ndarray, normals: np.ndarray, rays: int, shifted: np.ndarray = np.zeros(2),
        but: tuple[int, ...] = (),
    ) -> Hits:  # fmt: skip
        """What so many rays from each of points (n, 3) of unit normals meet, that which ends on faces ``but`` left out.

        Others where the unit square that they stand for is ``shifted`` otherwise, (2,) or (n, 2).
        """
        shifted = np.broadcast_to(shifted, (len(points), 2))

        def of(part: slice) -> Hits:
            found = self._met(points[part], normals[part], (in_unit_square(rays) + shifted[part, None]) % 1.0, but)
            return found._replace(starts=found.starts + part.start)

        return Hits(*map(np.concatenate, zip(*each(of, len(points), AT_ONCE // rays), strict=True)))

    def _met(self, points: np.ndarray, normals: np.ndarray, square: np.ndarray, but: tuple[int, ...]) -> Hits:
        ways = ways_about(normals, square)
        starts = np.broadcast_to((points + LIFT * self.solid.extent * normals)[:, None], ways.shape)
        face, t = first_face(self.solid, starts, ways, (), margin=MARGIN)
        if self.floor is not None:
            face, t = self._met_or_floor(face, t, starts, ways)
        sends = self.has.copy()
        sends[list(but)] = False
        point, ray = np.nonzero(sends[face])  # nothing met, -1, is the last
        face, t = face[point, ray], t[point, ray]
        places = starts[point, ray] + t[:, None] * ways[point, ray]
        _, patch = self.nearest(places, self.solid.normals[face])
        point, ray, face, patch = (numbers.astype(_NUMBER) for numbers in (point, ray, face, patch))
        return Hits(point, ray, places, face, patch)

    def nearest(self, points: np.ndarray, normals: np.ndarray, count: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """Of points (n, 3) of unit normals the patches that they belong to, or so many, and how far these are."""
        return self.tree.query(_placed(points, normals, self.scale), count)

    def _met_or_floor(
        self, face: np.ndarray, t: np.ndarray, starts: np.ndarray, ways: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """With the floor where rays (..., 3) that meet nothing go down, as far as it reaches."""
        down = (face < 0) & (ways[..., 2] < 0)
        until = np.where(down, (self.floor.height - starts[..., 2]) / np.where(down, ways[..., 2], -1.0), np.inf)
        reached = down & (until > 0)
        place = starts[..., :2] + np.where(reached, until, 0.0)[..., None] * ways[..., :2]
        reached &= (np.abs(place) <= self.floor.half_side).all(-1)
        return np.where(reached, len(self.solid.faces) - 1, face), np.where(reached, until, t)


@dataclass(frozen=True, eq=False)
class Sheet:
    """Nodes on a face, at places u along one side of its rectangle and v along the other; or around a rim and away
    from it.

    ``met`` is what so many ``rays`` from each of them meet.
    """

    frame: Frame | Annulus | Wall
    u: np.ndarray
    v: np.ndarray
    met: Hits
    rays: int


@lru_cache(maxsize=4)
def room(bodies: Solid, floor: Floor | None) -> Solid:
    """The bodies, and as one more face the floor about them."""
    if floor is None:
        return bodies
    low, high = (end(bodies.vertices[:, :2], axis=0) for end in (np.min, np.max))
    away = _FLOOR * bodies.extent
    (left, near), (right, far) = (np.clip(v, -floor.half_side, floor.half_side) for v in (low - away, high + away))
    if right <= left or far <= near:  # it lies beside them
        left = near = -floor.half_side
        right = far = floor.half_side
    corners = np.array([(left, near), (right, near), (right, far), (left, far)])
    square = np.column_stack([corners, np.full(4, floor.height)])
    return assembled(bodies, Solid(("a", "b", "c", "d"), square, ((0, 1, 2, 3),), ()))


@lru_cache(maxsize=4)
def exchange_of(
    bodies: Solid, floor: Floor | None = None, roughly: bool = False, rims: tuple[Circle, ...] = (),
    without: tuple[int, ...] = (),
) -> Exchange | None:  # fmt: skip
    """Of the faces that see others, those ``without`` left out; None where fewer than two do.

    Places are denser beside those of ``rims`` that such faces meet in.
    """
    from scipy.spatial import KDTree  # slow to load, and rarely needed

    solid, some = room(bodies, floor), np.setdiff1d(_seeing(bodies, floor), without)
    if len(some) < 2:
        return None
    area = areas_of(solid.triangles[np.isin(solid.triangle_faces, some)]).sum()
    count = _CELLS if floor is None else _CELLS + _FLOOR_CELLS
    places, cell = Places.spread(solid, some, count * _PLACES), float(np.sqrt(area / count))
    rims = tuple(rim for rim in rims if np.isin(bodies.edge(rim.edges[0]).faces, some).any())
    if rims:
        places = places.beside(solid, some, _RIM_CELLS * _PLACES, *about(rims))
    scale = cell * (_RIM_SCALE if rims else 1.0)
    coordinates = _placed(places.points, places.normals, scale)
    of_patch = _PLACES if roughly else 1
    tree = KDTree(coordinates[of_patch // 2 :: of_patch])
    patches = tree.query(coordinates)[1] if roughly else np.arange(tree.n)
    return Exchange(solid, some, cell, scale, places, patches, tree, floor, roughly, rims)


def _seeing(bodies: Solid, floor: Floor | None) -> np.ndarray:
    """Faces of `room` that see another: those that are not on the convex hull, and before a floor those that do not
    look up, and the floor, but none that stands on it."""
    inner = ~bodies.outer
    if floor is None:
        return np.flatnonzero(inner)
    highest = np.full(len(bodies.faces), -np.inf)
    np.maximum.at(highest, bodies.triangle_faces, bodies.triangles[..., 2].max(1))
    standing = highest <= floor.height + LIFT * bodies.extent
    return np.append(np.flatnonzero((inner | (bodies.normals[:, 2] < _UP)) & ~standing), len(bodies.faces))


def _placed(points: np.ndarray, normals: np.ndarray, cell: float) -> np.ndarray:
    """Coordinates (n, 6) in which what is near belongs to one patch."""
    return np.concatenate([points / cell, _APART / np.sqrt(2) * normals], axis=-1)


@kept(most=2048)
def sheets(exchange: Exchange, faces: list[int]) -> Iterator[Sheet]:
    """Of faces, those of as many rays a node looked at together."""
    bare = [_bare(exchange, face) for face in faces]
    found: dict[int, Hits] = {}
    for many in dict.fromkeys(sheet.rays for sheet, *_ in bare):
        which = [k for k, (sheet, *_) in enumerate(bare) if sheet.rays == many]
        counts = [len(bare[k][1]) for k in which]
        nodes, normals, shifted = (np.concatenate([bare[k][i] for k in which]) for i in (1, 2, 3))
        met = exchange.met(nodes, normals, many, shifted)
        for k, start, count in zip(which, np.cumsum(counts) - counts, counts, strict=True):
            part = slice(*np.searchsorted(met.starts, [start, start + count]))
            found[k] = Hits(*(each[part].copy() for each in met._replace(starts=met.starts - start)))
    return (replace(sheet, met=found[k]) for k, (sheet, *_) in enumerate(bare))


def _bare(exchange: Exchange, number: int) -> tuple[Sheet, np.ndarray, np.ndarray, np.ndarray]:
    """A sheet with nothing met yet, its nodes, their normals (n, 3) and their rays' shifts (n, 2)."""
    if number < NOT_TOLD:
        return _nodes_around(exchange, exchange.wall(number))
    if number in exchange.annuli:
        return _nodes_beside(exchange, exchange.annuli[number])
    return _nodes(exchange, number)


def _apart(exchange: Exchange) -> float:
    """How far apart nodes are on a face, about."""
    return exchange.cell * np.sqrt(_CELLS / _NODES)


def _nodes(exchange: Exchange, face: int) -> tuple[Sheet, np.ndarray, np.ndarray, np.ndarray]:
    """The rectangle along a face's longest edge with nothing met yet, its nodes, their normals (n, 3) and their rays'
    shifts (n, 2); nodes that are not on the face see what the nearest place of it does.

    Those on its rim stand a little within, for in an inner edge light comes from both sides.
    """
    solid, facet = exchange.solid, not exchange.solid.plane[face]
    dense = exchange.finely and not facet and not exchange.roughly
    frame, cell = frame_of(solid, face), _apart(exchange) / (_DENSER if dense else 1)
    u, v = (along(*each, cell) for each in zip(frame.size, goes_on(solid, face, frame), strict=True))
    within = [_WITHIN * n[n > 0][0] for n in (u, v)]
    a, b = (np.clip(n, w, size - w) for n, w, size in zip((u, v), within, frame.size, strict=True))
    nodes = (frame.corner + a[:, None, None] * frame.sides[0] + b[:, None] * frame.sides[1]).reshape(-1, 3)
    nodes = onto(solid, face, nodes, min(within))
    rays = _FROM_SMALL if not facet and (frame.size < _apart(exchange)).any() else _FROM_DENSE if dense else _FROM_NODE
    rays = _ROUGH_NODE if exchange.roughly else rays
    shifted = shift_of(face + 1) if facet else np.zeros(2)  # what one facet is told wrongly the next ones are not
    shifted = shifts(len(nodes)) if dense else shifted  # and what one node is
    sheet = Sheet(frame, u, v, NOTHING_MET, rays)
    return sheet, nodes, np.broadcast_to(solid.normals[face], nodes.shape), np.broadcast_to(shifted, (len(nodes), 2))


def _nodes_beside(exchange: Exchange, annulus: Annulus) -> tuple[Sheet, np.ndarray, np.ndarray, np.ndarray]:
    """The same beside a rim, each node's rays shifted by themselves."""
    face, rings = annulus.circle.face, annulus.rings
    nodes = onto(exchange.solid, face, annulus.nodes(), _WITHIN * annulus.width)
    sheet = Sheet(annulus, np.arange(annulus.count), rings, NOTHING_MET, _FROM_RIM)
    return sheet, nodes, np.broadcast_to(exchange.solid.normals[face], nodes.shape), shifts(len(nodes))


def _nodes_around(exchange: Exchange, wall: Wall) -> tuple[Sheet, np.ndarray, np.ndarray, np.ndarray]:
    """The same of a curved surface, whose nodes have its own normals."""
    nodes, faces = wall.nodes()
    rays = _ROUGH_NODE if exchange.roughly else _FROM_WALL
    sheet = Sheet(wall, np.arange(wall.count), wall.rows, NOTHING_MET, rays)
    return sheet, nodes, normals_at(exchange.solid, faces, nodes), shifts(len(nodes))
