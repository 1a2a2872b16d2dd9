"""Formulas written out: what a function does with numbers, as lines of Python that do it again without the function.

A function of arrays is called once with numbers that remember how they came about (`Number`); NumPy takes them in
arrays of objects. Where the function asks which of two is larger, the answer at these numbers stands, and the formula
asks again: where it is another one, it has no value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any

import numpy as np

_CALLED = ("sqrt", "sin", "cos", "tan", "arctan2", "hypot")
_IN_MATH = {"arctan2": "atan2"}


@dataclass(frozen=True, eq=False)
class Tape:
    """Every operation once, in order.

    Attributes
    ----------
    lines : list of (str, tuple of int)
        The operation and the numbers of the lines that it takes; of an input or a constant what it is called.
    told : list of (int, str)
        Comparisons with 0 whose answers were taken for granted: of which line, and as a condition.
    """

    lines: list[tuple[str, tuple[int, ...]]] = field(default_factory=list)
    told: list[tuple[int, str]] = field(default_factory=list)
    _known: dict[tuple[str, tuple[int, ...]], Number] = field(default_factory=dict)

    def inputs(self, values: Sequence[float]) -> list[Number]:
        """Numbers ``p[0]``, ``p[1]``, ... of a list, and where the function is followed."""
        return [self.add(f"p[{k}]", (), float(value)) for k, value in enumerate(values)]

    def constant(self, value: float) -> Number:
        return self.add(repr(float(value)), (), float(value), constant=True)

    def add(self, operation: str, of: tuple[int, ...], value: float, *, constant: bool = False) -> Number:
        """The number of an operation, the same for the same one."""
        key = operation, of
        if key not in self._known:
            self.lines.append(key)
            self._known[key] = Number(self, len(self.lines) - 1, value, constant)
        return self._known[key]

    def code(self, outputs: Sequence[Number]) -> list[str]:
        """Lines of Python that compute some numbers, and at last return them as a tuple; None where they have none."""
        needed = {line for line, _ in self.told} | {each.line for each in outputs}
        for line in reversed(range(len(self.lines))):
            if line in needed:
                needed.update(self.lines[line][1])
        names = {line: self._name(line) for line in sorted(needed)}
        body = [f"{names[line]} = {self._written(line, names)}" for line in names if self.lines[line][1]]
        asked = [f"if not {names[line]} {condition}:\n    return None" for line, condition in dict.fromkeys(self.told)]
        return [
            *body,
            *"\n".join(asked).splitlines(),
            f"return ({''.join(names[each.line] + ', ' for each in outputs)})",
        ]

    def _name(self, line: int) -> str:
        operation, of = self.lines[line]
        return f"v{line}" if of else f"({operation})" if operation.startswith("-") else operation

    def _written(self, line: int, names: dict[int, str]) -> str:
        operation, of = self.lines[line]
        taken = [names[each] for each in of]
        if operation.isidentifier():
            return f"{operation}({', '.join(taken)})"
        return f"{operation}{taken[0]}" if len(taken) == 1 else f"{taken[0]} {operation} {taken[1]}"


@dataclass(frozen=True, eq=False)
class Number:
    """A number that remembers how it came about.

    Examples
    --------
    >>> tape = Tape()
    >>> a, b = tape.inputs([3.0, 4.0])
    >>> tape.code([np.sqrt(np.array([a * a + b * b]))[0]])
    ['v2 = p[0] * p[0]', 'v3 = p[1] * p[1]', 'v4 = v2 + v3', 'v5 = sqrt(v4)', 'return (v5, )']
    """

    tape: Tape
    line: int
    at: float
    constant: bool = False

    def __add__(self, other: Any) -> Any:
        return self._with("+", other)

    def __radd__(self, other: Any) -> Any:
        return self._with("+", other, swapped=True)

    def __sub__(self, other: Any) -> Any:
        return self._with("-", other)

    def __rsub__(self, other: Any) -> Any:
        return self._with("-", other, swapped=True)

    def __mul__(self, other: Any) -> Any:
        return self._with("*", other)

    def __rmul__(self, other: Any) -> Any:
        return self._with("*", other, swapped=True)

    def __truediv__(self, other: Any) -> Any:
        return self._with("/", other)

    def __rtruediv__(self, other: Any) -> Any:
        return self._with("/", other, swapped=True)

    def __pow__(self, power: Any) -> Any:
        return self * self if power == 2 else NotImplemented

    def __neg__(self) -> Number:
        return self.tape.constant(-self.at) if self.constant else self.tape.add("-", (self.line,), -self.at)

    def __abs__(self) -> Number:
        return self._called("abs", abs(self.at))

    def conjugate(self) -> Number:
        return self

    def __getattr__(self, name: str) -> Any:
        """What NumPy calls of objects in its arrays: `numpy.sqrt` their ``sqrt``."""
        if name not in _CALLED:
            raise AttributeError(name)

        def called(*others: Any) -> Number:
            each = [self.tape.constant(other) if isinstance(other, Real) else other for other in others]
            written = _IN_MATH.get(name, name)
            return self._called(written, getattr(math, written)(self.at, *(one.at for one in each)), *each)

        return called

    def __lt__(self, other: Any) -> bool:
        return self._asked("<", other)

    def __le__(self, other: Any) -> bool:
        return self._asked("<=", other)

    def __gt__(self, other: Any) -> bool:
        return self._asked(">", other)

    def __ge__(self, other: Any) -> bool:
        return self._asked(">=", other)

    def __eq__(self, other: Any) -> bool:
        return self._asked("==", other)

    def __ne__(self, other: Any) -> bool:
        return self._asked("!=", other)

    def __hash__(self) -> int:
        return hash((id(self.tape), self.line))

    def __bool__(self) -> bool:
        raise TypeError("a number of a formula is no truth value")

    def _with(self, operation: str, other: Any, swapped: bool = False) -> Any:
        if not isinstance(other, Number | Real) or isinstance(other, bool):
            return NotImplemented
        other = other if isinstance(other, Number) else self.tape.constant(float(other))
        one, two = (other, self) if swapped else (self, other)
        value = _value(operation, one.at, two.at)
        if one.constant and two.constant:
            return self.tape.constant(value)
        simpler = _simpler(operation, one, two)
        return self.tape.add(operation, (one.line, two.line), value) if simpler is None else simpler

    def _called(self, name: str, value: float, *others: Number) -> Number:
        if all(each.constant for each in (self, *others)):
            return self.tape.constant(value)
        return self.tape.add(name, (self.line, *(each.line for each in others)), value)

    def _asked(self, relation: str, other: Any) -> bool:
        """The answer here, which the formula asks for again."""
        away = self - other
        told = _compared(relation, away.at)
        if not away.constant:
            self.tape.told.append((away.line, f"{_condition(relation, away.at)} 0.0"))
        return told


def _value(operation: str, one: float, two: float) -> float:
    if operation == "/":
        return one / two if two else math.nan
    return {"+": one + two, "-": one - two, "*": one * two}[operation]


def _simpler(operation: str, one: Number, two: Number) -> Number | None:
    """The number itself where nothing changes it, and 0 where nothing is left."""
    first, second = (each.at if each.constant else None for each in (one, two))
    if operation == "*":
        if first == 0 or second == 0:
            return one.tape.constant(0.0)
        return two if first == 1 else one if second == 1 else None
    if operation == "+":
        return two if first == 0 else one if second == 0 else None
    if operation == "-":
        return one if second == 0 else -two if first == 0 else None
    return one if second == 1 else one.tape.constant(0.0) if first == 0 else None


def _compared(relation: str, away: float) -> bool:
    return {"<": away < 0, "<=": away <= 0, ">": away > 0, ">=": away >= 0, "==": away == 0, "!=": away != 0}[relation]


def _condition(relation: str, away: float) -> str:
    """What must hold of a difference for the answer to stand: its sign, or of equality that it is none."""
    if relation in ("==", "!="):
        return "!=" if away else "=="
    return ">" if away > 0 else "<" if away < 0 else "=="


def numbers(values: Iterable[Any]) -> np.ndarray:
    """An array of objects, (n,), which NumPy computes with."""
    each = list(values)
    found = np.empty(len(each), object)
    found[:] = each
    return found
