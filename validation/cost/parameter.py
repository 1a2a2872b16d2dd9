"""What turning one parameter shows: a table, and slopes on logarithmic axes beside what theory says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Trend:
    """Slope of one column against another, both logarithmic; ``theory`` is None where there is none."""

    what: str
    slope: float
    theory: float | None


@dataclass(frozen=True)
class Parameter:
    """One parameter.

    Attributes
    ----------
    name, title : str
    columns : tuple of str
    rows : tuple of tuple
        Text, or numbers.
    x, y : str
        Columns to plot against each other.
    series : str
        Column that tells several curves apart; empty if there is one.
    fits : tuple of Trend
    note : str
        What explains a slope that is not theory's.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple, ...]
    x: str
    y: str
    series: str = ""
    fits: tuple[Trend, ...] = ()
    note: str = ""

    def column(self, name: str) -> list:
        place = self.columns.index(name)
        return [row[place] for row in self.rows]

    def curves(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Plotted points by series, those that can be drawn on logarithmic axes."""
        labels = self.column(self.series) if self.series else [""] * len(self.rows)
        found: dict[str, tuple[list, list]] = {}
        for label, x, y in zip(labels, self.column(self.x), self.column(self.y), strict=True):
            if x > 0 and y > 0:
                points = found.setdefault(str(label), ([], []))
                points[0].append(x)
                points[1].append(y)
        return {label: (np.array(x), np.array(y)) for label, (x, y) in found.items()}

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


def slope(x: Sequence[float], y: Sequence[float], weights: Sequence[float] | None = None) -> float:
    """Slope of log y against log x; ``weights`` are 1 / sigma of log y.

    Examples
    --------
    >>> round(slope([1, 10, 100], [5, 0.5, 0.05]), 6)
    -1.0
    """
    return float(np.polyfit(np.log(x), np.log(y), 1, w=weights)[0])
