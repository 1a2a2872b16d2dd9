"""The batch job: predicted against empirical, the run file, the tables and the pictures."""

from __future__ import annotations

import ice_vision

ice_vision.check(__file__, "scenes", "imaging", "planner", "render", "measure")

from importlib import import_module
from typing import Any

from scenes.results import DRAW

_HOMES = {
    "Campaign": "batch.campaign", "Grid": "batch.campaign", "run": "batch.job", "Judged": "batch.rows",
    "Row": "batch.rows", "Validation": "batch.result", "Stopped": "batch.stopped", "Verdict": "statistics",
    "ratio_interval": "statistics", "verdict": "statistics",
}  # fmt: skip

__all__ = list(_HOMES)


def _drawn(found: Any) -> str:
    return import_module("validation.report.notebook").drawn(found)


DRAW.append(_drawn)  # results show their pictures in notebooks, drawn when one asks for them

__getattr__, __dir__ = ice_vision.later(__name__, _HOMES)  # the command line answers before the renderer is there
