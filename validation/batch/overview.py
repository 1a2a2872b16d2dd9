"""What the tables of a run ask of all its settings, looked through once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from validation.batch.rows import Row


@dataclass(frozen=True)
class Overview:
    """Of the settings of a run.

    Attributes
    ----------
    images : int
        How many pictures of a setting were measured, the most of all.
    prints_predictions, prints_measurements : bool
        Whether the paper printed such numbers for some settings.
    has_several_scenes : bool
        Whether they are of more than one.
    swept : tuple of str
        Keys of scenes that a campaign gives values to that differ among them.
    methods : tuple of str
        All but the verdict's.
    farthest : tuple of Row
        The few that lie farthest from their prediction; of equal ones the first.
    first : tuple of Row
        The first of each scene and its methods.
    """

    images: int
    prints_predictions: bool
    prints_measurements: bool
    has_several_scenes: bool
    swept: tuple[str, ...]
    methods: tuple[str, ...]
    farthest: tuple[Row, ...]
    first: tuple[Row, ...]

    @classmethod
    def of(cls, rows: Sequence[Row], most: int) -> Overview:
        """``most``: how many lie farthest."""
        away, images, predicted, measured = np.zeros(len(rows)), 0, False, False
        texts: dict[str, set[str]] = {}
        first: dict[tuple[str, tuple[str, ...]], Row] = {}
        for number, row in enumerate(rows):
            away[number] = abs(math.log(row.main.ratio or 1.0))
            images = max(images, row.main.n)
            predicted, measured = predicted or bool(row.paper_ice), measured or bool(row.paper_real)
            for key, value in row.parameters.items():
                texts.setdefault(key, set()).add(str(value))
            first.setdefault((row.scene, tuple(each.method for each in row.classic)), row)
        return cls(
            images=images,
            prints_predictions=predicted,
            prints_measurements=measured,
            has_several_scenes=len({scene for scene, _ in first}) > 1,
            swept=tuple(key for key, several in texts.items() if len(several) > 1),
            methods=tuple(dict.fromkeys(method for _, methods in first for method in methods)),
            farthest=tuple(rows[number] for number in np.argsort(-away, kind="stable")[:most].tolist()),
            first=tuple(first.values()),
        )
