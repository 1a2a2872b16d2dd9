"""A scene's object with the names of its vertices, edges and circles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection

from imaging.geometry.projection import facing, project
from imaging.geometry.visibility import visible_spans
from planner import Pictures
from scenes import Board, Circle, Edge, Pose, Scene
from validation.report.canvas import WIDTH, plt, save

_PIECES = 9  # of an edge that a lens may bend
_HEIGHTS, _AROUND = (2.5, 8.0), 1.0  # inches: of the object, and of title and label around it
_ALONG = np.array([0.5, 0.35, 0.65, 0.2, 0.8])  # of an edge, where its name may stand
_CORNERS = tuple((x, y) for x in (12, -12) for y in (9, -9))  # points, beside a vertex
_POINTS, _WIDE = 9, 0.62  # of a name; width of a letter over its height
_LABEL = {"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.75}


def draw(scene: Scene, sensor: Pose, path: Path) -> Path:
    """Draw what the sensor sees of the object, its parts in colours by kind, with their names; a PNG file."""
    view = _View(scene, sensor)
    low, high = (f(view.image(corners(scene)), axis=0) for f in (np.nanmin, np.nanmax))
    across, down = np.maximum(high - low, 1e-9)
    height = np.clip(0.85 * WIDTH * down / across, *_HEIGHTS)
    figure, axis = plt.subplots(figsize=(WIDTH, height + _AROUND), layout="constrained")
    if scene.placement.board is not None:
        _board(axis, view, scene.placement.board)
    _faces(axis, view)
    for edge in scene.solid.sharp:
        _edge(axis, view, edge)
    for circle in scene.solid.rims:
        _circle(axis, view, circle)
    for name in scene.solid.corner_names:
        _vertex(axis, view, name)
    camera, margin = scene.camera, 0.06 * max(across, down)
    axis.add_patch(plt.Rectangle((-0.5, -0.5), camera.width, camera.height, fill=False, ec="0.5", ls="--", lw=0.8))
    axis.set(xlim=(low[0] - margin, high[0] + margin), ylim=(high[1] + margin, low[1] - margin), aspect="equal")
    axis.set(xlabel="x, px", ylabel="y, px")
    title = f"{scene.name} seen from {sensor}\nvertices (black), edges (blue), circles (red)"
    axis.set_title(title, fontsize=11)
    if crowded := _named(figure, axis, view.names):
        axis.set_title(f"{title}\n{crowded} names have no room: the table has all", fontsize=11)
    return save(figure, path)


@dataclass(frozen=True, eq=False)
class _Name:
    """A name beside what it names.

    Attributes
    ----------
    places : ndarray, shape (n, 2)
        Where it may stand, px in the image, the best first.
    text, colour : str
    size : float
        Of what it names, px: the largest are named first.
    beside : sequence of pair of float
        How far from a place its middle may be, points.
    """

    places: np.ndarray
    text: str
    colour: str
    size: float
    beside: Sequence[tuple[float, float]] = ((0.0, 0.0),)

    def boxes(self, axis) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Where it may be drawn, the figure's pixels: its middle, and its least and largest x, y, (2, 2)."""
        points = axis.figure.dpi / 72
        half = points * _POINTS * np.array([_WIDE * len(self.text), 1.2]) / 2
        for place, beside in product(self.places, self.beside):
            middle = axis.transData.transform(place) + points * np.array(beside)
            yield middle, np.stack([middle - half, middle + half])

    def draw(self, axis, middle: np.ndarray) -> None:
        at = axis.transData.inverted().transform(middle)
        axis.text(*at, self.text, color=self.colour, fontsize=_POINTS, ha="center", va="center", bbox=_LABEL,
                  clip_on=True)  # fmt: skip


def _named(figure, axis, names: list[_Name]) -> int:
    """Draw the names that have room, those of the largest things first; how many have none."""
    figure.draw_without_rendering()  # the layout is known then
    taken: list[np.ndarray] = []
    for name in sorted(names, key=lambda each: -round(each.size, 6)):
        for middle, box in name.boxes(axis):
            if not any((box[0] < other[1]).all() and (other[0] < box[1]).all() for other in taken):
                taken.append(box)
                name.draw(axis, middle)
                break
    return len(names) - len(taken)


