"""What ``ice plan`` prints."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.console import Group
from rich.table import Table
from rich.text import Text

import planner
from planner.search.candidates import Candidate, how_far
from scenes.status import MEANINGS, is_trusted, legend
from validation.report.cells import MODELS
from validation.report.cells import pose as _pose
from validation.report.cells import table as _table

if TYPE_CHECKING:
    from validation.plan_check import CheckedSetting, PlanCheck

_TERMS = (
    "  place, now: in the plan, and by the pictures. calibrated: variance by the formula; propagated: by the rendered",
    "  picture; with u(bias): with what is not known of its bias, by which places are compared. ratio: propagated /",
    "  calibrated. not in formulas: effects that only the picture shows.",
)
_WHERE = {"object": "on the object", "image": "in the image"}


def report(found: planner.Plan, checked: PlanCheck | None, safe: planner.Robust | None, seconds: float) -> Group:
    """Plan, trace, candidates, what rendering them says, and the robust plan."""
    units = _units(found)
    parts = [Text(_head(found, units, seconds))]
    if found.trace:
        parts.append(_trace(found, units))
    parts += [_candidates(found, units), Text(_reading(found))]
    if checked:
        parts.append(_checked(found, checked))
    if safe:
        parts.append(_robust(safe))
    return Group(*parts)


def _head(found: planner.Plan, units: tuple[str, str], seconds: float) -> str:
    """The best setting, what it gives, and what is known of it."""
    p, edges = found.prediction, " ".join(found.scene.required)
    if len(p.measurands) > 1:
        return _head_of_several(found, edges, seconds)
    return (
        f"{found.scene.title or found.scene.name}\n"
        f"The best place of sensor and light, as (angle from the vertical, azimuth) in degrees:\n"
        f"  sensor {_pose(found.sensor)}, light {_pose(found.light)}: {_state(p)}\n"
        f"  One picture's sigma is {p.variance_object**0.5:.3g} {units[0]} of {p.value_object:.4g} {units[0]};"
        f" in the image {p.variance_image**0.5:.3g} {units[1]} of {p.value_image:.4g} {units[1]}.\n"
        f"  Least variance {_WHERE[found.objective]}, by {MODELS[found.model]}; measured from {edges}.\n"
        + "".join(f"{line}\n" for line in _textures(p))
        + _searched(found, seconds)
    )


def _head_of_several(found: planner.Plan, edges: str, seconds: float) -> str:
    p = found.prediction
    state = _state(p) if is_trusted(p.status) else p.status  # what it means is told below
    how = "largest ratio" if found.over == "minimax" else "weighted sum of the squared ratios"
    lines = [
        found.scene.title or found.scene.name,
        "The best place of sensor and light, as (angle from the vertical, azimuth) in degrees:",
        f"  sensor {_pose(found.sensor)}, light {_pose(found.light)}: {state}",
        f"  Least {how} of sigma to tolerance, by {MODELS[found.model]}; measured from {edges}.",
        f"  Limited by {found.limiting}, whose sigma is {100 * p.worst_ratio:.3g} % of its tolerance.",
    ]
    for each in p.measurands:
        part = "" if each.ratio is None else f", {100 * each.ratio:.3g} % of +-{each.tolerance.half:g}"
        sigma = f"{each.variance_object**0.5:.3g} {each.unit}"
        lines.append(f"    {each.name:<20} {each.value_object:.6g} {each.unit}: sigma {sigma}{part}, {each.status}")
    lines += [f"  {line}" for line in _legend(p)]
    return "\n".join([*lines, *_textures(p), _searched(found, seconds)])


def _textures(p: planner.Prediction) -> list[str]:
    """What textures add to each measurand; nothing without textures."""
    uneven = (each for each in p.measurands if each.texture_variance_object is not None)
    return [f"  Textures: {each.name} is off by {_over_parts(each)}" for each in uneven]


def _over_parts(each: planner.Forecast) -> str:
    if math.isnan(each.texture_variance_object):
        return "what is not known: a circle, or another face seen past an edge"
    return (
        f"{each.texture_variance_object**0.5:.3g} {each.unit} (1 sigma over parts) in all pictures of a part;"
        f" {each.bias_object:+.3g} {each.unit} on this one"
    )


def _searched(found: planner.Plan, seconds: float) -> str:
    lines = [
        f"  Found among {found.pairs} pairs of places in {seconds:.1f} s{_ruled_out(found)}.",
        f"  Guarantee: {found.guarantee}.",
    ]
    if found.certificate:
        done = "Certificate" if found.certificate.proved else "No certificate, but"
        lines.append(f"  {done}: {found.certificate.told}.")
    if not found.steady:
        off = " or ".join(sorted({f"{how_far(found.scene, role):.2g}" for role in ("sensor", "light")}))
        lines.append(f"  Hard to set up: {off} degrees off something cannot be measured any more.")
    if found.shares:
        lines.insert(
            0, "  Shares of the lights: " + ", ".join(f"{share:.2g}" for share in found.shares) + _alone(found)
        )
    if found.set_aside and found.set_aside[0].variance < found.variance:
        many, part = len(found.set_aside), 100 * found.set_aside[0].variance / found.variance
        lines.append(
            f"  {many} place{'s' * (many > 1)} of the grid passed over (the first has {part:.0f} % of this one's"
            " variance): more of the values there would be biased by what lies around their edges (clutter)."
        )
    return "\n".join(lines)


def _ruled_out(found: planner.Plan) -> str:
    """How many pairs a lower bound left to be evaluated, where it left out any."""
    return f"; a lower bound ruled out all but {found.evaluated}" if found.evaluated < found.pairs else ""


def _state(p: planner.Prediction) -> str:
    """The status with what it means, and what to do."""
    return f"ok, {MEANINGS[p.status]}" if is_trusted(p.status) else _legend(p)[0].removesuffix(".")


def _legend(p: planner.Prediction) -> list[str]:
    reasons = [f"{each.name}: {each.reason}" if each.reason else "" for each in p.measurands]
    return legend([each.status for each in p.measurands], reasons)


def _alone(found: planner.Plan) -> str:
    """What several lights gain over one that has all of the total."""
    if found.alone is None:
        return ""
    return f"; one light with all of it, where it is best: {found.alone / found.variance:.4g} of what is minimised"


def _units(found: planner.Plan) -> tuple[str, str]:
    """Of the measurand in the object and in the image."""
    first = found.prediction.measurands[0]
    return ("degrees", "degrees") if first.unit == "degrees" else (first.unit, "px")


def _trace(found: planner.Plan, units: tuple[str, str]) -> Table:
    table = _table(f"\n{_alternating(found)}", "held fixed", "", "found", "", _minimised(found, units))
    for step in found.trace:
        row = step.fixed, _pose(step.fixed_pose), step.found, _pose(step.found_pose), f"{step.variance:.4g}"
        table.add_row(*row)
    return table


def _alternating(found: planner.Plan) -> str:
    """What the paper's search comes to."""
    name = "The paper's alternating search"
    if found.gap is None:
        return name
    if not math.isfinite(found.gap):
        return f"{name} finds no place that can measure all"
    return f"{name}: its variance ends {100 * found.gap:.1f} % above the best"


