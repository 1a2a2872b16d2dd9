"""A recipe made of a scene: all that does not depend on the picture, worked out once and written down."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.features.kinds import on_plane
from imaging.features.measurand import Measurands, measurands
from imaging.pictures import Pictures
from imaging.sensor import full_scale
from measure import Correction
from measure.estimators.kinds import ESTIMATORS
from measure.estimators.separate import SeparateEstimator
from measure.features.alignment import aligned
from measure.features.corners import intersect, line_equations
from measure.features.found import MIN_SINE
from measure.features.layout import Layout, layout_of
from measure.features.rims import rim_tool, unmoved
from measure.features.shape import prepared
from measure.features.tools import RimTool
from measure.quantities import found_in_images
from planner.budgeting.terms import BIAS, MODEL, NOISE
from planner.uncertainty.budget import coverage_factor
from scenes import InvalidInput, Picture, Quantity, status
from scenes.measurands.kinds import MEASURANDS
from scenes.measurands.zone import joint_parts
from scenes.results import finite
from validation import kept
from validation.recipe.traced import Number, Tape, numbers
from validation.remeasured import Method
from validation.report.requirements import measurable_budget, requirements

ESTIMATOR = "gradient"
"""Of the straight edges: the one that looks at each by itself, so that nothing but pixels is left of a picture."""
_P = 0.95
_TABLED = 1000  # degrees of freedom


@dataclass(frozen=True, eq=False)
class Export:
    """What a recipe is written of.

    Attributes
    ----------
    picture : Picture
    correction : Correction or None
    facts : dict
        What JSON holds of it.
    arrays : dict of str to ndarray
    formulas : str
        Python of the values' formulas.
    """

    picture: Picture
    correction: Correction | None
    facts: dict[str, Any]
    arrays: dict[str, np.ndarray]
    formulas: str


def export(picture: Picture, estimator: str = ESTIMATOR, *, as_measured: bool = False) -> Export:
    """The recipe of a picture, whose lights are known; without a bias taken off where that is ``as_measured``.

    Raises
    ------
    InvalidInput
        If something of the scene cannot be measured by a recipe.
    """
    check(picture, estimator)
    known, layout = measurands(Pictures.of(picture)), layout_of(picture)
    tools = [rim_tool(picture, name, unmoved(picture, name)) for name in known.circles]
    edges, places, starts = _of_edges(layout, estimator)
    rims, own, parts = _of_rims(tools, int(starts[-1]))
    if not [*places, *own]:
        pose = ",".join(f"{angle:g}" for angle in picture.sensor)
        raise InvalidInput(f"--sensor must be a place from which something can be measured, got {pose}")
    values, formulas = _of_values(known, layout, estimator)
    correction = None if as_measured else kept.correction(picture, Method(estimator))
    told, numbers = _of_correction(correction)
    characteristics, whole = _of_budgets(picture, correction)
    optics, noise = layout.optics, picture.scene.noise
    arrays = _joined([*places, *own]) | edges | rims | numbers
    facts = {
        "estimator": estimator, "shape": list(optics.shape), "locator": [optics.scale_px, optics.window_px],
        "limits": [_least_contrast(layout, estimator), ESTIMATORS[estimator].capture_px], "least_sine": MIN_SINE,
        "sensor": {"noise_variance": optics.noise_variance, "shot_gain": noise.shot_gain,
                   "dark_level": noise.dark_level, "full": finite(full_scale(noise))},
        "rims": parts, "values": values, "characteristics": characteristics, "whole": whole, "correction": told,
        "factors": [coverage_factor(_P, dof) for dof in range(1, _TABLED + 1)], "normal": coverage_factor(_P),
    }  # fmt: skip
    return Export(picture, correction, facts, arrays, formulas)


def check(picture: Picture, estimator: str) -> None:
    """See that all of a picture's scene can be measured by a recipe.

    Raises
    ------
    InvalidInput
        If something cannot.
    """
    scene = picture.scene
    if estimator != ESTIMATOR:
        raise InvalidInput(f"--estimator must be {ESTIMATOR} for a recipe, got {estimator}")
    if not picture.lights:
        raise InvalidInput("--light must be given for a recipe, got nothing")
    if not scene.placement.is_known:
        raise InvalidInput("placement.from must be known for a recipe, which looks at one place, got another")
    if scene.noise.colour is not None or scene.noise.is_shared:
        what = "colour" if scene.noise.colour is not None else "row_sigma or column_sigma"
        raise InvalidInput(f"noise must be of independent pixels for a recipe, got noise.{what}")
    if scene.noise.excess:
        raise InvalidInput(
            f"noise must be a linear sensor's for a recipe, got noise.excess of {len(scene.noise.excess)} rows"
        )
    kinds = {each.name: MEASURANDS[each.kind] for each in scene.quantities}
    for each in scene.quantities:
        if kinds[each.name].is_form or kinds[each.name].extreme:
            raise InvalidInput(
                f"measurands must be edges' and circles' alone for a recipe, got {each.name} ({each.kind})"
            )
    if scene.zones:
        zone = scene.zones[0]
        raise InvalidInput(f"measurands must be decided one by one in a recipe, got {zone.name}, a zone of {zone.kind}")


def _of_edges(layout: Layout, estimator: str) -> tuple[dict[str, np.ndarray], list[tuple], np.ndarray]:
    """Arrays of the straight edges, the columns of their places, and where those of each begin."""
    if not layout.names:
        return _named("edges", fixed=np.array([], str), lengths=np.zeros(0), shown=np.zeros(0, int),
                      starts=np.zeros(1, int), along=np.zeros(0)), [], np.zeros(1, int)  # fmt: skip
    tool = _tool(layout, estimator)
    shown = [(e, part.locator) for e, part in enumerate(tool.parts) if part is not None]
    starts = np.cumsum([0, *(locator.positions.size for _, locator in shown)])
    arrays = _named(
        "edges", fixed=np.array([caliper.status for caliper in tool.calipers]),
        lengths=np.array([caliper.length for caliper in tool.calipers]), shown=np.array([e for e, _ in shown], int),
        starts=starts, along=np.concatenate([np.zeros(0), *(locator.positions for _, locator in shown)]),
    )  # fmt: skip
    if np.isfinite(layout.ends).all():
        arrays |= _named("aligned", **vars(aligned(layout)))
    return arrays, [_columns(locator) for _, locator in shown], starts


def _of_rims(tools: list[RimTool], start: int) -> tuple[dict[str, np.ndarray], list[tuple], list[dict[str, Any]]]:
    """Arrays of circles and curved surfaces, the columns of their places, and facts of each."""
    arrays, parts = {}, []
    for k, tool in enumerate(tools):
        stop = start + tool.locator.positions.size
        blur = tool.optics.blur_at(tool.locator.places)
        curve = {} if tool.curve is None else {
            name: getattr(tool.curve, name) for name in ("places", "normals", "along", "bend")}  # fmt: skip
        given = {
            "contrast": tool.contrast,
            "signs": tool.locator.signs,
            "blur": blur if np.ndim(blur) else None,
            **curve,
        }
        arrays |= _named(f"rims.{k}", design=tool.design, weights=tool.weights, inward=tool.inward,
                         **{name: each for name, each in given.items() if each is not None})  # fmt: skip
        parts.append({"part": [start, stop], "state": tool.state, "scale_px": tool.optics.scale_px,
                      "blur_px": tool.optics.blur_px})  # fmt: skip
        start = stop
    return arrays, [_columns(tool.locator) for tool in tools], parts


def _columns(locator: Any) -> tuple[np.ndarray, ...]:
    return locator.places, locator.normals, locator.gain, locator.slope_to_contrast


def _joined(columns: list[tuple[np.ndarray, ...]]) -> dict[str, np.ndarray]:
    each = [np.concatenate(parts) for parts in zip(*columns, strict=True)]
    return _named("places", **dict(zip(("at", "normals", "gain", "slope_to_contrast"), each, strict=True)))


def _named(group: str, **arrays: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{group}.{name}": np.asarray(each) for name, each in arrays.items()}


def _tool(layout: Layout, estimator: str) -> SeparateEstimator:
    found = prepared(layout, estimator, 1.0)
    assert isinstance(found, SeparateEstimator)
    return found


def _least_contrast(layout: Layout, estimator: str) -> float:
    parts = _tool(layout, estimator).parts if layout.names else ()
    return next((part.locator.least_contrast for part in parts if part is not None), 0.0)


def _of_values(known: Measurands, layout: Layout, estimator: str) -> tuple[list[dict[str, Any]], str]:
    """What each value needs, and the formulas of all as Python."""
    names, facts, text = known.view.names, [], [_HEAD]
    for m, quantity in enumerate(known.quantities):
        slopes, lines = _formula(known, layout, estimator, quantity)
        text.append("\n".join([f"def value_{m}(p):", f'    """{quantity.kind}: {_quoted(quantity.name)}."""',
                               *(f"    {line}" for line in lines)]))  # fmt: skip
        facts.append({
            "edges": [names.index(name) for name in quantity.edges if name in names],
            "rims": [known.circles.index(name) for name in quantity.edges if name in known.circles],
            "slopes": slopes,
        })  # fmt: skip
    every = "".join(f"value_{m}, " for m in range(len(facts)))
    return facts, "\n\n\n".join([*text, f"FORMULAS = ({every})"]) + "\n"


_HEAD = '''"""Values of a part's measurands by what was found: generated by `ice export`.

