"""Values, limits and units of a STEP file's dimensions and zones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from scenes.parts.part21 import Part21, Reference, Typed, number_at, text_at

_PREFIXES = {"KILO": 1e3, "HECTO": 1e2, "DECA": 10.0, "DECI": 0.1, "CENTI": 1e-2, "MILLI": 1e-3, "MICRO": 1e-6,
             "NANO": 1e-9, None: 1.0}  # fmt: skip
_TO_UNIT = {"METRE": ("mm", 1000.0), "RADIAN": ("deg", 57.29577951308232)}
_NOTES = ("theoretical", "auxiliary")
_DEEPEST = 16  # units of units


@dataclass(frozen=True, eq=False)
class Values:
    """What a file says in numbers, mm and degrees."""

    part: Part21

    def of(self, number: int) -> tuple[float | None, float | None, float | None, str]:
        """Nominal value, how far above and below it a dimension may be, and the unit."""
        values, unit = {}, ""
        for item in self._items.get(number, ()):
            value, told = self.measure(item)
            if value is not None:
                named = self.part[item].of("REPRESENTATION_ITEM", "MEASURE_REPRESENTATION_ITEM") or ()
                name = text_at(named, 0).lower()
                values["upper" if "upper" in name else "lower" if "lower" in name else "nominal"] = value
                unit = unit or told
        nominal, upper, lower = (values.get(name) for name in ("nominal", "upper", "lower"))
        if upper is not None and lower is not None:
            nominal = (upper + lower) / 2 if nominal is None else nominal
            return nominal, upper - nominal, nominal - lower, unit
        plus, minus = self._limits.get(number, (None, None))
        return nominal, plus, minus, unit

    def note(self, number: int) -> str:
        """Of a dimension: an item of its representation by the name of ``dimensional note``."""
        told = (self.part[item].of("DESCRIPTIVE_REPRESENTATION_ITEM") or () for item in self._items.get(number, ()))
        notes = {text_at(each, 1).lower() for each in told if text_at(each, 0).lower() == "dimensional note"}
        return next((note for note in _NOTES if note in notes), "")

    @cached_property
    def _items(self) -> dict[int, tuple[int, ...]]:
        """Numbers of the items of a dimension's representation."""
        found: dict[int, tuple[int, ...]] = {}
        for number in self.part.numbers("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"):
            told = self.part[number].of("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION") or ()
            shown = self.part[number_at(told, 1) or 0].of("SHAPE_DIMENSION_REPRESENTATION", "REPRESENTATION") or ()
            items = shown[1] if len(shown) > 1 and isinstance(shown[1], tuple) else ()
            dimension = number_at(told, 0)
            if dimension is not None:
                found[dimension] = tuple(each for each in items if isinstance(each, Reference))
        return found

    @cached_property
    def _limits(self) -> dict[int, tuple[float, float]]:
        """How far above and below its value a dimension may be."""
        found = {}
        for dimension, told in self._plus_minus():
            ends = self.part[told].of("TOLERANCE_VALUE")
            if ends is not None:
                lower, upper = (self.measure(number_at(ends, k))[0] for k in (0, 1))
                if lower is not None and upper is not None:
                    found[dimension] = (upper, -lower)
        return found

    @cached_property
    def fits(self) -> dict[int, str]:
        """Fits of ISO 286 by dimension."""
        told = ((dimension, self.part[number].of("LIMITS_AND_FITS")) for dimension, number in self._plus_minus())
        return {dimension: f"{text_at(fit, 0)}{text_at(fit, 2)}" for dimension, fit in told if fit is not None}

    def _plus_minus(self) -> Iterator[tuple[int, int]]:
        """Dimension and what limits it."""
        for number in self.part.numbers("PLUS_MINUS_TOLERANCE"):
            told = self.part[number].of("PLUS_MINUS_TOLERANCE") or ()
            limit, dimension = number_at(told, 0), number_at(told, 1)
            if limit is not None and dimension is not None:
                yield dimension, limit

    def measure(self, number: int | None) -> tuple[float | None, str]:
        """A value in mm or degrees, and which."""
        here = self.part[number or 0]
        kinds = ("MEASURE_WITH_UNIT", "LENGTH_MEASURE_WITH_UNIT", "PLANE_ANGLE_MEASURE_WITH_UNIT",
                 "MEASURE_REPRESENTATION_ITEM")  # fmt: skip
        told = next((each for kind in kinds if (each := here.entities.get(kind))), ())
        value = next((each.value for each in told if isinstance(each, Typed)), None)
        unit = next((each for each in told if isinstance(each, Reference)), None)
        name, scale = self._unit(unit, 0)
        return (float(value) * scale if isinstance(value, int | float) else None), name

    def _unit(self, number: int | None, deep: int) -> tuple[str, float]:
        """mm or deg, and how many of them a unit is."""
        here = self.part[number or 0]
        si, converted = here.of("SI_UNIT"), here.of("CONVERSION_BASED_UNIT")
        if si is not None:
            prefix, name = (str(each) if each is not None else None for each in si[-2:])
            unit, scale = _TO_UNIT.get(name or "", ("", 1.0))
            return unit, scale * _PREFIXES.get(prefix, 1.0)
        if converted is not None and deep < _DEEPEST:
            told = self.part[number_at(converted, 1) or 0]
            measure = next((each for each in told.entities.values() if each), ())
            factor = next((each.value for each in measure if isinstance(each, Typed)), None)
            base = next((each for each in measure if isinstance(each, Reference)), None)
            unit, scale = self._unit(base, deep + 1)
            return unit, scale * (factor if isinstance(factor, int | float) else 1.0)
        return "", 1.0
