"""What measures a picture by an exported recipe: edges and circles, values, covariance, status, U and decision.

NumPy alone. `validation.recipe.export` writes what it reads: `facts.json`, `arrays.npz` and `formulas.py`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.util import module_from_spec, spec_from_file_location
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from measure.adjustment import Adjusted, Adjustment
from measure.covariances import less_bias, of_measured, spread
from measure.features.aligned import Aligned
from measure.features.rim_fit import Curve, RimFit
from measure.known_bias import Correction
from scenes import status
from validation.recipe.edges import Edges
from validation.recipe.places import Places, SideBySide
from validation.recipe.rims import Rim, RimOptics, Rims
from validation.recipe.sensor import Sensor
from validation.recipe.told import Characteristic, Coverage, known, with_budget

DISPLACED = "displaced"
"""Status of a value whose edges or circles lie where a recipe of one place does not look."""

_BRIGHTEST, _TINY = 1e15, 1e-15  # grey levels; below the latter all of a picture is 0

Formula = Callable[[list[float]], tuple[float, ...] | None]


@dataclass(frozen=True, eq=False)
class Value:
    """How one value follows from the numbers of edges and circles.

    Attributes
    ----------
    edges, rims : tuple of int
        Which it needs.
    formula : callable
        Gives of all numbers the value, its derivatives by ``slopes``, and sines of the angles at which edges cross.
    slopes : ndarray of int
    """

    edges: tuple[int, ...]
    rims: tuple[int, ...]
    formula: Formula
    slopes: np.ndarray


@dataclass(frozen=True, eq=False)
class Recipe:
    """Everything that does not depend on the picture.

    Attributes
    ----------
    facts : dict
        As `facts.json` has them.
    pixels : ndarray of int, shape (P,)
        Flat indices of all pixels that are read.
    edges : Edges
    rims : Rims
    values : tuple of Value
    characteristics : tuple of Characteristic
    coverage : Coverage
    correction : Correction or None
        None where no bias is taken off.
    sensor : Sensor
    """

    facts: Mapping[str, Any]
    pixels: np.ndarray
    edges: Edges
    rims: Rims
    values: tuple[Value, ...]
    characteristics: tuple[Characteristic, ...]
    coverage: Coverage
    correction: Correction | None
    sensor: Sensor

    @classmethod
    def load(cls, folder: Path) -> Recipe:
        """Of a folder that an export wrote."""
        facts = json.loads((folder / "facts.json").read_text(encoding="utf-8"))
        with np.load(folder / "arrays.npz", allow_pickle=False) as archive:
            arrays = dict(archive)
        sensor = Sensor(**{name: math.inf if value is None else value for name, value in facts["sensor"].items()})
        pixels, places = _places(facts, arrays)
        shown = arrays["edges.shown"].size
        rims = (
            _rim(k, *each, arrays, sensor) for k, each in enumerate(zip(facts["rims"], places[shown:], strict=True))
        )
        return cls(
            facts, pixels, _edges(facts, arrays, SideBySide(places[:shown]), sensor), Rims(tuple(rims)),
            _values(facts, folder), _characteristics(facts), Coverage(tuple(facts["factors"]), facts["normal"]),
            _correction(facts, arrays), sensor,
        )  # fmt: skip

    def measure(self, image: np.ndarray) -> dict[str, Any]:
        """The measurands of one picture.

        Parameters
        ----------
        image : ndarray, shape (height, width)
            Grey levels as recorded, whole numbers or float.

        Returns
        -------
        dict
            ``measurands``: of each its name, kind, unit, value with its bias taken off, sigma (standard deviation by
            noise), bias, u_bias, u (both together), nominal, tolerance, U (95 %), decision, status; None is what is
            not known. ``covariance``: of all values, by noise.

        Raises
        ------
        ValueError
            If it is no picture of the camera's size.
        """
        image = self._checked(image)
        with np.errstate(all="ignore"):  # what is not found is no number
            return self._measured(image)

    def _measured(self, image: np.ndarray) -> dict[str, Any]:
        seen = self.sensor.seen(image.take(self.pixels))
        edges, rims = self.edges.find(seen, image), self.rims.find(seen)
        states = [self._state(each, edges, rims) for each in self.values]
        numbers = np.concatenate([edges.lines.ravel(), *(rim.errors for rim in rims)])
        value, rows = self._evaluated(states, numbers)
        errors = self._joined(edges.covariance, [rim.covariance for rim in rims])
        measured = _are(states, status.MEASURED)
        covariance = of_measured(spread(rows[None], errors[None]), measured[None])[0]
        return self._told(value, covariance, states, image, seen.saturated)

    def _checked(self, image: Any) -> np.ndarray:
        array, shape = np.asarray(image), tuple(self.facts["shape"])
        if array.dtype.kind not in "biuf":
            raise ValueError(f"image must be of real numbers, got {array.dtype}")
        if array.shape != shape:
            raise ValueError(f"image must be of the camera's size {shape[1]} x {shape[0]}, got shape {array.shape}")
        if array.dtype.kind != "f":
            return array
        low, high = float(array.min()), float(array.max())
        if not (math.isfinite(low) and math.isfinite(high)):
            raise ValueError("image must be of finite numbers, got NaN or infinity")
        if max(-low, high) > _BRIGHTEST:
            raise ValueError(f"image must be of grey levels up to {_BRIGHTEST:g}, got {max(-low, high):.3g}")
        return array if max(-low, high) >= _TINY else np.zeros_like(array)

    def _state(self, value: Value, edges: Any, rims: list[Any]) -> str:
        """The worst of what it needs."""
        if (value.edges and edges.displaced) or any(rims[c].displaced for c in value.rims):
            return DISPLACED
        return status.worst(*(edges.states[e] for e in value.edges), *(rims[c].state for c in value.rims))

    def _joined(self, lines: np.ndarray, rims: list[np.ndarray]) -> np.ndarray:
        """Covariance of lines and circles, which count as independent."""
        parts = self._numbers
        whole = np.zeros((parts[-1].stop, parts[-1].stop))
        for part, block in zip(parts, [lines, *rims], strict=True):
            whole[part, part] = block
        return whole

    @cached_property
    def _numbers(self) -> list[slice]:
        """Which numbers are the lines' and each circle's."""
        counts = [2 * len(self.edges.fixed), *(rim.fit.design.shape[1] for rim in self.rims.each)]
        ends = np.cumsum([0, *counts]).tolist()
        return [slice(*pair) for pair in pairwise(ends)]

    def _evaluated(self, states: list[str], numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (M,), NaN where there is none, and their derivatives (M, q); ``states`` change where edges that cross
        are nearly parallel, or a formula is followed no farther."""
        value, rows = np.full(len(states), np.nan), np.zeros((len(states), numbers.size))
        given = numbers.tolist()
        for m, each in enumerate(self.values):
            if states[m] not in status.MEASURED:
                continue
            try:
                found = each.formula(given)
            except (ZeroDivisionError, ValueError, OverflowError):
                found = None
            if found is None:
                states[m] = DISPLACED
                continue
            value[m], rows[m, each.slopes] = found[0], found[1 : 1 + len(each.slopes)]
            if any(abs(sine) < self.facts["least_sine"] for sine in found[1 + len(each.slopes) :]):
                states[m] = status.worst(states[m], status.ILL_CONDITIONED)
        value[~_are(states, status.MEASURED)] = np.nan
        return value, rows

    def _told(
        self, value: np.ndarray, covariance: np.ndarray, states: list[str], image: np.ndarray, saturated: int
    ) -> dict[str, Any]:
        """With the bias taken off, U and decision."""
        off, u_bias, told = np.zeros(len(value)), None, self.correction
        if told is not None and np.isfinite(value).any():
            (off,), _, (u_bias,) = told.of_images(image[None])
            (of,) = told.is_of(np.array([saturated]))
            doubtful = _are(states, (status.CLUTTER, status.MISFIT))
            states = _after(told, states, of, u_bias)
            off, u_bias = np.where(np.isnan(off), 0.0, off), np.where(of, u_bias, np.inf)
            measured = _are(states, status.MEASURED)
            value, covariance = less_bias(value, covariance, off, told.covariance, doubtful, measured)
        sigma = np.sqrt(np.diag(covariance))
        there = with_budget(self.characteristics, sigma.tolist(), self.facts["whole"])
        doubts = [None] * len(value) if u_bias is None else u_bias.tolist()
        each = zip(value.tolist(), sigma.tolist(), zip(off.tolist(), doubts, strict=True), there, states, strict=True)
        rows = [_row(one, self.coverage, *own) for one, own in zip(self.characteristics, each, strict=True)]
        return {"measurands": rows, "covariance": [[known(each) for each in row] for row in covariance.tolist()]}


