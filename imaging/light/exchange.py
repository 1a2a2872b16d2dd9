"""Light that faces send to each other, by radiosity: of an inner edge, a step, a pocket, an obstacle, the floor.

Faces on the convex hull of all bodies see no other, but the floor where they do not look up. What walls of round
through holes have from themselves has a closed form (`imaging.light.bore`), but others see them as they see all faces.
All that see others, however many, have places spread evenly over them, each of which stands for a patch: what is nearer
to it than to others and looks the same way, so that facets of a fillet share one. Where light is told roughly, a patch
is that of many places. Rays tell once for a solid which share of what a patch sees is each other one, and where they
end the lights' own light is asked for; the patches exchange light by it. What arrives on a face is gathered when it is
asked for, by rays from nodes of it: what they meet sends its share of the light that falls there, and of what its patch
has from the others.

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
from imaging.light.annulus import Annulus, about, measured_rims
from imaging.light.emitters import Emitter
from imaging.light.irradiance import beam
from imaging.light.kept import kept
from imaging.light.nodes import Frame, along, frame_of, goes_on, onto
from imaging.light.places import Places, areas_of, in_unit_square, middles_of, shift_of, shifts, ways_about
from imaging.light.walls import Wall, wall
from scenes import Circle, Floor, Scene, Solid
from scenes.parts.shading import normals_at
from scenes.parts.solid import assembled

if TYPE_CHECKING:
    from scipy.interpolate import RectBivariateSpline
    from scipy.sparse import csr_matrix
    from scipy.spatial import KDTree

_CELLS = 400  # of the whole body
_RIM_CELLS, _RIM_SCALE = 400, 0.5  # as many places more beside measured rims, and cells that count as one there
_PLACES, _RAYS = 15, 32  # of a cell, about, and from each of them; an odd number, or some are midway between two
_FROM_NODE, _FROM_SMALL = 1024, 256  # rays, the latter on a plane face that is narrower than a cell
_FROM_RIM = 4096  # of a node beside a measured rim
_FROM_WALL = 1024  # of a curved surface all of whose facets are told together
_FROM_PIECE = 32  # of a place that sends light on
_BOUNCES, _LEFT = 200, 1e-9  # at most, and part of the light that is left after the last one
_ROUGH_RAYS, _ROUGH_NODE = 8, 64  # of a place and of a node where the light is told roughly, by patches of a cell
_ROUGH_PATCHES = 4  # about a small face, whose light is then a mean of theirs
_REFLECTED = 128  # rays of a place that is asked what lit faces it sees
_NODES = 160  # of the whole body; nodes on a face that is asked for stand so dense
_WITHIN = 0.01  # of the first cell's half
_APART = 2.0  # cells: how far normals of 90 degrees keep places apart
_FLOOR = 1.0  # of the bodies' size: how far about them the floor has patches; beyond it is like the nearest of them
_FLOOR_CELLS = 400  # of it, besides those of the bodies
_UP = 1 - 1e-9  # cosine of a normal that sees no floor
_AT_ONCE = 200_000  # rays
_TOGETHER = 16  # faces
_NUMBER = np.int32  # of what rays meet there are millions, which are kept
_LIFT = 1e-6  # of the object's size: between a place and its own face
_MARGIN = 1e-6  # of the object's size: what passes an edge more closely is decided in double precision


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
        size, shifted = max(1, _AT_ONCE // rays), np.broadcast_to(shifted, (len(points), 2))
        parts = []
        for at in range(0, len(points), size):
            part = slice(at, at + size)
            found = self._met(points[part], normals[part], (in_unit_square(rays) + shifted[part, None]) % 1.0, but)
            parts.append(found._replace(starts=found.starts + at))
        return Hits(*map(np.concatenate, zip(*parts, strict=True)))

    def _met(self, points: np.ndarray, normals: np.ndarray, square: np.ndarray, but: tuple[int, ...]) -> Hits:
        ways = ways_about(normals, square)
        starts = np.broadcast_to((points + _LIFT * self.solid.extent * normals)[:, None], ways.shape)
        face, t = first_face(self.solid, starts, ways, (), margin=_MARGIN)
        if self.floor is not None:
            face, t = self._met_or_floor(face, t, starts, ways)
        sends = self.has.copy()
        sends[list(but)] = False
        point, ray = np.nonzero(sends[face])  # nothing met, -1, is the last
        face, t = face[point, ray], t[point, ray]
        places = starts[point, ray] + t[:, None] * ways[point, ray]
        coordinates = _placed(places, self.solid.normals[face], self.scale)
        point, ray, face, patch = (each.astype(_NUMBER) for each in (point, ray, face, self.tree.query(coordinates)[1]))
        return Hits(point, ray, places, face, patch)

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


@dataclass(frozen=True, eq=False)
class Exchanged:
    """Light that faces have from each other under given lights, irradiance in units of the signal of a white face.

    Attributes
    ----------
    scene : Scene
    emitters : tuple of Emitter
    exchange : Exchange
    arriving : ndarray, shape (p,)
        At the patches, from each other.
    """

    scene: Scene
    emitters: tuple[Emitter, ...]
    exchange: Exchange
    arriving: np.ndarray

    def at(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """What arrives at points (..., 3) on faces (...)."""
        found, small = np.zeros(faces.shape), self.exchange.small
        places = points.reshape(-1, 3)
        asked = list(self._asked(places, faces.ravel()))
        for told, (_, here, share) in zip(_told(self, [number for number, *_ in asked]), asked, strict=True):
            found.reshape(-1)[here] += share * told.at(places.take(here, 0))
        some = small[faces] & self.exchange.has[faces]
        if some.any():
            found[some] = self._by_patches[faces[some]]
        return found

    def _asked(self, points: np.ndarray, faces: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
        """Which annuli and faces tell the light at points (n, 3) on faces (n,): number, where, how much of it."""
        exchange, left = self.exchange, np.ones(len(points))
        for number, annulus in exchange.annuli.items():
            here = np.flatnonzero(faces == annulus.circle.face)
            share = np.minimum(annulus.share(points.take(here, 0)), left[here])
            here, share = here[share > 0], share[share > 0]
            left[here] -= share
            if here.size:
                yield number, here, share
        for face, here in _by_face(exchange.told_as(faces)):
            here = here[left[here] > 0]
            if here.size and face != NOT_TOLD:
                yield face, here, left[here]

    @cached_property
    def _by_patches(self) -> np.ndarray:
        """What arrives in the middles of all faces, (F,): a mean of what does at the patches about them."""
        solid, exchange = self.exchange.solid, self.exchange
        middles = middles_of(solid)
        away, near = exchange.tree.query(_placed(middles, solid.normals, exchange.scale), _ROUGH_PATCHES)
        weights = np.exp(-2 * (away**2 - away[:, :1] ** 2))
        return (weights * self.arriving[near]).sum(1) / weights.sum(1)

    def sent_at(self, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """What points (n, 3) within faces (n,) send on of what arrives there."""
        exchange, found, some = self.exchange, np.zeros(len(points)), np.flatnonzero(self.exchange.has[faces])
        shifted, size = shifts(len(some)), _AT_ONCE // _FROM_PIECE  # in blocks, which bounds the memory
        for at in range(0, len(some), size):
            here = some[at : at + size]
            normals = normals_at(exchange.solid, faces[here], points[here])
            met = exchange.met(points[here], normals, _FROM_PIECE, shifted[at : at + size])
            found[here] = _white(self.scene, faces[here]) * self.gathered(met, len(here), _FROM_PIECE)
        return found

    def gathered(self, met: Hits, count: int, rays: int | np.ndarray) -> np.ndarray:
        """What arrives at ``count`` points from what so many rays, int or (count,), from each of them met.

        Of several emitters each is asked for every so manieth ray.
        """
        direct = _direct(self.scene, self.emitters, self.exchange.solid, met)
        sent = _white(self.scene, met.faces) * (direct + self.arriving[met.patches])
        return np.bincount(met.starts, sent, count) / rays


def _by_face(faces: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """Each of the numbers (n,) and where it stands, in rising order."""
    order = np.argsort(faces, kind="stable")
    starts = np.flatnonzero(np.append(faces.size > 0, np.diff(faces[order])))
    for here in np.split(order, starts[1:]):
        if here.size:
            yield int(faces[here[0]]), here


@dataclass(frozen=True, eq=False)
class Told:
    """What arrives on a face, by places in the rectangle about it, or beside a rim."""

    frame: Frame | Annulus | Wall
    values: RectBivariateSpline

    def at(self, points: np.ndarray) -> np.ndarray:
        """At points (n, 3) of the face."""
        return self.values.ev(*self.frame.coordinates(points).T)


@kept(most=2048)
def _told(light: Exchanged, faces: list[int]) -> Iterator[Told]:
    """What arrives on faces."""
    for at in range(0, len(faces), _TOGETHER):
        sheets = _sheets(light.exchange, faces[at : at + _TOGETHER])
        counts = np.array([sheet.u.size * sheet.v.size for sheet in sheets])
        met = Hits(*map(np.concatenate, zip(*(sheet.met for sheet in sheets), strict=True)))
        first = np.repeat(np.cumsum(counts) - counts, [len(sheet.met.starts) for sheet in sheets])
        rays = np.repeat([sheet.rays for sheet in sheets], counts)
        values = light.gathered(met._replace(starts=met.starts + first), counts.sum(), rays)
        yield from map(_spline, sheets, np.split(values, np.cumsum(counts)[:-1]))


def _spline(sheet: Sheet, values: np.ndarray) -> Told:
    """Of values (n,) at the nodes of a face."""
    from scipy.interpolate import RectBivariateSpline  # slow to load, and rarely needed

    places, values = [sheet.u, sheet.v], values.reshape(sheet.u.size, sheet.v.size)
    if sheet.frame.closed:
        places[0], values = np.arange(-3, sheet.u.size + 3), np.pad(values, ((3, 3), (0, 0)), "wrap")
    for axis, (size, count) in enumerate(zip(sheet.frame.size, values.shape, strict=True)):
        if count == 1:
            places[axis], values = np.array([0.0, size]), np.repeat(values, 2, axis)
    along, across = (min(3, n - 1) for n in values.shape)
    return Told(sheet.frame, RectBivariateSpline(*places, values, kx=along, ky=across))


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
    standing = highest <= floor.height + _LIFT * bodies.extent
    return np.append(np.flatnonzero((inner | (bodies.normals[:, 2] < _UP)) & ~standing), len(bodies.faces))


def _placed(points: np.ndarray, normals: np.ndarray, cell: float) -> np.ndarray:
    """Coordinates (n, 6) in which what is near belongs to one patch."""
    return np.concatenate([points / cell, _APART / np.sqrt(2) * normals], axis=-1)


@kept(most=2048)
def _sheets(exchange: Exchange, faces: list[int]) -> Iterator[Sheet]:
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
    solid, cell = exchange.solid, _apart(exchange)
    frame, facet = frame_of(solid, face), not solid.plane[face]
    u, v = (along(*each, cell) for each in zip(frame.size, goes_on(solid, face, frame), strict=True))
    within = [_WITHIN * n[n > 0][0] for n in (u, v)]
    a, b = (np.clip(n, w, size - w) for n, w, size in zip((u, v), within, frame.size, strict=True))
    nodes = (frame.corner + a[:, None, None] * frame.sides[0] + b[:, None] * frame.sides[1]).reshape(-1, 3)
    nodes = onto(solid, face, nodes, min(within))
    rays = _FROM_SMALL if not facet and (frame.size < cell).any() else _FROM_NODE
    rays = _ROUGH_NODE if exchange.roughly else rays
    shift = shift_of(face + 1) if facet else np.zeros(2)  # what one facet is told wrongly the next ones are not
    sheet = Sheet(frame, u, v, NOTHING_MET, rays)
    return sheet, nodes, np.broadcast_to(solid.normals[face], nodes.shape), np.broadcast_to(shift, (len(nodes), 2))


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


@lru_cache(maxsize=8)
def exchanged(
    scene: Scene, emitters: tuple[Emitter, ...], roughly: bool = False, without: tuple[int, ...] = ()
) -> Exchanged | None:
    """What the faces of a scene's bodies and its floor send to each other under some emitters, some left out."""
    rims = () if roughly else measured_rims(scene)
    exchange = exchange_of(scene.bodies, scene.bright_floor, roughly, rims, without)
    if exchange is None:
        return None
    met = exchange.seen
    several = met._replace(rays=np.arange(len(met.rays)))  # of few rays from a place no emitter is asked for none
    lit = _white(scene, met.faces) * _direct(scene, emitters, exchange.solid, several)
    whites = exchange.of_patches(_white(scene, exchange.places.faces))
    once = exchange.of_patches(np.bincount(met.starts, lit, len(exchange.patches)) / exchange.rays)
    arriving = more = once
    for _ in range(_BOUNCES):
        more = exchange.between @ (whites * more)
        arriving = arriving + more
        if more.max() <= _LEFT * arriving.max():
            break
    return Exchanged(scene, emitters, exchange, arriving)


