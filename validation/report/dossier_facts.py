"""A dossier as JSON: all facts that its page shows, and all rows of which the page shows some."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from scenes.status import MEANINGS
from validation import budgets
from validation.dossier import Dossier
from validation.dossier.asked import ASKED
from validation.dossier.limits import LIMITS

_OF_A_DAY = ("seconds", "machines")  # of a run's document: what another run of the same has otherwise


def facts(found: Dossier) -> dict[str, Any]:
    """The document of ``ice dossier --json``; null is infinite or not known."""
    station, run = found.station, found.run.to_json()
    return {
        "scene": found.scene.name, "title": found.scene.title, "command": found.again, "seed": found.seed,
        **asdict(found.size), "holds": found.holds, "claims": [asdict(each) for each in found.claims],
        "versions": found.versions, "processor": found.processor,
        "inputs": [asdict(each) for each in found.files],
        "station": {"setting": station.number, "estimator": found.estimator, "sensor": list(station.picture.sensor),
                    "lights": [list(pose) for pose in station.picture.lights]},
        "budget": None if station.budget is None else budgets.facts(station.budget, [], None, None)["measurands"],
        "run": {key: value for key, value in run.items() if key not in _OF_A_DAY},
        "alarms": {"drawn": asdict(found.drawn), "blocks": asdict(found.blocks)},
        "controls": [asdict(each) | {"holds": each.holds} for each in found.controls],
        "coverage": {"by": found.chain, "measurands": [asdict(each) for each in found.coverage]},
        "hard": [{key: value for key, value in asdict(row).items() if key != "seconds"} for row in found.hard],
        "limits": [dict(zip(("about", "missing", "instead"), each, strict=True)) for each in LIMITS],
        "statuses": MEANINGS, "asked": [asdict(each) for each in ASKED],
    }  # fmt: skip
