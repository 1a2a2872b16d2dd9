"""One hard case: a question, our answer, a reference that is independent of it, and the verdict."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

EPSILON = 2.0**-52
HOPELESS = 0.1  # a reference that the rounding of the inputs alone moves by more asks for a refusal, not for a number
WELL_CONDITIONED, TIGHT = 1e4, 1e-10


@dataclass(frozen=True)
class Answer:
    """What the system says: a number, or None and the reason for which it refuses one."""

    value: float | None
    reason: str = ""

    @classmethod
    def of(cls, value: float, status: str = "") -> Answer:
        """Infinity is a refusal with the status as its reason; anything else, NaN too, is a number to be judged."""
        return cls(None, status) if math.isinf(value) else cls(float(value), status)


@dataclass(frozen=True)
class Reference:
    """What is true.

    Attributes
    ----------
    value : float or None
        None where nothing can be measured, so that only a refusal is right.
    kind : str
        Where it comes from: ``mpmath``, ``closed form``, ``exact image``, ``Monte Carlo``, ``rule`` ...
    condition : float or None
        Sum over all inputs x of |x df/dx| / |f|: how much one relative rounding of every input moves the value.
    tolerance : float
        Largest relative error that is right. From the condition where there is one.
    scale : float or None
        What the error is relative to, where not to the value itself (an angle of 0, a place in the image).
    reason : str
        The only reason for which a refusal is right, where there is no value; any when empty.
    """

    value: float | None
    kind: str
    condition: float | None = None
    tolerance: float = math.nan
    scale: float | None = None
    reason: str = ""

    @classmethod
    def precise(cls, value: float, condition: float, kind: str = "mpmath") -> Reference:
        """To 1e-10 where the condition number is below 1e4, within 10 x condition x machine epsilon otherwise."""
        bound = TIGHT if condition < WELL_CONDITIONED else 10 * condition * EPSILON
        return cls(float(value), kind, float(condition), bound)


@dataclass(frozen=True)
class Case:
    """A question that is hard to answer in floating point.

    Attributes
    ----------
    area : str
        ``reflectance``, ``planner``, ``limb``, ``fit``, ``measure`` or ``render``.
    name, measurand : str
        What is hard about it, and what is asked.
    ours : callable
        Our answer.
    reference : callable
        The reference.
    refusals : tuple of str
        Reasons for which our answer may be refused although a reference value exists.
    """

    area: str
    name: str
    measurand: str
    ours: Callable[[], Answer]
    reference: Callable[[], Reference]
    refusals: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """One row of the table; ``verdict`` is ``right``, ``refused`` or ``WRONG``, ``seconds`` those of our answer."""

    area: str
    name: str
    measurand: str
    ours: float | None
    reference: float | None
    kind: str
    error: float | None
    tolerance: float | None
    condition: float | None
    reason: str
    verdict: str
    seconds: float


def run(case: Case) -> Row:
    """Ask, compare, judge."""
    began = time.perf_counter()
    answer = case.ours()
    seconds = time.perf_counter() - began
    truth = case.reference()
    error = None
    if answer.value is not None and truth.value is not None:
        size = abs(truth.value) if truth.scale is None else truth.scale
        difference = abs(answer.value - truth.value)
        error = difference / size if size else (0.0 if difference == 0 else math.inf)
    return Row(
        area=case.area,
        name=case.name,
        measurand=case.measurand,
        ours=answer.value,
        reference=truth.value,
        kind=truth.kind,
        error=error,
        tolerance=truth.tolerance if truth.value is not None else None,
        condition=truth.condition,
        reason=answer.reason,
        verdict=judge(case, answer, truth, error),
        seconds=seconds,
    )


def judge(case: Case, answer: Answer, truth: Reference, error: float | None) -> str:
    """Right within the tolerance, refused with a reason where that is allowed, or wrong.

    Examples
    --------
    >>> case = Case("fit", "", "", lambda: None, lambda: None)
    >>> judge(case, Answer(1.1), Reference(1.0, "closed form", None, 1e-3), 0.1)
    'WRONG'
    >>> judge(case, Answer(None, "low_contrast"), Reference(None, "rule"), None)
    'refused'
    """
    hopeless = truth.value is None or (truth.condition is not None and 10 * truth.condition * EPSILON > HOPELESS)
    declined = answer.value is None or (hopeless and answer.reason not in ("", "ok"))
    if declined:
        allowed = (hopeless and (not truth.reason or answer.reason == truth.reason)) or answer.reason in case.refusals
        return "refused" if answer.reason not in ("", "ok") and allowed else "WRONG"
    return "right" if error is not None and error <= truth.tolerance and not hopeless else "WRONG"
