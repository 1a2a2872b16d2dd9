"""Is the prediction true? One noise-free picture is rendered, exposed a thousand times, and every image measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenes import Scene
from scenes.results import finite
from scenes.status import doubt
from validation.batch.campaign import Case
from validation.batch.measurands import column
from validation.batch.work import Chunks, Clean, TaskResult, methods
from validation.defaults import DEFAULT_SEED
from validation.explore.state import State
from validation.remeasured import Sample, batches

RENDERS = 1000
CHUNK = 50  # images between two reports, and after which it can be stopped


def rendering(scene: Scene, state: State, variant: str) -> Chunks:
    """The work of rendering the picture, and of propagating its noise."""
    return Chunks(_case(scene, state), (), DEFAULT_SEED, variant)


def measuring(scene: Scene, state: State, variant: str, clean: Clean, renders: int = RENDERS) -> list[Chunks]:
    """The work of measuring so many images of it, in pieces."""
    case = _case(scene, state)
    return [Chunks(case, ((k, n),), DEFAULT_SEED, variant, clean.image) for k, n in enumerate(batches(renders, CHUNK))]


def _case(scene: Scene, state: State) -> Case:
    return Case(0, scene.model_copy(update={"settings": ()}), state.setting)


@dataclass(frozen=True)
class Proof:
    """A measurand as measured, beside its prediction; in the scene's unit or degrees.

    Attributes
    ----------
    name, unit : str
    calibrated, propagated, measured : float
        Standard deviations (not variances): predicted without and with the noise-free picture, and of the values.
    ratio : float
        Variance measured over propagated.
    interval : pair of float
        Its two-sided 95 % interval.
    n, failed : int
        Images, and those of them that gave no value.
    bias, predicted_bias : float
        Mean less the object's value.
    status : str
        That of the noise-free picture.
    values : tuple of float
        What was measured, to be drawn.
    """

    name: str
    unit: str
    calibrated: float
    propagated: float
    measured: float
    ratio: float
    interval: tuple[float, float]
    n: int
    failed: int
    bias: float
    predicted_bias: float
    status: str
    values: tuple[float, ...]

    @property
    def agrees(self) -> bool:
        """Whether 1 lies inside the interval; what is not trusted (`doubt`) is not proven by it."""
        return self.interval[0] <= 1 <= self.interval[1]


def proofs(scene: Scene, clean: Clean, found: list[TaskResult]) -> list[Proof]:
    """One for each measurand, from the measured pieces."""
    chunks = [chunk for each in found for chunk in each.chunks.values()]
    main = methods(scene)[0].name
    made = []
    for k, about in enumerate(clean.predicted["measurands"]):
        values = np.concatenate([chunk.distances[column(main, k)] for chunk in chunks])
        sample, (propagated, _, status) = Sample.of(values), clean.propagated[column(main, k)]
        made.append(
            Proof(
                name=about["name"], unit=about["unit"], calibrated=math.sqrt(about["calibrated"]),
                propagated=math.sqrt(propagated), measured=math.sqrt(sample.variance),
                ratio=sample.ratio(propagated), interval=sample.interval(propagated), n=sample.n, failed=sample.failed,
                bias=sample.mean - about["value"], predicted_bias=about["predicted_bias"], status=status,
                values=tuple(values[np.isfinite(values)].tolist()),
            )
        )  # fmt: skip
    return made


def to_message(proof: Proof) -> dict[str, Any]:
    """A proof as the page takes it: a histogram instead of the values; numbers that are not finite are null."""
    names = ("calibrated", "propagated", "measured", "ratio", "bias", "predicted_bias")
    numbers = {name: finite(getattr(proof, name)) for name in names}
    counts, edges = np.histogram(proof.values, bins=31) if len(proof.values) > 1 else (np.zeros(0, int), np.zeros(0))
    return {
        "name": proof.name, "unit": proof.unit, "n": proof.n, "failed": proof.failed, "status": proof.status,
        "doubt": doubt(proof.status),
        "interval": [finite(end) for end in proof.interval], "agrees": proof.agrees, **numbers,
        "mean": finite(float(np.mean(proof.values))) if proof.values else None,
        "counts": counts.tolist(), "edges": edges.tolist(),
    }  # fmt: skip
