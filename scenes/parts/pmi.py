"""Dimensions, geometric tolerances and datums of a STEP AP242 file, and the faces that they are of.

Read from the file's text (ISO 10303-21), for what a kernel's reader makes of it loses magnitudes. Entities are those of
ISO 10303-47 (tolerances) and 10303-242: a dimension is of shape aspects, each of which has usages of faces or is
composed of others; its value stands in a representation, its limits beside it or in a tolerance of its own.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from scenes.parts.limits import General, general, of_fit
from scenes.parts.part21 import Instance, Part21, Reference, Typed
from scenes.units import Unit

_SIZES = ("DIMENSIONAL_SIZE", "ANGULAR_SIZE", "DIMENSIONAL_SIZE_WITH_PATH")
_LOCATIONS = ("DIMENSIONAL_LOCATION", "ANGULAR_LOCATION", "DIRECTED_DIMENSIONAL_LOCATION",
              "DIMENSIONAL_LOCATION_WITH_PATH")  # fmt: skip
_TOLERANCES = {
    "ANGULARITY_TOLERANCE": "angularity",
    "CIRCULAR_RUNOUT_TOLERANCE": "circular runout",
    "COAXIALITY_TOLERANCE": "coaxiality",
    "CONCENTRICITY_TOLERANCE": "concentricity",
    "CYLINDRICITY_TOLERANCE": "cylindricity",
    "FLATNESS_TOLERANCE": "flatness",
    "LINE_PROFILE_TOLERANCE": "profile of a line",
    "PARALLELISM_TOLERANCE": "parallelism",
    "PERPENDICULARITY_TOLERANCE": "perpendicularity",
    "POSITION_TOLERANCE": "position",
    "ROUNDNESS_TOLERANCE": "roundness",
    "STRAIGHTNESS_TOLERANCE": "straightness",
    "SURFACE_PROFILE_TOLERANCE": "profile of a surface",
    "SYMMETRY_TOLERANCE": "symmetry",
    "TOTAL_RUNOUT_TOLERANCE": "total runout",
}
_MODIFIERS = {"MAXIMUM_MATERIAL_REQUIREMENT": "M", "LEAST_MATERIAL_REQUIREMENT": "L", "RECIPROCITY_REQUIREMENT": "R",
              "FREE_STATE": "F", "TANGENT_PLANE": "T", "COMMON_ZONE": "CZ"}  # fmt: skip
_PREFIXES = {"KILO": 1e3, "HECTO": 1e2, "DECA": 10.0, "DECI": 0.1, "CENTI": 1e-2, "MILLI": 1e-3, "MICRO": 1e-6,
             "NANO": 1e-9, None: 1.0}  # fmt: skip
_TO_UNIT = {"METRE": ("mm", 1000.0), "RADIAN": ("deg", 57.29577951308232)}
_NOTES = ("theoretical", "auxiliary")
_FACES, _BOUNDS = ("ADVANCED_FACE", "FACE_SURFACE"), ("FACE_OUTER_BOUND", "FACE_BOUND")
_DEEPEST = 16  # aspects of aspects


@dataclass(frozen=True)
class Characteristic:
    """One dimension or geometric tolerance of a file.

    Attributes
    ----------
    number : int
        Of its instance in the file.
    kind : str
        ``diameter``, ``linear distance``, ``angle``, ... as the file says of a dimension; ``position``, ``flatness``,
        ... of a geometric tolerance.
    value : float or None
        Nominal value of a dimension in its unit; None of a tolerance, and where the file has only its presentation.
    plus, minus : float or None
        Limits of deviations, both positive where the value may lie on either side; None without limits.
    fit : str
        ``H7`` and the like (ISO 286), empty without; its limits are `plus` and `minus` where `limits.of_fit` has them.
    general : str
        The general tolerance that gives its limits, ``ISO 2768-m``; empty where they are its own, or it has none.
    note : str
        What the file says of a dimension that has no limits: ``theoretical``, exact, or ``auxiliary``, not to be
        inspected; empty where it says nothing.
    zone : float or None
        Width of a geometric tolerance's zone, or its diameter.
    is_round : bool
        Whether the zone is a cylinder or a circle.
    modifiers : tuple of str
        ``M``, ``L``, ... of a geometric tolerance.
    datums : tuple of str
        Its datum system: letters, in their order; ``A-B`` of a common datum.
    datum_modifiers : tuple of str
        ``M``, ``L``, ... of each of these datums; empty without.
    unit : str
        ``mm`` or ``deg``.
    faces : tuple of int
        Numbers of the instances of the faces that it is of; of a location those of its first feature. Of a dimension
        of edges the faces beside them.
    others : tuple of int
        Of a location those of its second feature.
    """

    number: int
    kind: str
    value: float | None = None
    plus: float | None = None
    minus: float | None = None
    fit: str = ""
    general: str = ""
    note: str = ""
    zone: float | None = None
    is_round: bool = False
    modifiers: tuple[str, ...] = ()
    datums: tuple[str, ...] = ()
    datum_modifiers: tuple[str, ...] = ()
    unit: Unit | str = "mm"
    faces: tuple[int, ...] = ()
    others: tuple[int, ...] = ()

    @property
    def is_tolerance(self) -> bool:
        """Whether it is a geometric tolerance, not a dimension."""
        return self.kind in _TOLERANCES.values()


@dataclass(frozen=True, eq=False)
class Pmi:
    """What a file says of its part's tolerances.

    Attributes
    ----------
    characteristics : tuple of Characteristic
        Dimensions, then geometric tolerances, each in the file's order.
    datums : dict of str to tuple of int
        Numbers of the faces of each datum, by letter.
    order : dict of int to int
        Place among all instances of the file, from 0, by number.
    general : str
        Class of the general tolerance that the file states (ISO 2768-1); empty where it states none.
    """

    characteristics: tuple[Characteristic, ...]
    datums: dict[str, tuple[int, ...]] = field(default_factory=dict)
    order: dict[int, int] = field(default_factory=dict)
    general: str = ""


def read(data: bytes) -> Pmi:
    """Of a file's bytes; without characteristics where it has none."""
    if not has_pmi(data):
        return Pmi(())
    file = _File(Part21.of(data))
    return Pmi(
        (*file.dimensions(), *file.tolerances()),
        file.datums(),
        {number: place for place, number in enumerate(file.part.order)},
        file.general(),
    )


