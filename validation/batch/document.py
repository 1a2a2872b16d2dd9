"""The document of ``ice validate --json``, whole or, since it may be larger than the memory, piece by piece."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from scenes.results import picked
from validation.batch.measurands import JudgedMeasurand
from validation.batch.rows import Row
from validation.strict_json import dumps, plain

if TYPE_CHECKING:
    from validation.batch.result import Validation

_LONG = ("settings", "refused")  # the lists that grow with the run


def document(found: Validation) -> dict[str, Any]:
    """All of it; numbers that are not finite become null."""
    lists = {name: list(items) for name, items in _lists(found).items()}
    return plain({name: lists.get(name, value) for name, value in _frame(found).items()})


def pieces(found: Validation, more: dict[str, Any] | None = None) -> Iterator[str]:
    """The same, and perhaps more keys, as JSON: each setting in one line, for there may be a million."""
    rest = dumps(_frame(found) | (more or {}))
    for name, items in _lists(found).items():
        before, empty, rest = rest.partition(f'\n "{name}": []')  # in a text its quotes would be escaped
        yield before + empty.removesuffix("[]")
        yield from _list(items)
    yield rest


def _list(items: Iterator[dict[str, Any]]) -> Iterator[str]:
    opening = "["
    for item in items:
        yield f"{opening}\n  " + dumps(item, indent=None)
        opening = ","
    yield "[]" if opening == "[" else "\n ]"


def _lists(found: Validation) -> dict[str, Iterator[dict[str, Any]]]:
    refused = ({"index": index, "reason": reason} for index, reason in found.refused.items())
    return dict(zip(_LONG, ((_row(row) for row in found.rows), refused), strict=True))


def _frame(found: Validation) -> dict[str, Any]:
    """Everything else, with the lists empty."""
    return {
        **picked(found, "scene", "seed", "variant", "machines", "paper_scale"),
        "settings": [],
        "refused": [],
        "paper_table_1": [
            {"scene": scene, "sensor": sensor, "light": light, "paper_ice": theirs, "paper": ours}
            for scene, sensor, light, theirs, ours in found.search
        ],
        "correlation": found.correlation,
        "verdict": found.verdict.text,
        "judgement": asdict(found.verdict),
        "classic_verdicts": {name: asdict(verdict) for name, verdict in found.classic_verdicts.items()},
        "seconds": found.seconds,
    }


def _row(row: Row) -> dict[str, Any]:
    main, texture = dict(vars(row.main)), {} if row.texture is None else {"texture": row.texture}
    return {
        **picked(row, "index", "scene", "parameters", "sensor", "light", "value_px", "paper_ice", "paper_real"),
        "predicted": {**picked(row, "paper", "calibrated"), "propagated": main.pop("propagated"), **texture},
        **main,
        "bound": row.bound,
        "classic": [vars(judged) for judged in row.classic],
        "measurands": [_measurand(each) for each in row.measurands],
    }


def _measurand(each: JudgedMeasurand) -> dict[str, Any]:
    """With ``texture`` only where there are textures."""
    return {key: value for key, value in vars(each).items() if key != "texture" or value is not None}
