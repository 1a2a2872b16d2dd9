"""The maximum material requirement of a part's file: with which of the file's sizes a zone grows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from scenes.measurands.drawn import Drawn
from scenes.measurands.features import Centre
from scenes.measurands.kinds import MEASURANDS
from scenes.measurands.material import material_of
from scenes.measurands.measurands import Measurand, quantities_of
from scenes.parts.solid import Solid

_M = "M"


def asks_for_material(asked: Iterable[Drawn]) -> frozenset[str]:
    """Names of measurands whose tolerance has the modifier M in the file, where their zone may grow."""
    some = (each.candidates for each in asked if _M in each.characteristic.modifiers)
    return frozenset(m.name for rows in some for row in rows for m in row if MEASURANDS[m.kind].takes_material)


def with_material(solid: Solid, measurands: Sequence[Measurand], asked: Iterable[Drawn]) -> tuple[Measurand, ...]:
    """The measurands, those whose tolerance has the modifier M with the diameter among them with which they grow.

    Of a bore or shaft alone; what has no diameter with limits among these stays as it is, at maximum material.
    """
    names, quantities = asks_for_material(asked), quantities_of(None, tuple(measurands))
    return tuple(_grown(solid, each, quantities) if each.name in names else each for each in measurands)


def _grown(solid: Solid, each: Measurand, quantities: tuple) -> Measurand:
    if not isinstance(each.features[0], Centre):
        return each
    for size in quantities:
        made = each.model_copy(update={"maximum_material": size.name})
        try:
            material_of(solid, each.name, made, quantities)
        except ValueError:  # no size, or that of another feature
            continue
        return made
    return each
