"""What a measurement expects to see: the required edges in the image, their neighbours, and the faces beside them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from skimage.measure import points_in_poly

from imaging.blurred.arrangement import Arrangement, arrangement_of, faces_beside, polygon_arrangement, spread
from imaging.features.projected_edges import corner_features, projected_edges, straight
from imaging.geometry.blur import signed_confusion
from imaging.geometry.projection import depth, facing, project_ideal
from imaging.geometry.visibility import boundaries
from imaging.light.appearance import face_signal, is_plain
from imaging.light.sheets import printed
from imaging.models.bias import cluttered
from imaging.models.strong import strong_pieces
from imaging.pictures import Pictures
from imaging.sensor import headroom
from measure.estimators.shading import Shading, face_shadings
from measure.features.levels import SceneLevels
from measure.features.looks import Looks
from measure.features.optics import Optics
from scenes import Edge, Picture, Scene, Solid

BACKGROUND = -1


@dataclass(frozen=True, eq=False)
class Layout:
    """Expected image of E edges.

    Attributes
    ----------
    names : tuple of str
    ends : ndarray, shape (E, 2, 2)
        End points (x, y) of each edge, ideal px; NaN where it is not in front of the sensor.
    visible : ndarray of bool, shape (E,)
    shown : ndarray, shape (E, 2)
        The piece of each edge that nothing hides, as fractions (from, to) of its length.
    corners : tuple of (int, int)
        Pairs of edges whose lines are intersected.
    joints : tuple of ((int, int), (int, int))
        (edge, end) pairs that meet in one vertex.
    beside : tuple
        For each edge and each of its ends the ways (k, 2), px, to the far ends of all other visible edges that start
        there.
    apart : tuple
        For each edge the segments (k, 2, 2) of the visible edges that share no end with it.
    others : ndarray, shape (k, 2, 2)
        Visible edges that are not among the E.
    faces : tuple of ndarray
        Visible faces as polygons (k, 2), the farthest first.
    sides : ndarray of int, shape (E, 2)
        Index of the face on the side the normal (-t_y, t_x) points to and on the other; BACKGROUND where there is none.
    shadings : tuple
        For each of the faces its `Shading`, or None where the light is not known, or only other faces send it any.
    optics : Optics
    defocus : ndarray, shape (E, 2)
        Signed radius of the circle of confusion at both ends of each edge, px; it changes linearly in between.
    arrangement : Arrangement, optional
        All that is seen around the edges; None where things hide or shade each other.
    clutter : ndarray of bool, shape (E,), optional
        Where the light is known, for which edges the planner predicts ``clutter`` of the classic locators.
    strong : ndarray, shape (E, 2), optional
        Where the light is known, the piece of each edge that stands out of the noise, as fractions of its length.
    looks : Looks, optional
        The levels that the scene shows, where the light is known and they may be others than faces' shadings say.
    levels : SceneLevels, optional
        Those beside each edge, where the light is known and things hide or light each other.
    """

    names: tuple[str, ...]
    ends: np.ndarray
    visible: np.ndarray
    shown: np.ndarray
    corners: tuple[tuple[int, int], ...]
    joints: tuple[tuple[tuple[int, int], tuple[int, int]], ...]
    beside: tuple[tuple[np.ndarray, np.ndarray], ...]
    apart: tuple[np.ndarray, ...]
    others: np.ndarray
    faces: tuple[np.ndarray, ...]
    sides: np.ndarray
    shadings: tuple[Shading | None, ...]
    optics: Optics
    defocus: np.ndarray
    arrangement: Arrangement | None = None
    clutter: np.ndarray | None = None
    strong: np.ndarray | None = None
    looks: Looks | None = None
    levels: SceneLevels | None = None

    def moved(self, shift: tuple[float, float], turn: float) -> Layout:
        """The layout turned by ``turn`` (rad, x towards y) about the middle of its edges and shifted (px)."""
        middle = self.ends.reshape(-1, 2).mean(0)
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])

        def move(points: np.ndarray) -> np.ndarray:
            return (points - middle) @ rotation.T + middle + np.asarray(shift)

        return replace(
            self,
            ends=move(self.ends),
            beside=tuple(tuple(away @ rotation.T for away in pair) for pair in self.beside),
            apart=tuple(move(segments) for segments in self.apart),
            others=move(self.others),
            faces=tuple(move(face) for face in self.faces),
            arrangement=self.arrangement and self.arrangement.moved(shift, turn, middle),
            looks=self.looks and self.looks.moved(rotation, move(np.zeros(2))),
        )

    def shifted(self, offsets: np.ndarray) -> Layout:
        """The layout with each edge's two ends moved along its normal by offsets (E, 2), px."""
        return replace(self, ends=self.ends + offsets[..., None] * self.normals[:, None])

    def only(self, edges: np.ndarray) -> tuple[Layout, np.ndarray]:
        """The layout of some of its edges that nothing hides, by their numbers, and numbers of the corners it keeps."""
        number = {int(e): k for k, e in enumerate(edges)}
        corners = np.array([c for c, pair in enumerate(self.corners) if set(pair) <= number.keys()], int)
        joints = [pair for pair in self.joints if {e for e, _ in pair} <= number.keys()]
        kept = replace(
            self,
            **{key: getattr(self, key)[edges] for key in ("ends", "visible", "shown", "sides", "defocus")},
            **{key: tuple(getattr(self, key)[e] for e in edges) for key in ("names", "beside", "apart")},
            corners=tuple(tuple(number[e] for e in self.corners[c]) for c in corners),
            joints=tuple(tuple((number[e], end) for e, end in pair) for pair in joints),
            clutter=None if self.clutter is None else self.clutter[edges],
            strong=None if self.strong is None else self.strong[edges],
            arrangement=self.arrangement and self.arrangement.only(edges, corners),
        )
        return kept, corners

    @property
    def directions(self) -> np.ndarray:
        """Unit direction of each edge, shape (E, 2)."""
        along = self.ends[:, 1] - self.ends[:, 0]
        return along / np.linalg.norm(along, axis=1, keepdims=True)

    @property
    def normals(self) -> np.ndarray:
        """Unit normal (-t_y, t_x) of each edge, shape (E, 2)."""
        directions = self.directions
        return np.stack([-directions[:, 1], directions[:, 0]], 1)

    def without_slivers(self, width: float) -> Layout:
        """The layout without faces that reach less than ``width`` px beyond an edge: too thin to show a level.

        What lies beyond them counts as background; that such an edge is crowded still shows in `apart`.
        """
        thin = set()
        for (start, _), normal, pair in zip(self.ends, self.normals, self.sides, strict=True):
            reach = [np.abs((self.faces[f] - start) @ normal).max() if f != BACKGROUND else np.inf for f in pair]
            thin |= {int(f) for f, far in zip(pair, reach, strict=True) if far < width}
        if not thin:
            return self
        edges = [(self.ends, normal) for normal in self.normals]

        def hugs(segment: np.ndarray) -> bool:
            return any(
                (np.abs((segment - ends[i, 0]) @ normal) < width).all() for i, (ends, normal) in enumerate(edges)
            )

        kept = [segment for segment in self.others if not hugs(segment)]
        outside = np.full((2, 2), -1e9)
        return replace(
            self,
            sides=np.where(np.isin(self.sides, list(thin)), BACKGROUND, self.sides),
            faces=tuple(outside if i in thin else face for i, face in enumerate(self.faces)),
            others=np.array(kept).reshape(-1, 2, 2),
            apart=tuple(np.array([s for s in a if not hugs(s)]).reshape(-1, 2, 2) for a in self.apart),
        )

    def shade(self, face: int, points: np.ndarray) -> np.ndarray:
        """Brightness of a face relative to its mean at places (..., 2), px; 1 where nothing is known."""
        shading = None if face == BACKGROUND else self.shadings[face]
        return np.ones(points.shape[:-1]) if shading is None else shading(points)

    def face_at(self, pixels: np.ndarray) -> np.ndarray:
        """Which face each of some pixels (flat indices, (P,)) belongs to, int, (P,)."""
        points = np.stack(np.divmod(pixels, self.optics.shape[1])[::-1], 1).astype(float)
        found = np.full(len(points), BACKGROUND)
        first, last = points.min(0, initial=np.inf), points.max(0, initial=-np.inf)
        for index, face in enumerate(self.faces):
            corners = self.optics.recorded(face)
            low, high = corners.min(0), corners.max(0)
            if (low > last).any() or (high < first).any():
                continue
            near = np.flatnonzero(((points >= low) & (points <= high)).all(1))
            if near.size:
                found[near[points_in_poly(points[near], corners)]] = index
        return found


