"""The pictures of a plan: maps, surfaces, and the object from the optimum."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from imaging.features.projected_edges import circles, projected_edges
from imaging.geometry.lens import recorded
from imaging.geometry.projection import facing, project
from imaging.geometry.visibility import visible_spans
from imaging.light.appearance import face_signal, is_separable
from imaging.light.backlight import backlights
from planner import Pictures, Plan, ViewingSpace, pose_map
from scenes import Picture, Pose
from validation.report.canvas import WIDTH, plt, save
from validation.report.map_figure import Chart, draw_map, draw_surface, short

_STEP = 2.0  # degrees, where a map takes some seconds; where it takes longer:
_COARSE = 4.0
_PIECES = 17  # of an edge as it is drawn: a lens may bend it


def draw(plan: Plan, directory: Path, maps: Path | None = None) -> list[Path]:
    """Write all pictures of a plan as PNG, and both maps in one file where one is named; their paths."""
    directory.mkdir(parents=True, exist_ok=True)
    paths, charts = [_seen(plan, directory / "optimum.png")], _charts(plan)
    for role, chart in charts.items():
        paths.append(_maps([chart], directory / f"map_{role}.png"))
        paths.append(_surface(chart, directory / f"surface_{role}.png"))
    return paths + ([_maps(list(charts.values()), maps)] if maps else [])


def map_picture(plan: Plan, path: Path) -> Path:
    """The search-space maps of a plan, one below the other, in one file."""
    return _maps(list(_charts(plan).values()), path)


def _charts(plan: Plan) -> dict[str, Chart]:
    """What there is a map of: the sensor, and the light where one is free."""
    roles = ("light", "sensor") if isinstance(plan.light, Pose) else ("sensor",)
    return {role: _chart(plan, role) for role in roles}


def _chart(plan: Plan, role: str) -> Chart:
    best = plan.light if role == "light" else plan.sensor
    fixed = {"sensor": plan.sensor} if role == "light" else {"light": plan.light}
    reach = 90 if best.polar_deg <= 90 else 180
    space = ViewingSpace(_STEP if is_separable(plan.scene) else _COARSE, (0, reach))
    biased = not circles(plan.scene)  # rims would take a minute
    found = pose_map(plan.scene, **fixed, space=space, model=plan.model, objective=plan.objective, biased=biased)
    return Chart(plan, found, biased, best, f"Where the {role} may stand{_held(plan, role)}")


def _held(plan: Plan, role: str) -> str:
    """What is held fixed meanwhile."""
    if role == "light":
        return f", sensor at {short(plan.sensor)}"
    return f", light at {short(plan.light)}" if plan.light else ""


def _maps(charts: list[Chart], path: Path) -> Path:
    figure = plt.figure(figsize=(WIDTH, 7.1 * len(charts)), layout="constrained")
    axes = figure.subplots(2 * len(charts), 1, height_ratios=[6, 1] * len(charts))
    for axis, below, chart in zip(axes[0::2], axes[1::2], charts, strict=True):
        draw_map(figure, axis, below, chart)
    return save(figure, path)


def _surface(chart: Chart, path: Path) -> Path:
    figure = plt.figure(figsize=(WIDTH, 4.6), layout="constrained")
    draw_surface(figure.add_subplot(projection="3d"), chart)
    return save(figure, path)


def _seen(plan: Plan, path: Path) -> Path:
    """The object from the optimal sensor."""
    figure, axis = plt.subplots(figsize=(WIDTH, 5.4), layout="constrained")
    draw_seen(axis, plan.scene, plan.sensor, plan.light, plan.prediction.corners)
    return save(figure, path)


def draw_seen(axis, scene, sensor, light, points) -> None:
    """Draw the object from a sensor: faces by brightness, required edges in colour, points (px) as rings."""
    pictures = Pictures.of(Picture.of(scene, sensor, light))
    solid, camera, pose, view = scene.solid, scene.camera, pictures.sensors, pictures.viewpoint
    axis.set_facecolor("0.95" if backlights(scene) else "0.05")
    shown, middles = facing(solid, view), solid.triangles.mean(1)
    levels = face_signal(pictures, middles, solid.triangle_faces, 1)
    brightest = max(levels.max(), np.finfo(float).tiny)
    corners = project(solid.triangles.reshape(-1, 3), pose, camera).reshape(-1, 3, 2)
    for k in np.argsort(-np.linalg.norm(middles - pictures.sensor_at, axis=1)):
        face = solid.triangle_faces[k]
        if shown[face]:
            grey = str(0.08 + 0.85 * levels[k] / brightest)
            axis.fill(*corners[k].T, color=grey, lw=0.8, ec=grey)
    for edge in (edge for edge in solid.edges if edge.kind != "smooth"):
        for span in visible_spans(scene.bodies, edge, view):
            _segment(axis, scene, pose, edge, span, color="0.5", lw=0.7)
    for i, name in enumerate(projected_edges(pictures).names):
        for span in visible_spans(scene.bodies, solid.edge(name), view):
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
    axis.set_title(f"{scene.name} from {short(sensor)}{_lit(light)}", fontsize=11)
    axis.legend(title="required", fontsize=10, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=4, frameon=False)


def _lit(light: Pose | tuple[Pose, ...]) -> str:
    return f", light at {short(light)}" if light else ""


def _segment(axis, scene, pose, edge, span, **style) -> None:
    start, stop = scene.solid.vertices[list(edge.ends)]
    points = project(start + np.linspace(*span, _PIECES)[:, None] * (stop - start), pose, scene.camera)
    axis.plot(*points.T, solid_capstyle="round", **style)


def _rim(axis, scene, pose, circle) -> None:
    edges = [scene.solid.edge(name) for name in circle.edges]
    for k, edge in enumerate(edges):
        _segment(axis, scene, pose, edge, (0, 1), color="C9", lw=2.5, label=circle.name if k == 0 else None)
