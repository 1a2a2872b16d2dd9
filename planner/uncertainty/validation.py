"""Is the GUM's interval good enough? Compared with Monte Carlo's, as JCGM 101 clause 8 asks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from planner.uncertainty.budget import Budget
from planner.uncertainty.groups import members
from planner.uncertainty.monte_carlo import MonteCarlo, numerical_tolerance
from scenes.errors import InvalidInput

_DOMINANT = 0.5  # share of the variance from which one source shapes the whole distribution


@dataclass(frozen=True)
class Validation:
    """The comparison of one measurand.

    Attributes
    ----------
    d_low, d_high : float
        Absolute differences of the intervals' ends (JCGM 101 eq. 19).
    delta : float
        Numerical tolerance of u_c at the stated number of digits.
    verdict : {"agree", "differ", "undecided"}
        ``undecided`` where twice the standard deviation of Monte Carlo's ends is more than delta and could be the
        difference.
    reason : str
        In words; empty where they agree.
    interval : (float, float)
        What to state: the GUM's where they agree, Monte Carlo's elsewhere.
    """

    d_low: float
    d_high: float
    delta: float
    verdict: Literal["agree", "differ", "undecided"]
    reason: str
    interval: tuple[float, float]


def validate(
    gum: Budget, mc: MonteCarlo, digits: int = 2, interval: Literal["symmetric", "shortest"] = "symmetric"
) -> Validation:
    """Compare y +- U with Monte Carlo's coverage interval (JCGM 101 8.1).

    Raises
    ------
    InvalidInput
        Where the coverage probabilities differ.

    Examples
    --------
    >>> from planner.uncertainty import Input, budget, monte_carlo
    >>> inputs, c = [Input.from_half_width("scale", 1.0, 0.04)], {"scale": 200.0}
    >>> gum, mc = budget("width", "um", 200.0, inputs, c), monte_carlo(lambda x: 200 * x["scale"], inputs, 1)
    >>> found = validate(gum, mc)
    >>> found.verdict, found.reason
    ('differ', 'scale (rectangular) has 100 % of the variance')
    """
    if gum.p != mc.p:
        raise InvalidInput(f"p must be the same in both, got {gum.p} and {mc.p}")
    if interval not in ("symmetric", "shortest"):
        raise InvalidInput(f"interval must be one of symmetric, shortest, got {interval}")
    ends = mc.symmetric if interval == "symmetric" else mc.shortest
    d_low, d_high = (abs(a - b) for a, b in zip(gum.interval, ends, strict=True))
    delta = numerical_tolerance(gum.u, digits)
    noise = 2 * max(mc.spread[2:])
    if noise > delta and max(d_low, d_high) <= delta + noise:
        reason = f"{mc.draws} draws tell the ends to {noise:.2g} only, which is more than delta"
        return Validation(d_low, d_high, delta, "undecided", reason, ends)
    if max(d_low, d_high) <= delta:
        return Validation(d_low, d_high, delta, "agree", "", gum.interval)
    return Validation(d_low, d_high, delta, "differ", "; ".join(_reasons(gum, mc, delta)), ends)


def _reasons(gum: Budget, mc: MonteCarlo, delta: float) -> list[str]:
    """Every cause that is seen: a dominant source that is not normal, curvature, few degrees of freedom."""
    reasons = []
    single = {each.name: each for source in gum.sources for each in members(source)}
    for row in gum.contributions:
        shape = single[row.source].distribution if row.source in single else "normal"
        if row.share >= _DOMINANT and shape != "normal":
            reasons.append(f"{row.source} ({shape}) has {100 * row.share:.0f} % of the variance")
    if abs(mc.y - gum.value) > max(delta, 3 * mc.spread[0]):
        reasons.append(f"nonlinear: the mean of the draws is {mc.y - gum.value:+.2g} from the value")
    drawn = _drawn_u(gum)
    if math.isfinite(drawn) and abs(mc.u - drawn) > max(delta, 3 * mc.spread[1]):
        reasons.append(f"nonlinear: the draws' standard deviation is {mc.u:.2g}, first order gives {drawn:.2g}")
    if abs(drawn - gum.u) > delta:
        reasons.append(f"few degrees of freedom: the distributions' standard deviation is {drawn:.2g}, not {gum.u:.2g}")
    low, high = mc.symmetric
    if abs(high + low - 2 * mc.y) > 2 * delta:
        reasons.append("the distribution of the draws is not symmetric")
    if mc.failed:
        reasons.append(f"{mc.failed} of {mc.draws + mc.failed} draws gave no value")
    return reasons or ["the distribution of the draws is neither normal nor Student's t"]


def _drawn_u(gum: Budget) -> float:
    """Standard uncertainty to first order of the distributions that are drawn (sd instead of u)."""
    extra = sum(
        gum.sensitivities[each.name] ** 2 * (each.sd**2 - each.u**2)
        for source in gum.sources
        for each in members(source)
        if gum.sensitivities[each.name]
    )
    return (gum.u**2 + extra) ** 0.5
