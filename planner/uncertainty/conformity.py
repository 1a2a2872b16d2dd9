"""Does a measured value keep its tolerance? The decision rule of ISO 14253-1, with a guard band of k sigma."""

from __future__ import annotations

from planner.uncertainty.rule import Decision, decided
from scenes import InvalidInput, Tolerance
from scenes.status import OK

COVERAGE = 2.0  # k: the expanded uncertainty U = k sigma covers about 95 % of a normal distribution


def decide(
    value: float, sigma: float, nominal: float, tolerance: Tolerance, k: float = COVERAGE, status: str = OK
) -> Decision:
    """Whether conformity is proved, disproved, or neither.

    Parameters
    ----------
    value, sigma : float
        Measured value and its standard deviation (not variance); NaN where nothing was measured.
    nominal : float
    tolerance : Tolerance
        Of the same unit, as `nominal`.
    k : float
        Coverage factor, at least 0.
    status : str
        Of the value (`scenes.status`); what is not trusted is undecided.

    Returns
    -------
    {"pass", "fail", "undecided"}
        ``pass`` where the value keeps both limits by k sigma, ``fail`` where it breaks one by more than that.

    Examples
    --------
    >>> zone = Tolerance(plus=0.02, minus=0.02)
    >>> [decide(value, 0.004, 10.0, zone) for value in (10.011, 10.013, 10.027, 10.029)]
    ['pass', 'undecided', 'undecided', 'fail']
    >>> decide(10.0, 0.004, 10.0, zone, status="clutter")
    'undecided'
    """
    if not k >= 0:
        raise InvalidInput(f"k must be at least 0, got {k}")
    return decided(value, (nominal - tolerance.minus, nominal + tolerance.plus), k * sigma, status)