def layout_of(picture: Picture) -> Layout:
    """The straight edges of a scene's quantities as a sensor pose projects them, in ideal image coordinates.

    With the lights known, the shading of each face is known too, and in a plain scene a face that is not lit is
    background.
    """
    pictures = Pictures.of(picture)
    return pictures.once("layout", lambda: _layout(picture, pictures))


def _layout(picture: Picture, pictures: Pictures) -> Layout:
    scene, solid, pose = picture.scene, picture.scene.bodies, np.array(list(picture.sensor))
    names = straight(scene)
    view = projected_edges(pictures, names)
    points = project_ideal(solid.vertices, pose, scene.camera)
    seen = facing(solid, pictures.viewpoint)
    wanted = picture.lights and names  # beside no edge nobody asks for it
    shadings = face_shadings(pictures) if wanted else [None] * len(solid.faces)
    turned = _boundaries(solid, seen)  # trimmed for whatever the light may be
    if any(shadings) and is_plain(scene):  # else other faces may light it, or it is dark before what is bright
        seen = seen & np.array([shading is not None for shading in shadings])
    required = [solid.edge(name) for name in view.names]
    shown = _boundaries(solid, seen)
    order = sorted(
        np.flatnonzero(seen), key=lambda f: -depth(solid.vertices[list(solid.faces[f])], pose, scene.camera).mean()
    )
    place = {int(f): i for i, f in enumerate(order)}
    faces = tuple(points[list(solid.faces[f])] for f in order)
    ends = np.array([points[list(edge.ends)] for edge in required]).reshape(-1, 2, 2)
    return Layout(
        names=view.names,
        ends=ends,
        visible=view.visible & np.isfinite(ends).all((1, 2)),
        shown=view.shown,
        corners=tuple(tuple(names.index(name) for name in corner.edges) for corner in corner_features(scene)),
        joints=_joints([edge.ends for edge in required]),
        beside=tuple(tuple(_away(points, edge, end, turned) for end in (0, 1)) for edge in required),
        apart=tuple(_segments(points, [e for e in shown if not set(e.ends) & set(edge.ends)]) for edge in required),
        others=_segments(points, [e for e in shown if e not in required]),
        faces=faces,
        sides=np.array([faces_beside(solid, edge, points, place, BACKGROUND) for edge in required], int).reshape(-1, 2),
        shadings=tuple(shadings[f] for f in order),
        optics=Optics.of(scene),
        defocus=_defocus(scene, pose, required),
        arrangement=arrangement_of(pictures) if is_plain(scene) else None,
        clutter=cluttered(pictures) if picture.lights else None,
        strong=strong_pieces(pictures, view) if picture.lights else None,
        looks=Looks.of(pictures) if picture.lights and _is_uneven(pictures, seen) else None,
        levels=SceneLevels(picture) if picture.lights and not is_plain(scene) else None,
    )


