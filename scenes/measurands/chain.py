"""Chains: characteristics that are functions of other measurands' numbers - their mean, sum, largest or smallest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from scenes.measurands.evaluated import Evaluated, total
from scenes.measurands.kind import MEASURANDS, MeasurandKind

_ALIKE = 1e-9  # of the largest magnitude: numbers that differ by less are one


class Chain(MeasurandKind):
    """A function of numbers of measurands that the scene names before it (``of``), jointly measured."""

    features = ()
    is_chain = True
    is_flat = False
    takes_off: ClassVar[bool] = False
    """Whether numbers may be taken off (``minus``)."""

    @property
    def wanted(self) -> str:
        """In words."""
        return "left out, for it is of the numbers that `of` names,"

    def takes(self, features) -> bool:
        """None: those of its numbers are its own."""
        return not features

    def check_values(self, measurand) -> None:
        """At least two numbers, each once."""
        super().check_values(measurand)
        named = measurand.of + measurand.minus
        if measurand.minus and not self.takes_off:
            raise ValueError(f"minus must be left out for kind {measurand.kind}, got {', '.join(measurand.minus)}")
        if len(set(named)) < 2 or len(set(named)) < len(named):
            raise ValueError(f"of must be at least two different names for kind {measurand.kind}, got {list(named)}")

    def check(self, solid, key, quantity) -> None:
        """Whatever their numbers are."""

    def in_image(self, seen, quantity) -> Evaluated:
        """Of the numbers in the image."""
        return self.joined([_signed(MEASURANDS[t.kind].in_image(seen, t), s) for t, s in _terms(quantity)])

    def on_plane(self, seen, quantity) -> Evaluated:
        """Of the numbers, each on the plane of its own features."""
        return self.joined([_signed(MEASURANDS[t.kind].on_plane(seen, t), s) for t, s in _terms(quantity)])

    def joined(self, numbers: list[Evaluated]) -> Evaluated:
        """One number of several."""
        raise NotImplementedError


class Sum(Chain):
    """The sum of some numbers, less those that ``minus`` names: a wall that is left, a gap, a stack."""

    takes_off = True

    def joined(self, numbers) -> Evaluated:
        """All of them."""
        return total(numbers)


class Mean(Chain):
    """The mean of some numbers: a pitch, a diameter in several directions."""

    def joined(self, numbers) -> Evaluated:
        """Their sum over how many they are."""
        return total(numbers).times(1 / len(numbers))


class Largest(Chain):
    """The largest of some numbers. Where several may be it, its law is not normal (`imaging.models.extremes`)."""

    extreme = 1

    def joined(self, numbers) -> Evaluated:
        """Its value; derivatives are those of the number that it is, of several alike their mean."""
        values = np.stack(np.broadcast_arrays(*(each.value for each in numbers)), -1) * self.extreme
        most = values.max(-1)
        near = values >= (most - _ALIKE * np.abs(values).max(-1))[..., None]
        shares = np.moveaxis(near / near.sum(-1, keepdims=True), -1, 0)
        weighted = [each.times(share) for each, share in zip(numbers, shares, strict=True)]
        return Evaluated(self.extreme * most, total(weighted).gradient)


class Smallest(Largest):
    """The smallest of some numbers."""

    extreme = -1


def linked(number: Any, of: tuple[str, ...], minus: tuple[str, ...], known: Mapping[str, Any], key: str) -> Any:
    """A chain's number with the numbers that it names, from those that are listed before it.

    Raises
    ------
    ValueError
        If there is none of a name, lengths and angles are mixed, or one has a law of its own.
    """
    for name in of + minus:
        if name not in known:
            listed = ", ".join(known) or "(none)"
            raise ValueError(f"{key}.of must be names of numbers that are listed before it ({listed}), got {name!r}")
    terms = tuple(known[name] for name in of + minus)
    if own := [term.name for term in terms if MEASURANDS[term.kind].is_form or MEASURANDS[term.kind].extreme]:
        names = ", ".join(own)
        raise ValueError(f"{key}.of must not be forms, largest or smallest, each of a law of its own, got {names}")
    if own := [term.name for term in terms if MEASURANDS[term.kind].pictures > 1]:
        raise ValueError(f"{key}.of must be numbers that one picture tells, got {', '.join(own)}")
    if len({term.is_angle for term in terms}) > 1:
        raise ValueError(f"{key}.of must be all lengths or all angles, got {', '.join(of + minus)}")
    features = tuple(dict.fromkeys(feature for term in terms for feature in term.features))
    return replace(number, features=features, terms=terms, signs=(1,) * len(of) + (-1,) * len(minus))


def _terms(quantity: Any) -> list[tuple[Any, int]]:
    return list(zip(quantity.terms, quantity.signs, strict=True))


def _signed(number: Evaluated, sign: int) -> Evaluated:
    return number if sign > 0 else number.times(-1.0)


MEASURANDS.add("mean")(Mean())
MEASURANDS.add("sum")(Sum())
MEASURANDS.add("largest")(Largest())
MEASURANDS.add("smallest")(Smallest())
