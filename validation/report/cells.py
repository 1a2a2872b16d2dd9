"""What the tables of plans share: their looks, and poses in their cells."""

from __future__ import annotations

from rich.table import Table

from scenes import Pose


def table(title: str, *columns: str) -> Table:
    """An empty table of numbers."""
    made = Table(title=title, title_justify="left", box=None, padding=(0, 1), title_style="bold")
    for name in columns:
        made.add_column(name, justify="right", no_wrap=True)
    return made


def pose(poses: Pose | tuple[Pose, ...]) -> str:
    """A pose, or several, to a tenth of a degree.

    >>> pose(Pose(15, 315)), pose(())
    ('(15.0, 315.0)', '-')
    """
    if not isinstance(poses, Pose):
        return " ".join(map(pose, poses)) or "-"
    return f"({poses.polar_deg:.1f}, {poses.azimuth_deg:.1f})"