def _is_uneven(pictures: Pictures, seen: np.ndarray) -> bool:
    """Whether a level beside an edge may be another than its face's shading says: by what is seen behind, by what is
    printed, or by the end of the sensor's scale; ``seen``: the faces that are, (F,)."""
    scene, bodies = pictures.scene, pictures.scene.bodies
    if printed(scene) or not is_plain(scene):
        return True
    most = headroom(scene.noise)
    corners = ((face, spread(bodies.vertices[list(bodies.faces[face])])) for face in np.flatnonzero(seen).tolist())
    return any(face_signal(pictures, points, face, 1).max() > most for face, points in corners)


def polygon_layout(corners: np.ndarray, optics: Optics) -> Layout:
    """Layout of a convex polygon alone on a background, from its corners (k, 2), px, in order around it.

    Edge i runs from corner i to corner i + 1; corner i is where the edges i - 1 and i meet.
    """
    corners = np.asarray(corners, float)
    count = len(corners)
    ends = np.stack([corners, np.roll(corners, -1, 0)], 1)
    along = ends[:, 1] - ends[:, 0]
    indices = [(i, (i + 1) % count) for i in range(count)]
    x, y = corners.T
    clockwise = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) > 0  # as seen, with y down
    return Layout(
        names=tuple(f"s{i + 1}" for i in range(count)),
        ends=ends,
        visible=np.ones(count, bool),
        shown=np.tile([0.0, 1.0], (count, 1)),
        corners=tuple(((i - 1) % count, i) for i in range(count)),
        joints=_joints(indices),
        beside=tuple((-along[[(i - 1) % count]], along[[(i + 1) % count]]) for i in range(count)),
        apart=tuple(ends[[j for j in range(count) if not set(indices[i]) & set(indices[j])]] for i in range(count)),
        others=np.empty((0, 2, 2)),
        faces=(corners,),
        sides=np.tile([0, BACKGROUND] if clockwise else [BACKGROUND, 0], (count, 1)),
        shadings=(Shading.uniform(corners),),
        optics=optics,
        defocus=np.zeros((count, 2)),
        arrangement=polygon_arrangement(corners, optics.blur_px),
    )


def _boundaries(solid: Solid, seen: np.ndarray) -> list[Edge]:
    return [edge for edge, there in zip(solid.edges, boundaries(solid, solid.edges, seen), strict=True) if there]


def _defocus(scene: Scene, pose: np.ndarray, required) -> np.ndarray:
    """Signed radii of confusion at the edges' ends: they are linear in the image."""
    ends = np.array([list(edge.ends) for edge in required], int).reshape(-1, 2)
    return signed_confusion(scene.camera, depth(scene.solid.vertices, pose, scene.camera)[ends])


def _joints(ends: list[tuple[int, int]]) -> tuple:
    """Pairs of (edge, end) that share a vertex."""
    flat = [(vertex, (i, end)) for i, pair in enumerate(ends) for end, vertex in enumerate(pair)]
    return tuple((a, b) for k, (v, a) in enumerate(flat) for w, b in flat[k + 1 :] if v == w)


def _away(points: np.ndarray, edge, end: int, shown) -> np.ndarray:
    here = edge.ends[end]
    found = [points[e.ends[1 - e.ends.index(here)]] - points[here] for e in shown if e is not edge and here in e.ends]
    return np.array(found).reshape(-1, 2)


def _segments(points: np.ndarray, edges) -> np.ndarray:
    return np.array([points[list(edge.ends)] for edge in edges]).reshape(-1, 2, 2)