def with_general(each: Characteristic, of_class: General) -> Characteristic:
    """With the limits of a general tolerance where it is a length that has none, and is not exact nor auxiliary."""
    if each.is_tolerance or each.value is None or each.plus is not None or each.note or each.unit != "mm":
        return each
    limit = general(each.value, of_class)
    return each if limit is None else replace(each, plus=limit, minus=limit, general=f"ISO 2768-{of_class}")


def has_pmi(data: bytes) -> bool:
    """Whether a file's text speaks of dimensions or tolerances at all."""
    return b"DIMENSIONAL_" in data or b"_TOLERANCE" in data or b"ANGULAR_" in data


@dataclass(frozen=True, eq=False)
class _File:
    """A file's entities, by what they refer to."""

    part: Part21

    def dimensions(self) -> Iterator[Characteristic]:
        for number in self.part.numbers(*_SIZES, *_LOCATIONS):
            here = self.part[number]
            first, second, name = self._measured(here)
            if first is None:
                continue
            value, plus, minus, unit = self._value(number)
            fit = self._fits.get(number, "")
            if fit and plus is None and value is not None:
                plus, minus = of_fit(value, fit) or (None, None)
            is_angle = here.of("ANGULAR_SIZE", "ANGULAR_LOCATION") is not None
            yield Characteristic(
                number, "angle" if is_angle else name or "dimension", value, plus, minus, fit, note=self._note(number),
                unit=unit or ("deg" if is_angle else "mm"), faces=self.faces(first) or self._beside(first),
                others=(self.faces(second) or self._beside(second)) if second is not None else (),
            )  # fmt: skip

    def _measured(self, here: Instance) -> tuple[int | None, int | None, str]:
        """The shape aspects that a dimension is of, the second of a location, and its name."""
        size = here.of(*_SIZES)
        if size is not None:
            return _number(size, 0), None, _text(size, 1)
        both = here.of("SHAPE_ASPECT_RELATIONSHIP") or here.of(*_LOCATIONS) or ()
        return _number(both, 2), _number(both, 3), _text(both, 0)

    def tolerances(self) -> Iterator[Characteristic]:
        for number in self.part.numbers(*_TOLERANCES):
            here = self.part[number]
            kind = next((kind for kind in _TOLERANCES if kind in here.entities), None)
            told = here.of("GEOMETRIC_TOLERANCE") or here.of(kind or "")
            if kind is None or not told:
                continue
            systems = here.of("GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE") or told[4:5]
            modifiers = (here.of("GEOMETRIC_TOLERANCE_WITH_MODIFIERS") or ((),))[0] or ()
            zone, unit = self._measure(_number(told, 2))
            datums = tuple(self._letters(systems[0] if systems else ()))
            yield Characteristic(
                number, _TOLERANCES[kind], zone=zone, unit=unit or "mm", is_round=number in self._round,
                modifiers=tuple(_MODIFIERS.get(each, str(each).lower()) for each in modifiers),
                datums=tuple(letter for letter, _ in datums), datum_modifiers=tuple(own for _, own in datums),
                faces=self.faces(_number(told, 3)),
            )  # fmt: skip

    def datums(self) -> dict[str, tuple[int, ...]]:
        """Faces of the features that a datum is established from."""
        found: dict[str, tuple[int, ...]] = {}
        for number in self.part.numbers("DATUM"):
            letter = _text(self.part[number].of("DATUM") or (), 4)
            features = [number, *self._owners[number]]
            faces = (face for feature in features for face in self.faces(feature))
            found[letter] = tuple(dict.fromkeys((*found.get(letter, ()), *faces)))
        return found

    def general(self) -> str:
        """Class of ISO 2768-1 of a representation of default tolerances: `m` of "m", "ISO 2768-mK"."""
        for number in self.part.numbers("DESCRIPTIVE_REPRESENTATION_ITEM"):
            told = self.part[number].of("DESCRIPTIVE_REPRESENTATION_ITEM") or ()
            if _text(told, 0).lower() == "tolerance class":
                named = re.fullmatch(r"(?:ISO ?2768-?)?([fmcv])[HKL]?", _text(told, 1))
                return named[1] if named else ""
        return ""

    def faces(self, aspect: int | None) -> tuple[int, ...]:
        """Numbers of the faces of a shape aspect, or of what a dimension is of."""
        return tuple(dict.fromkeys(self._faces(aspect, set(), 0)))

    def _faces(self, aspect: int | None, seen: set[int], deep: int) -> Iterator[int]:
        return (item for item in self._of_aspect(aspect, seen, deep) if self._is_face(item))

    def _beside(self, aspect: int | None) -> tuple[int, ...]:
        """Numbers of the faces beside the edges that a dimension is of."""
        edges = [item for item in self._of_aspect(aspect, set(), 0) if not self._is_face(item)]
        return tuple(dict.fromkeys(face for edge in edges for face in self._faces_at[edge]))

    def _of_aspect(self, aspect: int | None, seen: set[int], deep: int) -> Iterator[int]:
        """Numbers of the faces and edges of a shape aspect and its parts."""
        if aspect is None or aspect in seen or deep > _DEEPEST:
            return
        seen.add(aspect)
        yield from self._usages[aspect]
        for part in self._parts[aspect]:
            yield from self._of_aspect(part, seen, deep + 1)
        here = self.part[aspect]
        if here.of(*_SIZES) is not None:
            yield from self._of_aspect(self._measured(here)[0], seen, deep + 1)

    @cached_property
    def _faces_at(self) -> dict[int, list[int]]:
        """Numbers of the faces on both sides of each edge."""
        edge_of = {number: self._refers("ORIENTED_EDGE", number, 3) for number in self.part.numbers("ORIENTED_EDGE")}
        loops = {number: self._refers("EDGE_LOOP", number, 1) for number in self.part.numbers("EDGE_LOOP")}
        bounds = {number: self._refers(_BOUNDS, number, 1) for number in self.part.numbers(*_BOUNDS)}
        found: dict[int, list[int]] = defaultdict(list)
        for face in self.part.numbers(*_FACES):
            for bound in self._refers(_FACES, face, 1):
                for edge in (edge for loop in bounds.get(bound, ()) for used in loops.get(loop, ())
                             for edge in edge_of.get(used, ())):  # fmt: skip
                    found[edge].append(face)
        return found

    def _refers(self, kinds: str | tuple[str, ...], number: int, place: int) -> tuple[int, ...]:
        """The references that stand at one place of an instance's parameters."""
        told = self.part[number].of(*((kinds,) if isinstance(kinds, str) else kinds)) or ()
        items = told[place] if len(told) > place else ()
        return tuple(each for each in (items if isinstance(items, tuple) else (items,)) if isinstance(each, Reference))

    @cached_property
    def _usages(self) -> dict[int, list[int]]:
        """Numbers of faces and edges by shape aspect."""
        found: dict[int, list[int]] = defaultdict(list)
        kinds = ("GEOMETRIC_ITEM_SPECIFIC_USAGE", "ITEM_IDENTIFIED_REPRESENTATION_USAGE")
        for number in self.part.numbers(*kinds):
            told = self.part[number].of(*kinds) or ()
            aspect, items = _number(told, 2), told[4] if len(told) > 4 else ()
            if aspect is not None:
                items = items.value if isinstance(items, Typed) else items  # SET_REPRESENTATION_ITEM
                items = items if isinstance(items, tuple) else (items,)
                found[aspect] += [item for item in items if isinstance(item, Reference) and self._is_shown(item)]
        return found

    def _is_face(self, number: int) -> bool:
        return self.part.texts.get(number, "").lstrip().startswith(_FACES)

    def _is_shown(self, number: int) -> bool:
        return self._is_face(number) or self.part.texts.get(number, "").lstrip().startswith("EDGE_CURVE")

    @cached_property
    def _parts(self) -> dict[int, list[int]]:
        """Shape aspects that another is composed of."""
        found: dict[int, list[int]] = defaultdict(list)
        for one, other in self._related:
            if "DATUM" not in self.part[other].entities:  # a feature establishes a datum, and is not made of it
                found[one].append(other)
        return found

    @cached_property
    def _owners(self) -> dict[int, list[int]]:
        """Shape aspects that are related to another."""
        found: dict[int, list[int]] = defaultdict(list)
        for one, other in self._related:
            found[other].append(one)
        return found

    @cached_property
    def _related(self) -> list[tuple[int, int]]:
        kinds = ("SHAPE_ASPECT_RELATIONSHIP", "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP")
        found = [self.part[number] for number in self.part.numbers(*kinds)]
        told = [each.of(*kinds) or () for each in found if each.of(*_LOCATIONS) is None]  # a dimension joins nothing
        pairs = [(_number(each, 2), _number(each, 3)) for each in told]
        return [(one, other) for one, other in pairs if one is not None and other is not None]

    def _letters(self, systems: Any) -> Iterator[tuple[str, str]]:
        """Letters of a datum system, in its order, with their modifiers."""
        for each in systems if isinstance(systems, tuple) else (systems,):
            if isinstance(each, Reference):
                yield from self._letters_of(each, 0)

    def _letters_of(self, number: int, deep: int) -> Iterator[tuple[str, str]]:
        here = self.part[number]
        datum, system = here.of("DATUM", "COMMON_DATUM"), here.of("DATUM_SYSTEM")
        if datum is not None:
            yield _text(datum, 4), ""
        elif system is not None and deep < _DEEPEST:
            for each in system[4] if len(system) > 4 and isinstance(system[4], tuple) else ():
                yield from self._letters_of(each, deep + 1)
        elif (base := self._base(here)) is not None and deep < _DEEPEST:
            parts = base if isinstance(base, tuple) else (base,)
            found = [told for part in parts if isinstance(part, Reference)
                     for told in self._letters_of(part, deep + 1)]  # fmt: skip
            if found:
                told = dict.fromkeys([*(each for _, own in found for each in own), *self._modified(here)])
                yield "-".join(letter for letter, _ in found), " ".join(told)

    @staticmethod
    def _modified(here: Instance) -> tuple[str, ...]:
        """Modifiers of a datum's compartment: `M`, `L`, ..., those with a value left out."""
        compartment = here.of("DATUM_REFERENCE_COMPARTMENT", "DATUM_REFERENCE_ELEMENT", "GENERAL_DATUM_REFERENCE")
        given = compartment[5] if compartment is not None and len(compartment) > 5 else None
        words = (each.value if isinstance(each, Typed) else each for each in given if each) if given else ()
        return tuple(_MODIFIERS.get(str(word), str(word).lower()) for word in words if not isinstance(word, Reference))

    def _base(self, here: Instance) -> Any:
        """What a reference to a datum, or a compartment of a datum system, is of."""
        compartment = here.of("DATUM_REFERENCE_COMPARTMENT", "DATUM_REFERENCE_ELEMENT", "GENERAL_DATUM_REFERENCE")
        if compartment is not None and len(compartment) > 4:
            base = compartment[4]
            return base.value if isinstance(base, Typed) else base  # COMMON_DATUM_LIST
        old = here.of("DATUM_REFERENCE")
        return old[1] if old is not None and len(old) > 1 else None

    @cached_property
    def _round(self) -> set[int]:
        """Tolerances whose zone is a cylinder or a circle."""
        found: set[int] = set()
        for number in self.part.numbers("TOLERANCE_ZONE"):
            told = self.part[number].of("TOLERANCE_ZONE") or ()
            form = self.part[_number(told, 5) or 0].of("TOLERANCE_ZONE_FORM") or ()
            if _text(form, 0).lower().startswith(("cylindrical", "circular", "spherical")):
                found |= {each for each in told[4] if isinstance(each, Reference)} if len(told) > 4 else set()
        return found

    def _value(self, number: int) -> tuple[float | None, float | None, float | None, str]:
        """Nominal value, how far above and below it a dimension may be, and the unit."""
        values, unit = {}, ""
        for item in self._items.get(number, ()):
            value, told = self._measure(item)
            if value is not None:
                name = _text(self.part[item].of("REPRESENTATION_ITEM", "MEASURE_REPRESENTATION_ITEM") or (), 0).lower()
                values["upper" if "upper" in name else "lower" if "lower" in name else "nominal"] = value
                unit = unit or told
        nominal, upper, lower = (values.get(name) for name in ("nominal", "upper", "lower"))
        if upper is not None and lower is not None:
            nominal = (upper + lower) / 2 if nominal is None else nominal
            return nominal, upper - nominal, nominal - lower, unit
        plus, minus = self._limits.get(number, (None, None))
        return nominal, plus, minus, unit

    def _note(self, number: int) -> str:
        """Of a dimension: an item of its representation by the name of ``dimensional note``."""
        told = (self.part[item].of("DESCRIPTIVE_REPRESENTATION_ITEM") or () for item in self._items.get(number, ()))
        notes = {_text(each, 1).lower() for each in told if _text(each, 0).lower() == "dimensional note"}
        return next((note for note in _NOTES if note in notes), "")

    @cached_property
    def _items(self) -> dict[int, tuple[int, ...]]:
        """Numbers of the items of a dimension's representation."""
        found: dict[int, tuple[int, ...]] = {}
        for number in self.part.numbers("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"):
            told = self.part[number].of("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION") or ()
            shown = self.part[_number(told, 1) or 0].of("SHAPE_DIMENSION_REPRESENTATION", "REPRESENTATION") or ()
            items = shown[1] if len(shown) > 1 and isinstance(shown[1], tuple) else ()
            dimension = _number(told, 0)
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
                lower, upper = (self._measure(_number(ends, k))[0] for k in (0, 1))
                if lower is not None and upper is not None:
                    found[dimension] = (upper, -lower)
        return found

    @cached_property
    def _fits(self) -> dict[int, str]:
        """Fits of ISO 286 by dimension."""
        told = ((dimension, self.part[number].of("LIMITS_AND_FITS")) for dimension, number in self._plus_minus())
        return {dimension: f"{_text(fit, 0)}{_text(fit, 2)}" for dimension, fit in told if fit is not None}

    def _plus_minus(self) -> Iterator[tuple[int, int]]:
        """Dimension and what limits it."""
        for number in self.part.numbers("PLUS_MINUS_TOLERANCE"):
            told = self.part[number].of("PLUS_MINUS_TOLERANCE") or ()
            limit, dimension = _number(told, 0), _number(told, 1)
            if limit is not None and dimension is not None:
                yield dimension, limit

    def _measure(self, number: int | None) -> tuple[float | None, str]:
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
            told = self.part[_number(converted, 1) or 0]
            measure = next((each for each in told.entities.values() if each), ())
            factor = next((each.value for each in measure if isinstance(each, Typed)), None)
            base = next((each for each in measure if isinstance(each, Reference)), None)
            unit, scale = self._unit(base, deep + 1)
            return unit, scale * (factor if isinstance(factor, int | float) else 1.0)
        return "", 1.0


def _number(parameters: tuple[Any, ...], place: int) -> int | None:
    """A reference among parameters."""
    found = parameters[place] if len(parameters) > place else None
    return int(found) if isinstance(found, Reference) else None


def _text(parameters: tuple[Any, ...], place: int) -> str:
    found = parameters[place] if len(parameters) > place else None
    return found.strip() if isinstance(found, str) else ""