def _row(
    one: Characteristic, coverage: Coverage, value: float, sigma: float, bias: tuple[float, float | None], there: bool,
    state: str,
) -> dict[str, Any]:  # fmt: skip
    """A value as it is told; ``there``: it has a budget."""
    (off, u_bias), good = bias, math.isfinite(value)
    U = one.expanded(sigma, u_bias, coverage) if there and math.isfinite(sigma) else None
    u = math.inf if u_bias is None else math.hypot(sigma, u_bias)
    sure = good and math.isfinite(u)
    return {
        "name": one.name, "kind": one.kind, "unit": one.unit, "value": known(value),
        "sigma": known(sigma) if good else None, "bias": off if sure else None, "u_bias": u_bias if sure else None,
        "u": u if sure else None, "nominal": one.nominal,
        "tolerance": one.tolerance and dict(zip(("plus", "minus"), one.tolerance, strict=True)), "U": U,
        "decision": one.decided(value, U, state), "status": state,
    }  # fmt: skip


def _are(states: list[str], some: tuple[str, ...]) -> np.ndarray:
    """Which of statuses are among some, bool (M,)."""
    return np.array([state in some for state in states])


def _after(told: Correction, states: list[str], of: np.ndarray, u_bias: np.ndarray) -> list[str]:
    """Statuses that the correction leaves."""
    found = told.status_of([status.NOT_VISIBLE if state == DISPLACED else state for state in states], of, u_bias)
    return [DISPLACED if before == DISPLACED else after for before, after in zip(states, found, strict=True)]