Of ``p``, the offset (px) and slope of each edge's line and the errors of each circle, each function gives the value,
its derivatives, and sines of angles at which edges cross; None where the formula is another one.
"""

from math import atan2, cos, hypot, sin, sqrt, tan  # noqa: F401'''


def _quoted(name: str) -> str:
    return name.replace("\\", "\\\\").replace('"', '\\"')


def _formula(
    known: Measurands, layout: Layout, estimator: str, quantity: Quantity
) -> tuple[list[int], list[str]]:  # fmt: skip
    """By which numbers a value moves, and lines of Python that give value, derivatives and sines."""
    tape, edges = Tape(), len(known.view.names)
    given = numbers(tape.inputs(_nearby(known)))
    try:
        with np.errstate(all="ignore"):
            lines = _lines(layout, estimator, given[: 2 * edges])
            circles = tuple(given[known.seen.numbers(c)][None] for c in range(len(known.circles)))
            found = on_plane(found_in_images(known, layout, *lines, circles, {}), quantity)
            sines = [_sine(known, *lines, corner) for corner in quantity.crossings]
    except (TypeError, AttributeError) as error:
        raise InvalidInput(
            f"measurands must be of kinds whose formula can be written out, got {quantity.name} ({quantity.kind})"
        ) from error
    slopes = sorted(found.gradient)
    each = [found.value, *(found.gradient[k] for k in slopes), *sines]
    outputs = [np.ravel(one)[0] for one in each]
    return slopes, tape.code([one if isinstance(one, Number) else tape.constant(float(one)) for one in outputs])


def _nearby(known: Measurands) -> list[float]:
    """Numbers of a picture near the expected one, none of them 0: comparisons with these are those of all near."""
    edges, count = 2 * len(known.view.names), known.seen.count
    lines = [0.01 * (k + 1) if k % 2 == 0 else 1e-5 * (k + 1) for k in range(edges)]
    size = float(np.max(known.seen.radii, initial=0.0)) or 1.0
    return lines + [1e-5 * size * (k + 1) for k in range(count - edges)]


def _lines(layout: Layout, estimator: str, given: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals and points of the lines, (1, E, 2)."""
    if not layout.names:
        return np.empty((1, 0, 2)), np.empty((1, 0, 2))
    return line_equations(prepared(layout, estimator, 1.0).calipers, given[None, 0::2], given[None, 1::2])


