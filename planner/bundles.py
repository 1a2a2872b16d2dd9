"""How precisely several pictures, adjusted together, will let the scene's quantities be measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.bundles.biases import FeatureBias, corrected, covariances
from imaging.bundles.bundle import Bundle
from imaging.bundles.preferred import Preferred
from imaging.bundles.unknowns import Axes, Cameras, Freedom, Sensors, Shape
from imaging.models import DEFAULT_MODEL, ModelName, variance_model
from imaging.models.arranged import arranged, is_arranged
from imaging.models.bias import cluttered
from imaging.models.errors import Errors
from imaging.pictures import Pictures
from planner.ranks import feature_ranks
from scenes import InvalidInput, Picture, Quantity, status
from scenes.results import Shown, finite


@dataclass(frozen=True, eq=False, repr=False)
class BundlePrediction(Shown):
    """M quantities of V pictures adjusted together.

    Attributes
    ----------
    quantities : tuple of Quantity
    units : tuple of str
        Of the values: the scene's unit of length, or degrees.
    value : ndarray, shape (M,)
        The object's own.
    covariance : ndarray, shape (M, M)
        Joint covariance (not sigmas) by noise; infinite on the diagonal of what is not told, NaN beside it.
    known_before : dict
        Standard uncertainties (M,) by what is not known before of the ``part``, of ``sensor 1``, ..., of datums.
    status : tuple of str
        As of `measure.bundle`; ``glanced`` in place of ``ok`` where nobody has looked for a bias.
    reason : tuple of str
        Why it is not told; empty where it is.
    pictures : tuple of Picture
    preferred : Preferred
        The adjustments, with the values' derivatives by lines and circles of each picture.
    doubts : dict of str to ndarray, shape (M,), or None
        Where biases are taken off: standard uncertainties of that by source; infinite where one is not known.
    """

    quantities: tuple[Quantity, ...]
    units: tuple[str, ...]
    value: np.ndarray
    covariance: np.ndarray
    known_before: dict[str, np.ndarray]
    status: tuple[str, ...]
    reason: tuple[str, ...]
    pictures: tuple[Picture, ...]
    preferred: Preferred
    doubts: dict[str, np.ndarray] | None = None

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviations by noise, (M,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def u_placed(self) -> np.ndarray:
        """Standard uncertainties (not variances) by all that is not known before, (M,)."""
        return self.preferred.u_placed

    @property
    def u(self) -> np.ndarray:
        """Of both together, (M,), and of the biases' correction where there is one."""
        return np.hypot(np.hypot(self.sigma, self.u_placed), self.u_bias)

    @property
    def u_bias(self) -> np.ndarray:
        """Standard uncertainties (M,) of what is taken off as bias; 0 where nothing is."""
        return np.sqrt(sum((u**2 for u in (self.doubts or {}).values()), np.zeros(len(self.value))))

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a quantity."""
        columns = zip(
            self.quantities, self.units, self.value, self.sigma, self.u_placed, self.u, self.status, strict=True
        )
        return [
            {
                "scene": self.pictures[0].scene.name, "pictures": len(self.pictures), "name": each.name,
                "kind": each.kind, "unit": unit, "value": float(value), "sigma": finite(sigma),
                "u_placed": finite(placed), "u": finite(u), "status": state,
            }
            for each, unit, value, sigma, placed, u, state in columns
        ]  # fmt: skip

    def _line(self) -> str:
        told = (f"{row['name']} u {row['u']:.3g} {row['unit']}" for row in self.as_rows() if row["u"] is not None)
        return f"{len(self.pictures)} pictures: {'; '.join(told)}"


def predict_bundle(
    pictures: Sequence[Picture],
    sensors: Sensors | tuple[Sensors, ...] = "uncertain",
    *,
    shape: Shape = "in_space",
    axes: Axes = "known",
    cameras: Cameras = "one",
    model: ModelName | None = None,
    close: bool = True,
    biases: Sequence[FeatureBias | None] | None = None,
) -> BundlePrediction:
    """Predict several pictures of one part that are adjusted together, its own features the ties.

    Parameters
    ----------
    pictures : sequence of Picture
    sensors, shape, axes, cameras
        What is not known before (`imaging.bundles.unknowns.Freedom`).
    model : {"calibrated", "paper"}, optional
        Of the lines' and circles' variances, which are those of ``gradient`` by the first; by default as the estimator
        has them that `measure.bundle` takes (`imaging.models.arranged`).
    close : bool
        Whether biases are looked for (ray tracing), which leaves out what is ``clutter`` wherever that can be done.
    biases : sequence of FeatureBias or None, optional
        Of each picture's lines and circles, found by simulation, to be taken off (`measure.Correction.features`); noise
        is then that of the simulated picture. None of a picture of which they are not known.

    Raises
    ------
    InvalidInput
        If the pictures are not of one part with the same measurands, or an argument is none of its choices.

    Examples
    --------
    >>> import scenes
    >>> plate = scenes.load("plate")
    >>> two = [Picture.of(plate, sensor, (20, 225)) for sensor in ((30, 60), (30, 240))]
    >>> told = predict_bundle(two, "known")
    >>> told.status[0], bool(told.sigma[0] > 0)
    ('ok', True)
    """
    if model not in (None, "calibrated", "paper"):
        raise InvalidInput(f"model must be one of calibrated, paper for several pictures, got {model!r}")
    bundle = Bundle.of(pictures, Freedom(sensors, shape, axes, cameras))
    noise, states = zip(*(_told(picture, model, close=close) for picture in bundle.pictures), strict=True)
    if biases is None:
        chosen = Preferred.of(bundle, noise, states)
        said, doubts = chosen.statuses(states), None
    else:
        chosen, said = _corrected(bundle, noise, biases)
        close, doubts = True, chosen.doubts(biases)
    scene = bundle.unknowns.scene
    return BundlePrediction(
        quantities=bundle.quantities,
        units=tuple(scene.unit_of(quantity) for quantity in bundle.quantities),
        value=bundle.nominal[0],
        covariance=chosen.covariance,
        known_before=chosen.known_before,
        status=said if close else tuple(status.GLANCED if each == status.OK else each for each in said),
        reason=chosen.reasons,
        pictures=bundle.pictures,
        preferred=chosen,
        doubts=doubts,
    )


def _told(picture: Picture, model: ModelName | None, *, close: bool) -> tuple[np.ndarray, np.ndarray]:
    """Covariance (q, q) of one picture's lines and circles, and their statuses (E + C,); ``close``: with biases, which
    ``arrangement`` is without."""
    pictures = Pictures.of(picture)
    errors, together = variance_model(model or DEFAULT_MODEL)(pictures), model is None and is_arranged(picture.scene)
    noise = arranged(pictures) if together else errors.of_features
    return noise, states_of(errors, picture, close=close and not together)


def _corrected(
    bundle: Bundle, noise: Sequence[np.ndarray], biases: Sequence[FeatureBias | None]
) -> tuple[Preferred, tuple[str, ...]]:
    """The adjustments of lines and circles whose biases are taken off, and the values' statuses."""
    if len(biases) != len(bundle.pictures):
        raise InvalidInput(f"biases must be one for each of {len(bundle.pictures)} pictures, got {len(biases)}")
    states, errors = [], []
    for seen, own, one in zip(bundle.seen, noise, biases, strict=True):
        errors.append(own if one is None else one.errors)
        count = len(seen.names) + len(seen.circles)
        states.append(
            np.full(count, status.CLUTTER)
            if one is None
            else one.states_of(one.states, ~seen.features_of(~one.is_known))
        )
    chosen = Preferred.of(bundle, errors, states, covariances(biases, errors))
    u_bias, sigma = chosen.biased(biases)[1], np.sqrt(np.diag(chosen.covariance))
    return chosen, corrected(chosen.statuses(states), u_bias, sigma, bundle.quantities)


def states_of(errors: Errors, picture: Picture, *, close: bool) -> np.ndarray:
    """Status of each edge and circle of one picture, (E + C,); ``close``: biases are looked for."""
    names = errors.measurands.view.names
    clutter = cluttered(Pictures.of(picture)) if close else np.zeros(len(names), bool)
    return np.array([status.WORST_FIRST[rank] for rank in feature_ranks(errors, clutter)])
