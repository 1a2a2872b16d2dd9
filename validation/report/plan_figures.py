"""The pictures of a plan: the paper's maps (its Figs 9, 10, 12), surfaces (11, 13), and the object from the optimum."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from planner import Pictures, Plan, ViewingSpace, variance_map
from planner.features.projected_edges import circles, projected_edges
from planner.imaging.appearance import face_signal, is_separable
from planner.imaging.backlight import backlights
from planner.imaging.lens import recorded
from planner.imaging.projection import direction, facing, project
from planner.imaging.visibility import visible_spans
from scenes import Picture, Pose

_STEP = 1.0  # degrees, where a map takes a moment; where it takes longer:
_COARSE = 4.0
_PIECES = 17  # of an edge as it is drawn: a lens may bend it


def draw(plan: Plan, directory: Path) -> list[Path]:
    """Write all pictures of a plan as PNG; their paths."""
    directory.mkdir(parents=True, exist_ok=True)
    paths = [_seen(plan, directory / "optimum.png")]
    for role in _roles(plan):
        space, values = _map(plan, role)
        best = plan.light if role == "light" else plan.sensor
        title = f"Where the {role} may stand{_held(plan, role)}"
        paths.append(_search_space(plan, space, values, best, title, directory / f"map_{role}.png"))
        paths.append(_surface(plan, space, values, title, directory / f"surface_{role}.png"))
    return paths


def map_picture(plan: Plan, path: Path) -> Path:
    """The two search-space maps of a plan side by side in one file."""
    roles = _roles(plan)
    figure, axes = plt.subplots(1, len(roles), figsize=(5.5 * len(roles), 5.2), layout="constrained", squeeze=False)
    for axis, role in zip(axes[0], roles, strict=True):
        space, values = _map(plan, role)
        best = plan.light if role == "light" else plan.sensor
        _draw_map(figure, axis, plan, space, values, best, f"Where the {role} may stand{_held(plan, role)}")
    return _save(figure, path)


def _roles(plan: Plan) -> tuple[str, ...]:
    """What there is a map of: the sensor, and the light where one is free."""
    return ("light", "sensor") if isinstance(plan.light, Pose) else ("sensor",)


def _held(plan: Plan, role: str) -> str:
    """What is held fixed meanwhile."""
    if role == "light":
        return f", sensor at {_short(plan.sensor)}"
    return f", light at {_short(plan.light)}" if plan.light else ""


def _map(plan: Plan, role: str) -> tuple[ViewingSpace, np.ndarray]:
    space = ViewingSpace(_STEP if is_separable(plan.scene) else _COARSE, (0, 180))
    fixed = {"sensor": plan.sensor} if role == "light" else {"light": plan.light}
    return space, variance_map(plan.scene, **fixed, space=space, model=plan.model, objective=plan.objective)


def _search_space(plan, space, values, best, title, path: Path) -> Path:
    figure, axis = plt.subplots(figsize=(6, 5.6), layout="constrained")
    _draw_map(figure, axis, plan, space, values, best, title)
    return _save(figure, path)


def _draw_map(figure, axis, plan, space, values, best, title) -> None:
    """The hemisphere about the centre of gravity of what can be measured, projected to its equator.

    The lighter, the smaller the variance; dark blue where it cannot be measured.
    """
    frame = _frame(space, values)
    picture = np.sqrt(_pixels(frame, space, values, 700))
    finite = picture[np.isfinite(picture)]
    colours = plt.get_cmap("gray_r").with_extremes(bad=(0, 0, 0, 0))
    axis.add_patch(plt.Circle((0, 0), 1, color="#1b2a49", zorder=0))
    shown = axis.imshow(
        np.where(np.isfinite(picture), picture, np.nan), extent=(-1, 1, -1, 1), origin="lower", cmap=colours,
        vmin=finite.min(), vmax=np.percentile(finite, 90), interpolation="nearest",
    )  # fmt: skip
    for polar in (30, 60, 90):
        ring = frame @ direction(np.column_stack([np.full(361, polar), np.arange(361)])).T
        _line(axis, ring)
    for azimuth in range(0, 360, 45):
        _line(axis, frame @ direction(np.column_stack([np.linspace(0, 90, 91), np.full(91, azimuth)])).T, f"{azimuth}")
    spot = frame @ direction(np.array(list(best)))
    axis.plot(*spot[:2], "+", color="C3", ms=13, mew=2)
    axis.set(aspect="equal", xlim=(-1.08, 1.08), ylim=(-1.08, 1.08), xticks=[], yticks=[])
    axis.set_title(f"{title}\nbest at {_short(best)}; rings: polar angle 30, 60, 90, rays: azimuth", fontsize=9)
    axis.axis("off")
    first, several = plan.prediction.measurands[0], len(plan.prediction.measurands) > 1
    unit = "px" if plan.objective == "image" and first.unit != "degrees" else first.unit
    label = "worst sigma / tolerance" if several else f"standard deviation, {unit}"
    figure.colorbar(shown, ax=axis, shrink=0.8, label=label)


def _pixels(frame: np.ndarray, space: ViewingSpace, values: np.ndarray, size: int) -> np.ndarray:
    """The map on a square of pixels, NaN outside the hemisphere; each takes the nearest direction's value."""
    x, y = np.meshgrid(*[(np.arange(size) + 0.5) * 2 / size - 1] * 2)
    inside = x**2 + y**2 < 1
    spots = np.stack([x[inside], y[inside], np.sqrt(1 - x[inside] ** 2 - y[inside] ** 2)]).T @ frame
    picture = np.full((size, size), np.nan)
    picture[inside] = values[space.nearest_direction(spots)]
    return picture