def once_reflected(
    scene: Scene, emitters: tuple[Emitter, ...], points: np.ndarray, normals: np.ndarray, own: tuple[int, ...]
) -> np.ndarray:
    """Irradiance of points (n, 3) of unit normals by light that met one other face of the bodies, (n,).

    Each sees others by other rays; facets ``own`` of the surface that the points lie on are none.
    """
    bodies = scene.bodies
    ways = ways_about(normals, (in_unit_square(_REFLECTED) + shifts(len(points))[:, None]) % 1.0)
    starts = np.broadcast_to((points + _LIFT * bodies.extent * normals)[:, None], ways.shape)
    face, t = first_face(bodies, starts, ways, own)
    point, ray = np.nonzero(face >= 0)
    met, faces = starts[point, ray] + t[point, ray, None] * ways[point, ray], face[point, ray]
    lit = sum(_arriving(scene, each, met, normals_at(bodies, faces, met)) for each in emitters)
    return np.bincount(point, _white(scene, faces) * lit, len(points)) / _REFLECTED


def _white(scene: Scene, faces: np.ndarray) -> np.ndarray:
    """Diffuse reflectance of faces (n,)."""
    white = np.array([material.diffuse() for material in scene.surfaces.materials])[scene.surfaces.kinds]
    return np.append(white, 0.0 if scene.floor is None else scene.floor.reflectance)[faces]