def _sine(known: Measurands, normals: np.ndarray, points: np.ndarray, corner: Any) -> np.ndarray:
    pair = [known.view.names.index(name) for name in corner.edges]
    return intersect(normals[:, pair], points[:, pair])[1]


def _of_correction(told: Correction | None) -> tuple[dict[str, Any] | None, dict[str, np.ndarray]]:
    if told is None:
        return None, {}
    arrays = _named("correction", bias=told.bias, covariance=told.covariance)
    arrays |= _named("correction", **{f"sources.{k}": u for k, u in enumerate(told.sources.values())})
    if told.saturated is not None:
        arrays |= _named("correction", least=told.saturated[0], most=told.saturated[1])
    facts = {
        "simulated": list(told.simulated), "sources": list(told.sources), "limited": told.saturated is not None,
        "halves": [None if each.tolerance is None else each.tolerance.half for each in told.quantities],
        "adjusted": None,
    }  # fmt: skip
    if told.adjusted is not None:
        own = told.adjusted.adjustment
        names = ("at", "columns", "region", "variance", "normal", "spread")
        arrays |= _named("correction.adjusted", **{name: getattr(own, name) for name in names},
                         moved=told.adjusted.moved)  # fmt: skip
        facts["adjusted"] = {"side": own.side, "dark": own.dark, "names": list(told.adjusted.names)}
    return facts, arrays


