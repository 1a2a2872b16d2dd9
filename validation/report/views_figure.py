"""The pictures of a plan with several: the object as each of them sees it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planner import Views
from validation.report.canvas import TEXT, WIDTH, plt, save
from validation.report.plan_figures import draw_seen


def draw(found: Views, directory: Path) -> list[Path]:
    """Write views.png: the largest set of pictures, each titled with what is taken from it; its path in a list."""
    directory.mkdir(parents=True, exist_ok=True)
    last, path = found.sets[-1], directory / "views.png"
    down = len(last.views)
    figure, axes = plt.subplots(down, 1, figsize=(WIDTH, 5.8 * down), layout="constrained", squeeze=False)
    for number, (axis, view) in enumerate(zip(axes.flat, last.views, strict=False)):
        draw_seen(axis, view.picture.scene, view.sensor, view.light, np.zeros((0, 2)))
        names = [q.name for q, used in zip(found.scene.quantities, last.combination.used[number], strict=True) if used]
        axis.set_title(f"no. {number + 1}: {axis.get_title()}\n{_wrapped(names)}", fontsize=TEXT)
    return [save(figure, path)]


def _wrapped(names: list[str], most: int = 56) -> str:
    """Names with commas between, on lines of limited length."""
    lines = [""]
    for name in names or ["nothing is taken from it"]:
        joined = f"{lines[-1]}, {name}" if lines[-1] else name
        lines = [*lines[:-1], joined] if len(joined) <= most else [*lines, name]
    return "\n".join(lines)