def _direct(scene: Scene, emitters: tuple[Emitter, ...], solid: Solid, met: Hits) -> np.ndarray:
    """Irradiance from emitters where rays end, (k,); of several each is asked for every so manieth ray."""
    found = np.zeros(len(met.points))
    for at in range(0, len(found), _AT_ONCE):  # in blocks, which bounds the memory
        part = slice(at, at + _AT_ONCE)
        found[part] = _direct_of_few(scene, emitters, solid, Hits(*(each[part] for each in met)))
    return found


def _direct_of_few(scene: Scene, emitters: tuple[Emitter, ...], solid: Solid, met: Hits) -> np.ndarray:
    found, several = np.zeros(len(met.points)), len(emitters)
    for k, emitter in enumerate(emitters):
        asked = met.rays % several == k
        normals = normals_at(solid, met.faces[asked], met.points[asked])
        found[asked] = several * _arriving(scene, emitter, met.points[asked], normals)
    return found


def _arriving(scene: Scene, emitter: Emitter, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Irradiance of points (n, 3) of unit normals by one emitter, 0 in shadow."""
    arriving = beam(emitter, points)
    found = arriving.strength * np.maximum(np.einsum("ni,ni->n", arriving.to_light, normals), 0)
    turned = np.flatnonzero(found)
    start, at = points[turned] + _LIFT * scene.bodies.extent * normals[turned], np.array(emitter.at)
    blocker, t = first_face(scene.bodies, np.broadcast_to(at, start.shape), start - at, (), margin=_MARGIN)
    found[turned[(blocker >= 0) & (t < 1)]] = 0.0
    return found
