"""What ``ice budget`` finds and says: budgets, draws, pictures of drawn stations, capability, what to improve."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from imaging.light.appearance import is_plain
from measure.best import best_estimator
from planner.budgeting.budgets import SceneBudget, budget
from planner.uncertainty.budget import Budget
from planner.uncertainty.capability import gauge, tur
from planner.uncertainty.improve import improvements, needed
from planner.uncertainty.monte_carlo import monte_carlo as drawn_until_stable
from planner.uncertainty.risks import Limits, global_risks, nonconforming_probability
from planner.uncertainty.validation import validate
from scenes import InvalidInput, Picture, Tolerance
from scenes.measurands.kinds import MEASURANDS
from scenes.measurands.zone import joint_parts
from scenes.results import picked
from scenes.status import is_trusted
from validation import coverage
from validation.chain import Chain

if TYPE_CHECKING:
    from measure import Correction

_SHOWN = 3  # sources that are named as worth an improvement
_BLOCK, _MOST_DRAWS = 100_000, 10_000_000
_LEAST_GAIN = 0.01  # part of U below which an improvement is not worth its line


def budget_of(picture: Picture, p: float = 0.95, *, rendered: bool = False) -> SceneBudget:
    """The budget of a picture, its noise and bias predicted, or where that does not do, simulated.

    Formulas do for one convex body before darkness, without textures, whose predicted statuses are trusted. Elsewhere,
    or where it is asked for, the bias is found in renders and counts as taken off: what that is not sure of are sources
    of their own.

    Raises
    ------
    InvalidInput
        If a measurand cannot be measured there.
    """
    if not rendered:
        found = budget(picture, p=p)
        if formulas_do(picture, found.statuses):
            return found
    off = simulated(picture)
    for quantity, value, state in zip(picture.scene.quantities, off.bias, off.simulated, strict=True):
        if not np.isfinite(value):
            raise InvalidInput(f"{quantity.name} must be measurable for a budget, got {state} in the rendered picture")
    return budget(picture, variances=np.diag(off.covariance), doubts=off.sources, statuses=off.status, p=p)


def formulas_do(picture: Picture, statuses: tuple[str, ...]) -> bool:
    """Whether predicted noise and bias are all that there is: of one convex body, where nothing predicted is
    doubtful, and the estimator is the one of which they are."""
    plain = is_plain(picture.scene) and not picture.scene.textures
    return plain and all(map(is_trusted, statuses)) and best_estimator(picture) == best_estimator(picture.scene)


def simulated(picture: Picture) -> Correction:
    """The correction of a picture by the estimator that tells most of it, kept on disk."""
    from validation import kept, simulation

    return simulation.best(picture, kept.correction)


def monte_carlo(found: SceneBudget, seed: int, digits: int = 2, margin: float = 5.0) -> list[dict[str, Any]]:
    """Clause 8 of JCGM 101: every budget beside drawn inputs, and whether its interval may stay.

    The model that is drawn is the closed form's second-order expansion (`validation.chain`); ``missed`` is what it
    leaves out, root mean square over u. Draws go on until they are ``margin`` times as stable as the interval is asked
    to be, so that a difference is not theirs (JCGM 101, 8.2).
    """
    chain, streams = Chain(found), np.random.SeedSequence(seed).spawn(len(found.measurands) + 1)
    missed = chain.missed(np.random.default_rng(streams[-1]))
    rows = []
    for m, (each, stream) in enumerate(zip(found, streams[:-1], strict=True)):
        rng = np.random.default_rng(stream)
        enough = {"digits": digits, "block": _BLOCK, "most": _MOST_DRAWS, "margin": margin}
        draws = drawn_until_stable(chain.model(m), each.sources, rng, each.p, name=each.name, **enough)
        told = validate(each, draws, digits)
        rows.append({
            "name": each.name, "unit": each.unit, "value": draws.y, "u": draws.u, "draws": draws.draws,
            "interval": list(draws.symmetric), "shortest": list(draws.shortest), "gum": list(each.interval),
            "d_low": told.d_low, "d_high": told.d_high, "tolerance": told.delta, "verdict": told.verdict,
            "reason": told.reason, "stated": list(told.interval), "missed": float(missed[m]),
            "chain": coverage.CLOSED,
        })  # fmt: skip
    return rows


def pictured(found: SceneBudget, count: int, seed: int, estimator: str | None = None, report=lambda done: None) -> dict:
    """Pictures of drawn stations, measured: scatter, and how often value +- U holds the true value."""
    rows = [
        {"name": each.name, "unit": each.unit, "value": each.mean, "u": each.sigma,
         **picked(each, "held", "n", "failed", "warned")}
        for each in coverage.pictured(found, count, seed, estimator, report)
    ]  # fmt: skip
    return {"stations": count, "chain": coverage.PICTURES, "measurands": rows}


def simulated_gauge(found: SceneBudget, m: int, seed: int, repeats: int = 50) -> dict[str, float] | None:
    """Cg and Cgk of simulated repeats on one station, its systematic errors drawn once; None without tolerance."""
    zone = found.prediction.measurands[m].tolerance
    each = found.measurands[m]
    if zone is None or each.repeatability == 0:
        return None
    rng = np.random.default_rng(seed)
    station = each.value + each.accuracy * rng.standard_normal()
    values = station + each.repeatability * rng.standard_normal(repeats)
    made = gauge(values, each.value, zone.plus + zone.minus)
    return {"cg": made.cg, "cgk": made.cgk, "repeats": made.n}


def capability(found: SceneBudget, m: int, seed: int = 1) -> dict[str, Any] | None:
    """U against the tolerance of the m-th measurand; None without one, or where the value is not trusted.

    Global risks need the spread of the manufacture, ``uncertainty.process_sd`` (lengths).
    """
    told, each = found.prediction.measurands[m], found.measurands[m]
    zone: Tolerance | None = told.tolerance
    if zone is None or not is_trusted(found.statuses[m]):
        return None
    limits, width = Limits.of(told.nominal, zone), zone.plus + zone.minus
    facts: dict[str, Any] = {
        "T": width, "U_over_half_T": each.U / zone.half, "TUR": tur(width, each.U),
        "gauge": simulated_gauge(found, m, seed), "guard_band": each.U,
        "specific_risk": nonconforming_probability(each.value, each.u, limits), "global": None, "guarded": None,
    }  # fmt: skip
    if each.name in joint_parts(found.picture.scene.zones) or MEASURANDS[told.kind].extreme:
        return facts | {"specific_risk": None}  # conforms or not with the others of its zone; or its law is not normal
    spread = found.picture.scene.uncertainty.process_sd
    if not spread or each.unit == "degrees":
        return facts
    facts["global"] = asdict(global_risks(told.nominal, spread, each.u, limits))
    if width > 2 * each.U:
        facts["guarded"] = asdict(global_risks(told.nominal, spread, each.u, limits, limits.guarded(each.U)))
    return facts


def facts(found: SceneBudget, drawn: list[dict], shown: dict | None, reach: float | None, seed: int = 1) -> dict:
    """The document of ``ice budget --json``; null is infinite or not known."""
    return {
        "scene": found.picture.scene.name,
        "sensor": list(found.picture.sensor),
        "lights": [list(pose) for pose in found.picture.lights],
        "p": found.measurands[0].p,
        "measurands": [_measurand(found, m, reach, seed) for m in range(len(found.measurands))],
        "monte_carlo": drawn,
        "pictures": shown,
    }


def _measurand(found: SceneBudget, m: int, reach: float | None, seed: int) -> dict[str, Any]:
    each, kind, status = found.measurands[m], found.picture.scene.quantities[m].kind, found.statuses[m]
    from validation.report.budget_table import signed

    return {
        "name": each.name, "kind": kind, **picked(each, "unit", "value", "u", "U", "k"),
        "u_bias": found.u_bias[m], "status": status, "signed": is_trusted(status),
        "dof": each.dof if np.isfinite(each.dof) else None, "repeatability": each.repeatability,
        "accuracy": each.accuracy, "contributions": each.as_rows(), "capability": capability(found, m, seed),
        "improve": [asdict(one) for one in improvements(each)[:_SHOWN]],
        "reach": None if reach is None else [asdict(needed(each, reach, row.source)) for row in each.contributions],
        "sentence": signed(found, m),
    }  # fmt: skip


def said_of_draws(row: dict) -> str:
    """Clause 8 in words."""
    low, high = row["interval"]
    beside = f"Monte Carlo ({row['draws']} draws) u = {row['u']:.3g}, interval {low:.7g} to {high:.7g}"
    if row["verdict"] == "agree":
        return f"{beside}: agrees within {row['tolerance']:.1g} (JCGM 101, clause 8)"
    state = "differs" if row["verdict"] == "differ" else "undecided"
    return f"{beside}: {state} ({row['reason']}); state Monte Carlo's interval"


def said_of_pictures(shown: dict) -> list[str]:
    """Of the simulated stations, a line a measurand."""
    return [
        f"{row['name']}: {row['n']} of {shown['stations']} pictures of drawn stations measured, u = {row['u']:.3g},"
        f" value +- U holds the true value in {100 * row['held']:.1f} %"
        for row in shown["measurands"]
    ]


def said_of_tolerance(found: SceneBudget, each: Budget) -> list[str]:
    """Capability in words; nothing without a tolerance."""
    told = capability(found, found.measurands.index(each))
    if told is None:
        return []
    lines = [f"U / (T / 2) = {told['U_over_half_T']:.3f}, TUR = {told['TUR']:.3g}, guard band U = {each.U:.3g}"]
    if told["gauge"]:
        lines[0] += f", Cg = {told['gauge']['cg']:.3g}, Cgk = {told['gauge']['cgk']:.3g} (simulated repeats)"
    if told["global"]:
        risk = told["global"]
        line = (
            f"of the process: wrongly accepted {risk['wrong_acceptance']:.2g}, rejected {risk['wrong_rejection']:.2g}"
        )
        if told["guarded"]:
            rest = told["guarded"]
            line += f"; guarded {rest['wrong_acceptance']:.2g}, {rest['wrong_rejection']:.2g}"
        lines.append(line)
    return lines


def said_of_improvement(each: Budget) -> list[str]:
    """Which source to improve next."""
    best = [one for one in improvements(each)[:_SHOWN] if one.gain >= _LEAST_GAIN]
    if not best:
        return []
    return ["halve next: " + ", ".join(f"{one.source} (U {one.U:.3g}, -{100 * one.gain:.0f} %)" for one in best)]


def said_of_reach(each: Budget, wanted: float) -> list[str]:
    """How well each of the leading sources must be known for a wanted U."""
    if wanted >= each.U:
        return [f"U = {wanted:g} is reached as it is"]
    rows = sorted(each.contributions, key=lambda row: -row.share)
    answers = [needed(each, wanted, row.source) for row in rows if row.share > _LEAST_GAIN]
    reached = [one.reason for one in answers if one.reachable and one.u is not None]
    if reached:
        return reached
    floor = min(answers, key=lambda one: one.floor, default=None)
    return [f"U = {wanted:g} is not reached by one source alone" + (f": {floor.reason}" if floor else "")]