def _minimised(found: planner.Plan, units: tuple[str, str]) -> str:
    """What is minimised, in words."""
    if len(found.prediction.measurands) > 1:
        return "largest ratio^2" if found.over == "minimax" else "sum of ratios^2"
    return f"variance, {units[0 if found.objective == 'object' else 1]}^2"


def _candidates(found: planner.Plan, units: tuple[str, str]) -> Table:
    names = (f"object, 1e-6 {units[0]}^2", f"image, 1e-6 {units[1]}^2")
    best, several = _as_candidate(found), len(found.prediction.measurands) > 1
    if several:
        names = ("limited by", _minimised(found, units))
    table = _table("\nClearly different settings, the best first", "", "sensor", "light", "edges", *names, "over best")
    others = [c for c in found.candidates if _setting(c) != _setting(best)]
    for c in (best, *others):
        if several:
            values = c.limiting, f"{c.variance:.4g}"
        else:
            values = f"{1e6 * c.variance_object:.4g}", f"{1e6 * c.variance_image:.4g}"
        row = "best" if c is best else "", _pose(c.sensor), _pose(c.light), " ".join(c.edges)
        table.add_row(*row, *values, f"{c.variance / best.variance:.3f}")
    return table


def _setting(c: Candidate) -> tuple[str, str, tuple[str, ...]]:
    """What a row names."""
    return _pose(c.sensor), _pose(c.light), c.edges


def _as_candidate(found: planner.Plan) -> Candidate:
    """The plan itself as a row of its table."""
    p = found.prediction
    return Candidate(
        sensor=found.sensor, light=found.light, edges=tuple(found.scene.required), variance=found.variance,
        variance_object=p.variance_object, variance_image=p.variance_image, limiting=found.limiting,
    )  # fmt: skip


def _reading(found: planner.Plan) -> str:
    """What the columns of the candidates are, and what to do with them."""
    several = len(found.prediction.measurands) > 1
    what = "its variance in the object and in the image"
    if several:
        what = "the square of the largest sigma / tolerance" if found.over == "minimax" else "what is minimised"
    return (
        f"  best: the place above, found between the grid's; the others are places of the grid. Beside them {what};\n"
        "  over best: over that of the first row.\n"
        "  Where the best place is taken, another row will do; `--sensor P,A` or `--light P,A` holds one fixed, "
        "`--out DIR` draws all of it, as one page plan.html, too."
    )


