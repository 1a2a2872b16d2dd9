"""The pictures of a validation: the paper's Figs 14-21, and predicted against measured."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np

import render
from measure.features.layout import layout_of
from measure.features.shape import prepared
from render.renderer import window
from scenes import Picture, Pose, Scene, pairs, shown
from validation.batch.campaign import Campaign, Case
from validation.batch.result import Validation
from validation.batch.store import RunFile
from validation.report.canvas import TEXT, WIDTH, legend_below, plt, save

_SHOWN = 16  # settings whose images are drawn
_POINTS = 5000  # of a plot of settings


def draw(campaign: Campaign, found: Validation, store: RunFile, directory: Path) -> list[Path]:
    """Write all pictures of a run as PNG; their paths."""
    directory.mkdir(parents=True, exist_ok=True)
    paths = [_agreement(found, directory / "predicted_measured.png")]
    for stem, cases in _panels(campaign, store).items():
        pictures = [(case, _noisy(case, store, found.seed)) for case in cases]
        sensor, lights = cases[0].setting.sensor, [case.setting.light for case in cases]
        shown = [_covered(*pair) for pair in pictures]
        paths.append(_panel(shown, sensor, lights, "images", (0, 255), directory / f"{stem}_images.png"))
        edges = [_covered(case, ~edge_pixels(case.scene, sensor, picture)) for case, picture in pictures]
        paths.append(_panel(edges, sensor, lights, "edge pixels of canny", (0, 1), directory / f"{stem}_edges.png"))
    return paths


def _panels(campaign: Campaign, store: RunFile) -> dict[str, list[Case]]:
    """The first settings that have an image, by sensor and scene, as pictures' names."""
    panels: dict[tuple, list[Case]] = {}
    shown = (i for i in range(min(len(campaign), 4 * _SHOWN)) if store.has_image(i))
    for case in map(campaign.case, itertools.islice(shown, _SHOWN)):
        panels.setdefault((case.scene.name, case.setting.sensor, repr(case.parameters)), []).append(case)
    named: dict[str, list[Case]] = {}
    for cases in panels.values():
        stem = _stem(cases[0], len(campaign.scenes) > 1)
        several = sum(known.split("__")[0] == stem for known in named)
        named[f"{stem}__{several + 1}" if several else stem] = cases
    return named


def _stem(case: Case, with_scene: bool) -> str:
    """A file's name: the sensor, and what else tells its settings apart; of texts only what is safe in a name."""
    sensor = case.setting.sensor
    values = [v for value in case.parameters.values() for v in (value if isinstance(value, list | tuple) else [value])]
    labels = [case.scene.name] * with_scene + [_label(value) for value in values]
    return "_".join([f"sensor_{sensor.polar_deg:g}_{sensor.azimuth_deg:g}", *labels])


def _label(value: object) -> str:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{value:g}" if number else re.sub(r"[^A-Za-z0-9.-]+", "-", str(value))[:20].strip("-.")


def _noisy(case: Case, store: RunFile, seed: int) -> np.ndarray:
    """One exposure of a setting; of photographs their mean."""
    if store.identity().get("photos"):
        return store.image(case.index)
    rng = np.random.default_rng([seed, case.index])
    return render.expose(store.image(case.index), case.scene.noise, rng, 1)[0]


def _covered(case: Case, picture: np.ndarray) -> np.ndarray:
    """The part of a picture that the object covers."""
    rows, columns = window(case.picture)
    return picture[max(rows.start - 8, 0) : rows.stop + 8, max(columns.start - 8, 0) : columns.stop + 8]


def edge_pixels(scene: Scene, sensor: Pose, picture: np.ndarray) -> np.ndarray:
    """The pixels, bool, from which the estimator ``canny`` makes its edge points at the scene's first threshold."""
    layout, found = layout_of(Picture.of(scene, sensor)), np.zeros(picture.shape, bool)
    if not layout.names:
        return found
    tool = prepared(layout, "canny", scene.locator.thresholds[0])
    for part in tool.parts:  # ty: ignore[missing-attribute]
        if part:
            found[tuple(part.locator.edge_pixels(picture).T)] = True
    return found


def _panel(pictures, sensor: Pose, lights: list[Pose], kind: str, grey: tuple[float, float], path: Path) -> Path:
    columns = 2 if len(pictures) > 1 else 1
    rows = -(-len(pictures) // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(WIDTH, 0.5 + 0.98 * WIDTH / columns * rows), squeeze=False, layout="constrained"
    )
    figure.suptitle(f"sensor {sensor}: {kind}")
    for axis in axes.flat:
        axis.set(xticks=[], yticks=[])
    for axis, picture, light in zip(axes.flat, pictures, lights, strict=False):
        axis.imshow(picture, cmap="gray", vmin=grey[0], vmax=grey[1], interpolation="nearest")
        axis.set_title(f"light {shown(pairs(light))}", fontsize=TEXT)
    return save(figure, path)


def _agreement(found: Validation, path: Path) -> Path:
    """Measured against predicted variance with 95 % intervals, and their ratio below."""
    every = np.unique(np.linspace(0, len(found.rows) - 1, _POINTS).astype(int))
    rows = [row for row in (found.rows[int(i)] for i in every) if row.main.ratio]
    which = "" if every.size == len(found.rows) else f" ({every.size} of {len(found.rows)} settings)"
    figure, (top, bottom) = plt.subplots(
        2, 1, figsize=(WIDTH, 7.2), sharex=True, height_ratios=[3, 1.4], layout="constrained"
    )
    propagated = np.array([row.main.propagated for row in rows])
    ratio = np.array([row.main.ratio for row in rows])
    spread = np.abs(np.array([row.main.ratio_interval for row in rows]).T - ratio) if rows else np.zeros((2, 0))
    calibrated = np.array([row.calibrated for row in rows])
    top.errorbar(
        propagated,
        ratio * propagated,
        spread * propagated,
        fmt="o",
        color="C0",
        ms=5,
        label="propagated (one clean render)",
    )
    top.plot(calibrated, ratio * propagated, "x", color="C1", label="calibrated (no image)")
    top.plot([row.bound for row in rows], ratio * propagated, "|", color="0.5", ms=9, label="Cramer-Rao bound")
    if rows:
        limits = np.array([0.9 * min(row.bound for row in rows), 1.2 * propagated.max()])
        top.plot(limits, limits, "k-", lw=0.8, label="predicted = measured")
        top.set(xscale="log", yscale="log")
    else:
        top.text(0.5, 0.5, "no setting was measured", ha="center", transform=top.transAxes)
    top.set_ylabel("measured variance, px²")
    top.set_title(f"{found.scene}: variance of the distance{which}", fontsize=11)
    legend_below(top)
    bottom.errorbar(propagated, ratio, spread, fmt="o", color="C0", ms=5)
    bottom.plot(calibrated, ratio * propagated / np.where(calibrated > 0, calibrated, 1), "x", color="C1")
    bottom.axhline(1, color="k", lw=0.8)
    bottom.set(xlabel="predicted variance, px²", ylabel="measured / predicted")
    return save(figure, path)
