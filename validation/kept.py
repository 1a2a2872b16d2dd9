"""Corrections kept on disk, so that the next picture of the same setting waits for no render.

One small JSON file a picture and method, in the user's folder for what can be made anew: ``ice-vision`` in
``$XDG_CACHE_HOME``, or in ``~/.cache`` where that is not set. Its name is a digest of all that the numbers depend on,
the program's code included. A file that is not as it was written is made anew; a folder that cannot be written to keeps
nothing.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

import imaging
import measure
import render
import scenes
from imaging.bundles.biases import FeatureBias
from imaging.features.measurand import measurands
from imaging.pictures import Pictures
from measure import Correction
from measure.adjustment import Adjusted, Adjustment
from render import variant as variants
from scenes import ImageTexture, Picture
from scenes.status import ALL
from validation import simulation
from validation.code_digest import digest
from validation.remeasured import Method
from validation.simulation import How

_LARGEST = 1 << 24  # bytes of a file
_Numbers = list[float | None]


class _Adjusted(BaseModel):
    """A `measure.adjustment.Adjusted` of k inputs by n blocks; null is NaN."""

    model_config = ConfigDict(extra="forbid")

    side: Annotated[int, Field(ge=1, le=1 << 20)]
    at: list[tuple[int, int]]
    columns: list[list[float]]
    region: list[int]
    variance: list[Annotated[float, Field(gt=0)]]
    normal: list[list[list[float]]]
    spread: list[list[list[float]]]
    dark: float
    names: list[Annotated[str, Field(max_length=40)]]
    moved: list[_Numbers]
    moved_image: list[_Numbers]

    def made(self, count: int) -> Adjusted | None:
        """Of so many values; None where it is not as it was written."""
        n, k = len(self.at), len(self.names)
        values = *self.moved, *self.moved_image
        whole = len(self.columns) == len(self.region) == len(self.variance) == n
        squares = *self.normal, *self.spread
        whole &= len(self.moved) == len(self.moved_image) == k and len(squares) == 2 * len(set(self.region))
        whole &= all(len(row) == k + 1 for row in self.columns) and len(self.normal) == len(self.spread)
        whole &= all(len(square) == k and all(len(row) == k for row in square) for square in squares)
        whole &= all(len(row) == count for row in values)
        if not whole:
            return None
        numbers = (np.array(each, float) for each in (self.variance, self.normal, self.spread))
        at, region = (np.array(each, int) for each in (self.at, self.region))
        adjustment = Adjustment(self.side, at, np.array(self.columns, float), region, *numbers, self.dark)
        moved = (np.array([_array(row) for row in each]) for each in (self.moved, self.moved_image))
        return Adjusted(adjustment, tuple(self.names), *moved)

    @staticmethod
    def facts(found: Adjusted) -> dict[str, Any]:
        """What is written of it."""
        own = {key: getattr(found, key) for key in ("names", "moved", "moved_image")}
        return {**vars(found.adjustment), **own}


class _Features(BaseModel):
    """A `FeatureBias` of q numbers; null is NaN, or infinite where it is an uncertainty."""

    model_config = ConfigDict(extra="forbid")

    bias: _Numbers
    moved: dict[str, list[_Numbers]]
    rendering: list[_Numbers]
    errors: list[_Numbers]
    states: list[Annotated[str, Field(max_length=40)]]
    saturated: tuple[float, float | None]

    def made(self, features: int) -> FeatureBias | None:
        """Of so many edges and circles; None where it is not as it was written."""
        bias, count = _array(self.bias), len(self.bias)
        moved = {
            n: np.array([_array(row, np.inf) for row in rows]).reshape(-1, count) for n, rows in self.moved.items()
        }
        if any(len(row) != count for row in (*self.rendering, *self.errors)):
            return None
        rendering, errors = np.array([_array(row, np.inf) for row in self.rendering]), _square(self.errors)
        if {rendering.shape, errors.shape} != {(count, count)} or not set(self.states) <= ALL:
            return None
        if len(self.states) != features:
            return None
        least, most = self.saturated
        ends = least, np.inf if most is None else most
        return FeatureBias(bias, moved, rendering, errors, tuple(self.states), ends)


class _Kept(BaseModel):
    """A `Correction` of M measurands; null is NaN, or infinite where it is a standard uncertainty."""

    model_config = ConfigDict(extra="forbid")

    bias: _Numbers
    bias_image: _Numbers
    sources: dict[str, _Numbers]
    sources_image: dict[str, _Numbers]
    covariance: list[_Numbers]
    covariance_image: list[_Numbers]
    simulated: list[Annotated[str, Field(max_length=40)]]
    renders: Annotated[int, Field(ge=1, le=1000)]
    saturated: tuple[_Numbers, _Numbers] | None
    """Least and most; null where there is no most."""
    adjusted: _Adjusted | None
    features: _Features | None


def correction(picture: Picture, method: Method, how: How = How()) -> Correction:
    """As `validation.simulation.simulated`, from disk where it has been made before."""
    file = folder() / f"{_digest(picture, method, how)}.json"
    found = _read(file, picture, method)
    if found is None:
        found = simulation.simulated(picture, method, how)
        _write(file, found)
    return found


def folder() -> Path:
    """Where they are kept."""
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (given if given.is_absolute() else Path.home() / ".cache") / "ice-vision" / "corrections"


def _digest(picture: Picture, method: Method, how: How) -> str:
    said = {
        "scene": picture.scene.model_dump(mode="json", by_alias=True),
        "sensor": list(picture.sensor),
        "lights": [list(pose) for pose in picture.lights],
        "method": asdict(method),
        "how": asdict(how) | {"variant": how.variant or variants.choose()},
    }
    made = hashlib.sha256(json.dumps(said, sort_keys=True, default=str).encode())
    bodies = picture.scene.bodies
    for part in (bodies.vertices, bodies.triangles):
        made.update(np.ascontiguousarray(part).tobytes())
    made.update(repr(picture.scene.solid.curved).encode())
    for texture in picture.scene.textures:
        if isinstance(texture, ImageTexture):  # whose file may have changed
            made.update(np.ascontiguousarray(texture.levels).tobytes())
    made.update(_code())
    return made.hexdigest()[:32]


@functools.cache
def _code() -> bytes:
    """Digest of the code that makes the numbers."""
    return digest((scenes, imaging, render, measure, simulation))


def _read(file: Path, picture: Picture, method: Method) -> Correction | None:
    """None where there is none, or it is not as it was written."""
    try:
        if file.stat().st_size > _LARGEST:
            return None
        kept = _Kept.model_validate_json(file.read_bytes())
    except (OSError, ValidationError):
        return None
    quantities, count = picture.scene.quantities, len(picture.scene.quantities)
    found = Correction(
        quantities, method.locator, method.threshold, _array(kept.bias), _array(kept.bias_image),
        {name: _array(some, np.inf) for name, some in kept.sources.items()},
        {name: _array(some, np.inf) for name, some in kept.sources_image.items()},
        *(_square(rows) for rows in (kept.covariance, kept.covariance_image)), tuple(kept.simulated), kept.renders,
        saturated=kept.saturated and tuple(_array(limit, np.inf) for limit in kept.saturated),
        adjusted=kept.adjusted and kept.adjusted.made(count),
        features=kept.features and kept.features.made(_count(picture)),
    )  # fmt: skip
    vectors = (
        found.bias, found.bias_image, *found.sources.values(), *found.sources_image.values(), *(found.saturated or ()),
    )  # fmt: skip
    whole = all(each.shape == (count,) for each in vectors) and (kept.adjusted is None) == (found.adjusted is None)
    whole &= (kept.features is None) == (found.features is None)
    whole &= all(each.shape == (count, count) for each in (found.covariance, found.covariance_image))
    return found if whole and len(found.simulated) == count and set(found.simulated) <= ALL else None


def _count(picture: Picture) -> int:
    """Of edges and circles that are measured."""
    known = measurands(Pictures.of(picture))
    return len(known.view.names) + len(known.circles)


def _square(rows: list[_Numbers]) -> np.ndarray:
    """A covariance, infinite on its diagonal where there is no value."""
    if len({len(row) for row in rows}) != 1:
        return np.zeros((0, 0))
    told = np.array([_array(row) for row in rows])
    diagonal = np.eye(*told.shape, dtype=bool)
    return np.where(np.isnan(told) & diagonal, np.inf, told)


def _array(numbers: _Numbers, nothing: float = np.nan) -> np.ndarray:
    return np.array([nothing if number is None else number for number in numbers], float)


def _write(file: Path, found: Correction) -> None:
    facts = {
        "bias": found.bias, "bias_image": found.bias_image, "sources": found.sources,
        "sources_image": found.sources_image, "covariance": found.covariance,
        "covariance_image": found.covariance_image, "simulated": list(found.simulated), "renders": found.renders,
        "saturated": found.saturated and list(found.saturated),
        "adjusted": found.adjusted and _Adjusted.facts(found.adjusted),
        "features": found.features and vars(found.features),
    }  # fmt: skip
    part = file.with_suffix(f".{os.getpid()}")
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(json.dumps(_plain(facts)), encoding="utf-8")
        part.replace(file)


def _plain(value):
    """Lists of numbers; null for what is not finite."""
    if isinstance(value, dict):
        return {name: _plain(inner) for name, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if isinstance(value, np.ndarray):
        finite = value if value.dtype.kind == "i" else np.where(np.isfinite(value), value.astype(object), None)
        return finite.tolist()
    return value