def _checked(found: planner.Plan, checked: PlanCheck) -> Group:
    """The rendered settings, and what follows from them."""
    from validation.plan_check import FARTHEST  # it loads what renders and measures

    if checked.proposed is None:
        table = [_checked_table(found, checked), *map(Text, [*_TERMS, *_statuses(checked)])] if checked.settings else []
        return Group(*table, Text(f"\nNot checked by rendering: {checked.reason}."))
    lines = [*_TERMS, *_statuses(checked), _order(checked), _proposal(checked)]
    if checked.without_formula:
        many = sum(bool(row.without_formula) for row in checked.settings)
        names = ", ".join(checked.without_formula)
        lines.append(f"  Without a formula, so that only the pictures know: {names} (in {many} of them).")
    if checked.left_out:
        lines.append(
            f"  The next {checked.left_out} of the table were not rendered: more than {FARTHEST:g} times the least "
            f"variance found (--check {len(checked.settings) + checked.left_out} renders them, too)."
        )
    lines.append(f"  The check took {checked.seconds:.1f} s (--no-check leaves it out).")
    return Group(_checked_table(found, checked), Text("\n".join(lines)))


def _checked_table(found: planner.Plan, checked: PlanCheck) -> Table:
    from validation.plan_check import ESTIMATOR

    several = len(found.prediction.measurands) > 1
    unit = "1e-6" if several else f"1e-6 {_units(found)[0 if found.objective == 'object' else 1]}^2"
    columns = (
        "place", "now", "sensor", "light", f"calibrated, {unit}", "propagated", "with u(bias)", "ratio", "status",
        "not in formulas",
    )  # fmt: skip
    table = _table(f"\nThe best settings rendered, and measured by {ESTIMATOR}", *columns)
    for row in checked.settings:
        values = (
            f"{1e6 * value:.4g}" if math.isfinite(value) else "-"
            for value in (row.calibrated, row.propagated, row.minimised)
        )
        now = "-" if row.rank_after is None else str(row.rank_after)
        ratio = "-" if row.ratio is None else f"{row.ratio:.3f}"
        names = ", ".join(row.without_formula)
        table.add_row(str(row.rank_before), now, _pose(row.sensor), _pose(row.light), *values, ratio, row.status, names)
    return table


def _statuses(checked: PlanCheck) -> list[str]:
    """What each status of the table means, what decided it in the first place that has it, and what to do."""
    reasons = (f"place {row.rank_before}, {row.reason}" if row.reason else "" for row in checked.settings)
    return [f"  {line}" for line in legend((row.status for row in checked.settings), reasons)]


def _order(checked: PlanCheck) -> str:
    if not checked.order_changed:
        return "  The order did not change."
    moved = sum(row.rank_after != row.rank_before for row in checked.settings)
    return f"  The order changed: {moved} of {len(checked.settings)} settings have another place."


def _proposal(checked: PlanCheck) -> str:
    best, plan = checked.proposed, checked.settings[0]
    if best.rank_before == 1:
        return f"  Proposed: the plan above, {best.status}."
    return f"  Proposed: sensor {_pose(best.sensor)}, light {_pose(best.light)}, {best.status}: {_gain(best, plan)}."


def _gain(best: CheckedSetting, plan: CheckedSetting) -> str:
    """What the proposal gains over the plan, in words."""
    from render import EffectTolerance

    if plan.rank_after is None:
        return f"the plan's picture cannot be measured ({plan.status})"
    change = best.minimised / plan.minimised - 1
    if plan.status != best.status:
        return f"{100 * change:+.1f} % variance, but the plan's picture is {plan.status}"
    small = f", less than effects that are left out may matter ({100 * EffectTolerance().variance:g} %)"
    return f"{100 * change:+.1f} % variance{small if -change < EffectTolerance().variance else ''}"


def _robust(safe: planner.Robust) -> Group:
    against = f"{100 * (safe.worst / safe.plan_worst - 1):+.1f} % against" if safe.plan_worst < float("inf") else "not"
    text = (
        f"\nRobust plan: sensor {_pose(safe.sensor)}, light {_pose(safe.light)}: variance {safe.nominal:.4g}, at worst"
        f" {safe.worst:.4g} in {safe.cases} cases\n"
    )
    text += (
        f"  {against} the plan above" if against != "not" else "  (the plan above cannot be measured in its worst case)"
    )
    title = "\nHow the plan's optimum moves if one input is off"
    table = _table(title, "input", "factor", "variance there", "at the new best", "sensor, deg", "light, deg")
    for m in safe.moves:
        row = f"{m.factor:.3g}", f"{m.variance:.4f}", f"{m.best:.4f}", f"{m.sensor_deg:.2f}", f"{m.light_deg:.2f}"
        table.add_row(m.input, *row)
    return Group(Text(text), table) if safe.moves else Group(Text(text))