def _places(facts: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> tuple[np.ndarray, tuple[Places, ...]]:
    """All pixels that are read, and the places of the edges and of the rims, among these."""
    columns = [arrays[f"places.{name}"] for name in ("at", "normals", "gain", "slope_to_contrast")]
    parts = (*pairwise(arrays["edges.starts"].tolist()), *(rim["part"] for rim in facts["rims"]))
    each = (tuple(column[start:stop] for column in columns) for start, stop in parts)
    found = [Places.of(*some, tuple(facts["locator"]), tuple(facts["shape"])) for some in each]
    pixels = np.unique(np.concatenate([places.near.ravel() for places in found]))
    return pixels, tuple(places.among(pixels) for places in found)


def _edges(facts: Mapping[str, Any], arrays: Mapping[str, np.ndarray], places: SideBySide, sensor: Sensor) -> Edges:
    names = ("pixels", "slope", "candidates", "places")
    aligned = Aligned(*(arrays[f"aligned.{name}"] for name in names)) if "aligned.pixels" in arrays else None
    own = (arrays[f"edges.{name}"] for name in ("fixed", "lengths", "shown", "starts", "along"))
    return Edges(*own, places, sensor, tuple(facts["limits"]), aligned)


def _rim(k: int, one: Mapping[str, Any], places: Places, arrays: Mapping[str, np.ndarray], sensor: Sensor) -> Rim:
    def array(name: str) -> np.ndarray | None:
        return arrays.get(f"rims.{k}.{name}")

    blur = array("blur")
    optics = RimOptics(sensor.noise_variance, one["scale_px"], one["blur_px"] if blur is None else blur)
    along = array("along")
    curve = along if along is None else Curve(array("places"), array("normals"), places.gain, along, array("bend"))
    numbers = (array(name) for name in ("design", "weights", "inward"))
    return Rim(RimFit(*numbers, one["state"], optics, curve, array("contrast")), places, array("signs"), sensor)


def _values(facts: Mapping[str, Any], folder: Path) -> tuple[Value, ...]:
    spec = spec_from_file_location("formulas", folder / "formulas.py")
    formulas = module_from_spec(spec)
    spec.loader.exec_module(formulas)
    each = zip(facts["values"], formulas.FORMULAS, strict=True)
    return tuple(
        Value(tuple(of["edges"]), tuple(of["rims"]), formula, np.array(of["slopes"], int)) for of, formula in each
    )  # fmt: skip


def _characteristics(facts: Mapping[str, Any]) -> tuple[Characteristic, ...]:
    return tuple(
        Characteristic(
            **one | {"model": tuple(one["model"]), "tolerance": one["tolerance"] and tuple(one["tolerance"])}
        )
        for one in facts["characteristics"]
    )


def _correction(facts: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Correction | None:
    told = facts["correction"]
    if told is None:
        return None
    halves = [SimpleNamespace(tolerance=half and SimpleNamespace(half=half)) for half in told["halves"]]

    def array(name: str) -> np.ndarray:
        return arrays[f"correction.{name}"]

    sources = {name: array(f"sources.{k}") for k, name in enumerate(told["sources"])}
    limits = (array("least"), array("most")) if told["limited"] else None
    return Correction(
        tuple(halves), facts["estimator"], None, array("bias"), array("bias"), sources, sources, array("covariance"),
        array("covariance"), tuple(told["simulated"]), saturated=limits, adjusted=_adjusted(told["adjusted"], array),
    )  # fmt: skip


def _adjusted(told: Mapping[str, Any] | None, array: Callable[[str], np.ndarray]) -> Adjusted | None:
    if told is None:
        return None
    names = ("at", "columns", "region", "variance", "normal", "spread")
    adjustment = Adjustment(told["side"], *(array(f"adjusted.{name}") for name in names), told["dark"])
    return Adjusted(adjustment, tuple(told["names"]), array("adjusted.moved"), array("adjusted.moved"))
