"""Dimensions, geometric tolerances and datums of a STEP AP242 file, and the faces that they are of.

Read from the file's text (ISO 10303-21), for what a kernel's reader makes of it loses magnitudes. Entities are those of
ISO 10303-47 (tolerances) and 10303-242: a dimension is of shape aspects, each of which has usages of faces or is
composed of others; its value stands in a representation, its limits beside it or in a tolerance of its own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from scenes.parts.limits import General, general, of_fit
from scenes.parts.part21 import Instance, Part21, Reference, Typed, number_at, text_at
from scenes.parts.pmi_aspects import LOCATIONS, SIZES, Aspects
from scenes.parts.pmi_values import Values
from scenes.units import Unit

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
_DEEPEST = 16  # datums of datums


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

    @cached_property
    def aspects(self) -> Aspects:
        return Aspects(self.part)

    @cached_property
    def values(self) -> Values:
        return Values(self.part)

    def dimensions(self) -> Iterator[Characteristic]:
        for number in self.part.numbers(*SIZES, *LOCATIONS):
            here = self.part[number]
            first, second, name = self._measured(here)
            if first is None:
                continue
            value, plus, minus, unit = self.values.of(number)
            fit = self.values.fits.get(number, "")
            if fit and plus is None and value is not None:
                plus, minus = of_fit(value, fit) or (None, None)
            is_angle = here.of("ANGULAR_SIZE", "ANGULAR_LOCATION") is not None
            yield Characteristic(
                number, "angle" if is_angle else name or "dimension", value, plus, minus, fit,
                note=self.values.note(number), unit=unit or ("deg" if is_angle else "mm"),
                faces=self.aspects.shown(first), others=self.aspects.shown(second),
            )  # fmt: skip

    def _measured(self, here: Instance) -> tuple[int | None, int | None, str]:
        """The shape aspects that a dimension is of, the second of a location, and its name."""
        size = here.of(*SIZES)
        if size is not None:
            return number_at(size, 0), None, text_at(size, 1)
        both = here.of("SHAPE_ASPECT_RELATIONSHIP") or here.of(*LOCATIONS) or ()
        return number_at(both, 2), number_at(both, 3), text_at(both, 0)

    def tolerances(self) -> Iterator[Characteristic]:
        for number in self.part.numbers(*_TOLERANCES):
            here = self.part[number]
            kind = next((kind for kind in _TOLERANCES if kind in here.entities), None)
            told = here.of("GEOMETRIC_TOLERANCE") or here.of(kind or "")
            if kind is None or not told:
                continue
            systems = here.of("GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE") or told[4:5]
            modifiers = (here.of("GEOMETRIC_TOLERANCE_WITH_MODIFIERS") or ((),))[0] or ()
            zone, unit = self.values.measure(number_at(told, 2))
            datums = tuple(self._letters(systems[0] if systems else ()))
            yield Characteristic(
                number, _TOLERANCES[kind], zone=zone, unit=unit or "mm", is_round=number in self._round,
                modifiers=tuple(_MODIFIERS.get(each, str(each).lower()) for each in modifiers),
                datums=tuple(letter for letter, _ in datums), datum_modifiers=tuple(own for _, own in datums),
                faces=self.aspects.faces(number_at(told, 3)),
            )  # fmt: skip

    def datums(self) -> dict[str, tuple[int, ...]]:
        """Faces of the features that a datum is established from."""
        found: dict[str, tuple[int, ...]] = {}
        for number in self.part.numbers("DATUM"):
            letter = text_at(self.part[number].of("DATUM") or (), 4)
            features = [number, *self.aspects.owners[number]]
            faces = (face for feature in features for face in self.aspects.faces(feature))
            found[letter] = tuple(dict.fromkeys((*found.get(letter, ()), *faces)))
        return found

    def general(self) -> str:
        """Class of ISO 2768-1 of a representation of default tolerances: `m` of "m", "ISO 2768-mK"."""
        for number in self.part.numbers("DESCRIPTIVE_REPRESENTATION_ITEM"):
            told = self.part[number].of("DESCRIPTIVE_REPRESENTATION_ITEM") or ()
            if text_at(told, 0).lower() == "tolerance class":
                named = re.fullmatch(r"(?:ISO ?2768-?)?([fmcv])[HKL]?", text_at(told, 1))
                return named[1] if named else ""
        return ""

    def _letters(self, systems: Any) -> Iterator[tuple[str, str]]:
        """Letters of a datum system, in its order, with their modifiers."""
        for each in systems if isinstance(systems, tuple) else (systems,):
            if isinstance(each, Reference):
                yield from self._letters_of(each, 0)

    def _letters_of(self, number: int, deep: int) -> Iterator[tuple[str, str]]:
        here = self.part[number]
        datum, system = here.of("DATUM", "COMMON_DATUM"), here.of("DATUM_SYSTEM")
        if datum is not None:
            yield text_at(datum, 4), ""
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
            form = self.part[number_at(told, 5) or 0].of("TOLERANCE_ZONE_FORM") or ()
            if text_at(form, 0).lower().startswith(("cylindrical", "circular", "spherical")):
                found |= {each for each in told[4] if isinstance(each, Reference)} if len(told) > 4 else set()
        return found