class _View:
    """A scene as one sensor sees it."""

    def __init__(self, scene: Scene, sensor: Pose) -> None:
        pictures = Pictures.of(scene, list(sensor))
        self.scene, self.pose, self.viewpoint = scene, pictures.sensors, pictures.viewpoint
        self.sensor_at = pictures.sensor_at
        self._spans: dict[str, list[tuple[float, float]]] = {}
        self.names: list[_Name] = []

    def image(self, points: np.ndarray) -> np.ndarray:
        """Places of points (n, 3), px, shape (n, 2)."""
        return project(points, self.pose, self.scene.camera)

    def spans(self, edge: Edge) -> list[tuple[float, float]]:
        """The visible parts of an edge."""
        if edge.name not in self._spans:
            self._spans[edge.name] = visible_spans(self.scene.bodies, edge, self.viewpoint)
        return self._spans[edge.name]


def _faces(axis, view: _View) -> None:
    """Faces that are turned to the sensor, the farthest first, brighter where they face it."""
    solid = view.scene.solid
    shown, middles = facing(solid, view.viewpoint), solid.triangles.mean(1)
    corners = view.image(solid.triangles.reshape(-1, 3)).reshape(-1, 3, 2)
    away, far = view.viewpoint.towards(middles), np.linalg.norm(middles - view.sensor_at, axis=1)
    cosines = np.abs(np.einsum("ti,ti->t", solid.normals[solid.triangle_faces], away)) / np.linalg.norm(away, axis=1)
    order = np.argsort(-far, kind="stable")
    order = order[shown[solid.triangle_faces[order]]]
    greys = [str(grey) for grey in 0.55 + 0.37 * cosines[order]]
    axis.add_collection(PolyCollection(corners[order], facecolors=greys, edgecolors=greys, linewidths=0.5))


def corners(scene: Scene) -> np.ndarray:
    """Of part and board, (n, 3)."""
    board = scene.placement.board
    return scene.solid.vertices if board is None else np.concatenate([scene.solid.vertices, board.outline])


def _board(axis, view: _View, board: Board) -> None:
    """A board beside the part, where it is turned to the sensor."""
    if view.viewpoint.towards(board.points[:1])[0] @ board.axes[2] > 0:
        dark = board.dark_polygons
        corners = view.image(board.at(dark.reshape(-1, 2))).reshape(dark.shape)
        axis.add_collection(PolyCollection([view.image(board.outline)], facecolors="0.9", edgecolors="0.5"))
        along = np.diff(dark[:, :3], axis=1)
        bright = along[:, 0, 0] * along[:, 1, 1] < along[:, 0, 1] * along[:, 1, 0]  # clockwise: cells of a marker
        axis.add_collection(PolyCollection(corners, facecolors=np.where(bright, "0.9", "0.3").tolist()))


def _edge(axis, view: _View, edge: Edge) -> None:
    spans, solid = view.spans(edge), view.scene.solid
    start, stop = solid.vertices[list(edge.ends)]
    for span in spans:
        points = view.image(start + np.linspace(*span, _PIECES)[:, None] * (stop - start))
        axis.plot(*points.T, color="C0", lw=1.6, ls="-" if edge.convex else ":", solid_capstyle="round")
    if spans:
        ends = view.image(start + np.array(max(spans, key=lambda span: span[1] - span[0]))[:, None] * (stop - start))
        places = ends[0] + _ALONG[:, None] * (ends[1] - ends[0])
        view.names.append(_Name(places, edge.name, "C0", float(np.linalg.norm(ends[1] - ends[0]))))


def _circle(axis, view: _View, circle: Circle) -> None:
    seen = [edge for edge in map(view.scene.solid.edge, circle.edges) if view.spans(edge)]
    if not seen:
        return
    ends = view.scene.solid.vertices[[edge.ends for edge in seen]]
    for piece in ends:
        axis.plot(*view.image(piece).T, color="C3", lw=1.6, solid_capstyle="round")
    places = view.image(ends.mean(1))
    size = float(np.linalg.norm(np.ptp(places, axis=0)))
    spots = places[[places[:, 1].argmin(), places[:, 0].argmax(), places[:, 0].argmin(), places[:, 1].argmax()]]
    view.names.append(_Name(spots, circle.name, "C3", 2 * size))
    centre = view.image(circle.centre[None])[0]
    axis.plot(*centre, "+", color="C3", ms=7)


def _vertex(axis, view: _View, name: str) -> None:
    solid = view.scene.solid
    index = solid.vertex_names.index(name)
    for edge in solid.edges_at(name):
        ends = {0.0: edge.ends[0], 1.0: edge.ends[1]}
        if any(ends.get(at) == index for span in view.spans(edge) for at in span):
            place = view.image(solid.vertex(name)[None])[0]
            axis.plot(*place, "o", color="k", ms=4)
            longest = max(solid.length(each) for each in solid.edges_at(name)) / solid.extent
            view.names.append(_Name(place[None], name, "k", longest, _CORNERS))
            return
