"""A plan as JSON."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import scenes
from scenes.results import picked
from validation.strict_json import plain

if TYPE_CHECKING:
    import planner
    from validation.plan_check import CheckedSetting, PlanCheck


def facts(found: planner.Plan, checked: PlanCheck | None, safe: planner.Robust | None, seconds: float) -> dict:
    """The plan for JSON."""
    p = found.prediction
    return plain({
        "scene": found.scene.name,
        **picked(found, "objective", "model"),
        "sensor": list(found.sensor),
        "light": scenes.pairs(found.light),
        **picked(found, "steady", "shares", "alone"),
        "edges": list(found.scene.required),
        **picked(found, "over", "variance", "limiting"),
        "worst_ratio": p.worst_ratio,
        "measurands": [_measurand(each) for each in p.measurands],
        **picked(p, "variance_object", "variance_image", "status"),
        "grid": {
            "sensor": list(found.grid_sensor),
            "light": scenes.pairs(found.grid_light),
            "variance": found.grid_variance,
        },
        "alternating": _alternating(found),
        **picked(found, "guarantee", "pairs", "evaluated"),
        "certificate": None if found.certificate is None else dataclasses.asdict(found.certificate),
        "candidates": [_with_poses(candidate) for candidate in found.candidates],
        "set_aside": [_with_poses(candidate) for candidate in found.set_aside],
        **_checked(checked),
        "robust": None if safe is None else _with_poses(safe),
        "seconds": seconds,
    })  # fmt: skip


def _measurand(each: planner.Forecast) -> dict:
    zone = each.tolerance
    sigma, sigma_image = math.sqrt(each.variance_object), math.sqrt(each.variance_image)
    return {
        **picked(each, "name", "kind", "unit"),
        "value": each.value_object,
        "nominal": each.nominal,
        "tolerance": zone and {"plus": zone.plus, "minus": zone.minus},
        "sigma": sigma,
        "sigma_image": sigma_image,
        "ratio": each.ratio if math.isfinite(sigma) else None,
        "status": each.status,
        **_texture(each),
    }


def _texture(each: planner.Forecast) -> dict:
    """Standard deviations over parts by textures, and the bias of this part; nothing without textures."""
    if each.texture_variance_object is None:
        return {}
    names = ("sigma_texture", "sigma_texture_image", "bias")
    values = each.texture_variance_object**0.5, each.texture_variance_image**0.5, each.bias_object
    return dict(zip(names, values, strict=True))


def _with_poses(found) -> dict:
    """A candidate or a robust plan with its poses as pairs."""
    return {**dataclasses.asdict(found), "sensor": list(found.sensor), "light": scenes.pairs(found.light)}


def _alternating(found: planner.Plan) -> dict:
    trace = [
        {
            "fixed": step.fixed,
            "at": list(step.fixed_pose),
            "found": step.found,
            "best": list(step.found_pose),
            "variance": step.variance,
        }
        for step in found.trace
    ]
    return {"variance": found.partial_variance if found.trace else None, "gap": found.gap, "trace": trace}


def _checked(checked: PlanCheck | None) -> dict:
    """What rendering the best settings gave; nothing known without."""
    if checked is None:
        return {"checked": [], "order_changed": None, "proposed": None, "check": None}
    return {
        "checked": [_setting(row) for row in checked.settings],
        "order_changed": checked.order_changed,
        "proposed": None if checked.proposed is None else _setting(checked.proposed),
        "check": {
            "without_formula": list(checked.without_formula),
            "reason": checked.reason or None,
            "seconds": checked.seconds,
            "left_out": checked.left_out,
        },
    }


def _setting(row: CheckedSetting) -> dict:
    return {
        "sensor": list(row.sensor),
        "light": scenes.pairs(row.light),
        **picked(row, "edges", "calibrated", "propagated", "with_bias", "ratio", "status"),
        "reason": row.reason or None,
        "without_formula": list(row.without_formula),
        **picked(row, "rank_before", "rank_after"),
    }