def _of_budgets(picture: Picture, told: Correction | None) -> tuple[list[dict[str, Any]], bool]:
    """Facts of each characteristic, and whether they have budgets all together or not at all."""
    scene, count = picture.scene, len(picture.scene.quantities)
    budgets = [_budget(picture, told, scale) for scale in (1.0, 2.0)]
    known = requirements(picture, [1.0] * count, [0.0] * count, budgets[0], [status.OK] * count)
    groups = [g for g, each in enumerate(scene.measurands) for _ in each.quantities] or [0] * count
    rows, joint = [], joint_parts(scene.zones)
    for m, one in enumerate(known):
        variance, fourth, model = _of_budget([None if each is None else _of(each, one.name) for each in budgets])
        zone = one.tolerance
        rows.append({
            "name": one.name, "kind": one.kind, "unit": one.unit, "nominal": float(one.nominal),
            "tolerance": None if zone is None else [zone.plus, zone.minus], "alone": one.name not in joint,
            "group": groups[m], "variance": variance, "fourth": fourth, "model": model,
        })  # fmt: skip
    pattern = scene.uncertainty.fixed_pattern and (scene.noise.prnu > 0 or scene.noise.dsnu > 0)
    return rows, scene.task is not None or pattern


def _budget(picture: Picture, told: Correction | None, scale: float) -> Any:
    """The budget of values whose standard deviations by noise are a scale, by the GUM."""
    count = len(picture.scene.quantities)
    doubts = {} if told is None else {"doubts": np.zeros(count)}
    return measurable_budget(
        picture, statuses=[status.OK] * count, p=_P, variances=np.full(count, scale**2), **doubts
    )  # fmt: skip


def _of(found: Any, name: str) -> Any:
    return next((each for each in found if each.name == name), None)


def _of_budget(pair: list[Any]) -> tuple[float | None, float, list[float]]:
    """Variance of all rows but noise, bias and model, their u^4 / dof; the model's u, alone and per sigma."""
    if pair[0] is None:
        return None, 0.0, [0.0, 0.0]
    kept_rows = [
        row for row in pair[0].contributions if row.source not in (NOISE, MODEL) and not row.source.startswith(BIAS)
    ]
    variance = sum(row.contribution**2 for row in kept_rows)
    fourth = sum(row.contribution**4 / row.dof for row in kept_rows if np.isfinite(row.dof))
    one, two = (next((row.contribution for row in each.contributions if row.source == MODEL), 0.0) for each in pair)
    return float(variance), float(fourth), [float(2 * one - two), float(two - one)]
