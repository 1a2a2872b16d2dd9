"""Which entries of a catalogue a station can be made of, and what keeps the others from it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from planner.designing.dominance import of_lens, of_light, of_sensor, undominated
from planner.designing.evaluation import OWN_LIGHT
from scenes import InvalidInput
from scenes.cameras.pinhole import MOST_PIXELS
from scenes.catalogue import Catalogue, Entry, ListedSensor

CONTRADICTORY, INCOMPLETE, PRICELESS, COLOUR, LARGE, DOMINATED = (
    "contradictory", "incomplete", "no price", "colour filters", "too many pixels", "dominated",
)  # fmt: skip
_MOST_ASIDE = 16384  # columns or rows, of a scene's camera
_COMPARED = {"sensors": of_sensor, "lenses": of_lens, "lights": of_light}


def worthwhile(catalogue: Catalogue) -> tuple[dict[str, list[Any]], dict[str, Counter]]:
    """The `usable` entries that no other dominates; what is left out is counted with them.

    Raises
    ------
    InvalidInput
        If nothing of a table is left; the text says what left out how many.
    """
    kept, out = usable(catalogue)
    for table, compared in _COMPARED.items():
        left = undominated(kept[table], compared)
        out[table][DOMINATED] += len(kept[table]) - len(left)
        kept[table] = left
        if not left:
            told = ", ".join(f"{count} {why}" for why, count in out[table].items() if count) or "none given"
            raise InvalidInput(f"catalogue must have {table} that a station can be made of, got {told}")
    return kept, out


def usable(catalogue: Catalogue) -> tuple[dict[str, list[Any]], dict[str, Counter]]:
    """Entries of each table that a station can be made of, and how many are left out by what."""
    wrong = {each.entry for each in catalogue.contradictions()}
    kept: dict[str, list[Any]] = {}
    out: dict[str, Counter] = {}
    for table in ("sensors", "lenses", "lights"):
        kept[table], out[table] = [], Counter()
        for each in _offered(getattr(catalogue, table), wrong):
            why = _unusable(each, wrong, catalogue.priced)
            if why:
                out[table][why] += 1
            else:
                kept[table].append(each)
    return kept, out


def _offered(entries: tuple[Entry, ...], wrong: set[str]) -> Iterator[Entry]:
    """The entries of a table, with every mode of binning of those that can be used."""
    for each in entries:
        some = isinstance(each, ListedSensor) and not each.missing and each.told not in wrong
        yield from each.modes if some else (each,)


def _unusable(each: Entry, wrong: set[str], priced: bool) -> str:
    if each.told in wrong:
        return CONTRADICTORY
    if each.missing and each != OWN_LIGHT:
        return INCOMPLETE
    if priced and each.price is None and each != OWN_LIGHT:
        return PRICELESS
    if isinstance(each, ListedSensor) and (
        np.prod(each.resolution) > MOST_PIXELS or max(each.resolution) > _MOST_ASIDE
    ):
        return LARGE
    return COLOUR if isinstance(each, ListedSensor) and each.colour and each.filters is None else ""