def _frame(space: ViewingSpace, values: np.ndarray) -> np.ndarray:
    """Rows: right, up and towards the centre of gravity; the vertical passes through the sphere's north pole."""
    centre = space.directions[np.isfinite(values)].mean(0)
    centre /= np.linalg.norm(centre)
    pole = np.array([0.0, 0, 1]) if abs(centre[2]) < 1 - 1e-6 else np.array([0.0, 1, 0])
    up = pole - pole @ centre * centre
    up /= np.linalg.norm(up)
    return np.stack([np.cross(up, centre), up, centre])


def _line(axis, points: np.ndarray, label: str = "") -> None:
    x, y, up = points
    axis.plot(np.where(up >= 0, x, np.nan), np.where(up >= 0, y, np.nan), color="C0", lw=0.5, alpha=0.7)
    if label and up[-1] >= -0.05:
        axis.text(1.05 * x[-1], 1.05 * y[-1], label, fontsize=7, ha="center", va="center", color="C0")


def _surface(plan, space, values, title, path: Path) -> Path:
    """The map as a surface, upside down as in the paper, so that the optimum is the summit."""
    picture = _pixels(_frame(space, values), space, values, 161)
    height = np.nanmin(picture) / np.where(np.isnan(picture), np.inf, picture)
    x, y = np.meshgrid(*[np.linspace(-1, 1, 161)] * 2)
    figure = plt.figure(figsize=(7, 5), layout="constrained")
    axis = figure.add_subplot(projection="3d")
    axis.plot_surface(x, y, height, cmap="viridis", rcount=161, ccount=161, lw=0, antialiased=False)
    axis.view_init(elev=38)
    axis.set(zlabel="least variance / variance", xticks=[], yticks=[], zlim=(0, 1))
    axis.set_title(title, fontsize=9)
    return _save(figure, path)


def _seen(plan: Plan, path: Path) -> Path:
    """The object from the optimal sensor."""
    figure, axis = plt.subplots(figsize=(6.5, 6), layout="constrained")
    draw_seen(axis, plan.scene, plan.sensor, plan.light, plan.prediction.corners)
    return _save(figure, path)


def draw_seen(axis, scene, sensor, light, points) -> None:
    """Draw the object from a sensor: faces by brightness, required edges in colour, points (px) as rings."""
    pictures = Pictures.of(Picture.of(scene, sensor, light))
    solid, camera, pose, position = scene.solid, scene.camera, pictures.sensors, pictures.sensor_at
    axis.set_facecolor("0.95" if backlights(scene) else "0.05")
    shown = facing(solid, position)
    levels = face_signal(pictures, solid.triangles.mean(1), solid.triangle_faces, 1)
    brightest = max(levels.max(), np.finfo(float).tiny)
    corners = project(solid.triangles.reshape(-1, 3), pose, camera).reshape(-1, 3, 2)
    away = np.linalg.norm(solid.triangles.mean(1) - position, axis=1)
    for k in np.argsort(-away):
        face = solid.triangle_faces[k]
        if shown[face]:
            grey = str(0.08 + 0.85 * levels[k] / brightest)
            axis.fill(*corners[k].T, color=grey, lw=0.4, ec=grey)
    for edge in (edge for edge in solid.edges if edge.kind != "smooth"):
        for span in visible_spans(scene.bodies, edge, position):
            _segment(axis, scene, pose, edge, span, color="0.5", lw=0.7)
    view = projected_edges(pictures)
    for i, name in enumerate(view.names):
        for span in visible_spans(scene.bodies, solid.edge(name), position):
            _segment(axis, scene, pose, solid.edge(name), span, color=f"C{i % 10}", lw=2.5, label=name)
    for name in circles(scene):
        _rim(axis, scene, pose, solid.circle(name))
    axis.plot(*recorded(points, camera).T, "o", mfc="none", color="w", ms=11, mew=1.5)
    low, high = (f(project(solid.vertices, pose, camera), axis=0) for f in (np.min, np.max))
    axis.set(
        xlim=(low[0] - 12, high[0] + 12),
        ylim=(high[1] + 12, low[1] - 12),
        aspect="equal",
        xlabel="x, px",
        ylabel="y, px",
    )
    axis.set_title(f"{scene.name} from {_short(sensor)}, light at {_short(light)}", fontsize=10)
    axis.legend(title="required", fontsize=8, loc="upper right")


def _segment(axis, scene, pose, edge, span, **style) -> None:
    start, stop = scene.solid.vertices[list(edge.ends)]
    points = project(start + np.linspace(*span, _PIECES)[:, None] * (stop - start), pose, scene.camera)
    axis.plot(*points.T, solid_capstyle="round", **style)


def _rim(axis, scene, pose, circle) -> None:
    edges = [scene.solid.edge(name) for name in circle.edges]
    for k, edge in enumerate(edges):
        _segment(axis, scene, pose, edge, (0, 1), color="C9", lw=2.5, label=circle.name if k == 0 else None)


def _short(pose: Pose | tuple[Pose, ...]) -> str:
    if not isinstance(pose, Pose):
        return " ".join(map(_short, pose))
    return f"({pose.polar_deg:.0f}, {pose.azimuth_deg:.0f})"


def _save(figure, path: Path) -> Path:
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path
