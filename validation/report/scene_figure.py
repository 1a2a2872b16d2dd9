"""A scene's object with the names of its vertices, edges and circles."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

from imaging.geometry.projection import facing, project
from imaging.geometry.visibility import visible_spans
from planner import Pictures
from scenes import Circle, Edge, Pose, Scene
from validation.report.canvas import WIDTH, save

_PIECES = 9  # of an edge that a lens may bend
_HEIGHTS, _AROUND = (2.5, 8.0), 1.0  # inches: of the object, and of title and label around it
_LABEL = {"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.75}


def draw(scene: Scene, sensor: Pose, path: Path) -> Path:
    """Draw what the sensor sees of the object, its parts in colours by kind, with their names; a PNG file."""
    view = _View(scene, sensor)
    low, high = (f(view.image(scene.solid.vertices), axis=0) for f in (np.nanmin, np.nanmax))
    across, down = np.maximum(high - low, 1e-9)
    height = np.clip(0.85 * WIDTH * down / across, *_HEIGHTS)
    figure, axis = plt.subplots(figsize=(WIDTH, height + _AROUND), layout="constrained")
    _faces(axis, view)
    for edge in scene.solid.sharp:
        _edge(axis, view, edge)
    for circle in scene.solid.circles:
        _circle(axis, view, circle)
    for name in scene.solid.corner_names:
        _vertex(axis, view, name)
    camera, margin = scene.camera, 0.06 * max(across, down)
    axis.add_patch(plt.Rectangle((-0.5, -0.5), camera.width, camera.height, fill=False, ec="0.5", ls="--", lw=0.8))
    axis.set(xlim=(low[0] - margin, high[0] + margin), ylim=(high[1] + margin, low[1] - margin), aspect="equal")
    axis.set(xlabel="x, px", ylabel="y, px")
    axis.set_title(f"{scene.name} seen from {sensor}\nvertices (black), edges (blue), circles (red)", fontsize=11)
    return save(figure, path)


class _View:
    """A scene as one sensor sees it."""

    def __init__(self, scene: Scene, sensor: Pose) -> None:
        pictures = Pictures.of(scene, list(sensor))
        self.scene, self.pose, self.position = scene, pictures.sensors, pictures.sensor_at
        self._spans: dict[str, list[tuple[float, float]]] = {}

    def image(self, points: np.ndarray) -> np.ndarray:
        """Places of points (n, 3), px, shape (n, 2)."""
        return project(points, self.pose, self.scene.camera)

    def spans(self, edge: Edge) -> list[tuple[float, float]]:
        """The visible parts of an edge."""
        if edge.name not in self._spans:
            self._spans[edge.name] = visible_spans(self.scene.bodies, edge, self.position)
        return self._spans[edge.name]


def _faces(axis, view: _View) -> None:
    """Faces that are turned to the sensor, the farthest first, brighter where they face it."""
    solid = view.scene.solid
    shown, middles = facing(solid, view.position), solid.triangles.mean(1)
    corners = view.image(solid.triangles.reshape(-1, 3)).reshape(-1, 3, 2)
    away = view.position - middles
    far = np.linalg.norm(away, axis=1)
    cosines = np.abs(np.einsum("ti,ti->t", solid.normals[solid.triangle_faces], away)) / far
    order = np.argsort(-far, kind="stable")
    order = order[shown[solid.triangle_faces[order]]]
    greys = [str(grey) for grey in 0.55 + 0.37 * cosines[order]]
    axis.add_collection(PolyCollection(corners[order], facecolors=greys, edgecolors=greys, linewidths=0.5))


def _edge(axis, view: _View, edge: Edge) -> None:
    spans, solid = view.spans(edge), view.scene.solid
    start, stop = solid.vertices[list(edge.ends)]
    for span in spans:
        points = view.image(start + np.linspace(*span, _PIECES)[:, None] * (stop - start))
        axis.plot(*points.T, color="C0", lw=1.6, ls="-" if edge.convex else ":", solid_capstyle="round")
    if spans:
        middle = np.mean(max(spans, key=lambda span: span[1] - span[0]))
        _name(axis, view.image((start + middle * (stop - start))[None])[0], edge.name, "C0")


def _circle(axis, view: _View, circle: Circle) -> None:
    seen = [edge for edge in map(view.scene.solid.edge, circle.edges) if view.spans(edge)]
    if not seen:
        return
    ends = view.scene.solid.vertices[[edge.ends for edge in seen]]
    for piece in ends:
        axis.plot(*view.image(piece).T, color="C3", lw=1.6, solid_capstyle="round")
    places = view.image(ends.mean(1))
    _name(axis, places[places[:, 1].argmin()], circle.name, "C3")
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
            axis.annotate(name, place, xytext=(5, 6), textcoords="offset points", fontsize=9, fontweight="bold")
            return


def _name(axis, place: np.ndarray, text: str, colour: str) -> None:
    axis.text(*place, text, color=colour, fontsize=9, ha="center", va="center", bbox=_LABEL, clip_on=True)
