"""Several pictures of one part measured together: features found in each, adjusted with the sensors' places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtrc

from imaging.bundles.bundle import Bundle
from imaging.bundles.preferred import Preferred
from imaging.bundles.unknowns import Axes, Cameras, Freedom, Sensors, Shape
from measure.best import best_estimator
from measure.covariances import of_measured
from measure.goodness import WORST
from measure.measurement import checked_image
from measure.quantities import MeasuredFeatures, find
from scenes import InvalidInput, Picture, Quantity, status
from scenes.results import Shown, finite, value

_STEPS = 6
_SETTLED = 0.02  # px that an adjustment still moves what is seen: what is not linear in it is then far below the noise


@dataclass(frozen=True, eq=False, repr=False)
class Bundled(Shown):
    """M quantities measured in V pictures together, or in stacks of leading shape (...); one set has the shape ().

    Attributes
    ----------
    quantities : tuple of Quantity
    units : tuple of str
        Of `value`: the scene's unit of length, or degrees.
    nominal : ndarray, shape (M,)
        The scene's nominal values, or the object's own.
    value : ndarray, shape (..., M)
        In space; NaN where the status is none of those with a value, or ``unplaced``.
    covariance : ndarray, shape (..., M, M)
        Joint covariance (not sigmas) by noise; infinite on the diagonal where there is no value, NaN beside it.
    u_placed : ndarray, shape (..., M)
        Standard uncertainty (not variance) by what is not known before of the part's, the sensors' and the datums'
        places.
    known_before : dict
        The same of each alone, (..., M), by its name: ``part``, ``sensor 1``, ..., a datum's vertices and circles.
    status : ndarray of str, shape (..., M)
        ``ok``; ``clutter`` where it needs lines or circles that are biased; ``misfit`` where the pictures do not fit
        each other (chi-square of what is ``ok``, p < 1e-4); ``unplaced`` where they leave it open; else what its
        features lack.
    p_value : ndarray, shape (...)
        Of the chi-square; 1 where nothing is seen twice.
    reason : tuple of str
        Of each quantity in the first set, why it is not told; empty where it is.
    pictures : tuple of Picture
        As the first set shows them: with part and sensors where they were found, to a few hundredths of a px.
    places : ndarray, shape (..., P, 3)
        The vertices and centres of the part in space, turned and shifted to lie as the model's, the scene's unit.
    points : tuple of str
        Their names.
    """

    quantities: tuple[Quantity, ...]
    units: tuple[str, ...]
    nominal: np.ndarray
    value: np.ndarray
    covariance: np.ndarray
    u_placed: np.ndarray
    known_before: dict[str, np.ndarray]
    status: np.ndarray
    p_value: np.ndarray
    reason: tuple[str, ...]
    pictures: tuple[Picture, ...]
    places: np.ndarray
    points: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(quantity.name for quantity in self.quantities)

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviation of `value` by noise, shape (..., M)."""
        return np.sqrt(np.einsum("...mm->...m", self.covariance))

    @property
    def u(self) -> np.ndarray:
        """Of noise and of what is not known before together, shape (..., M)."""
        return np.hypot(self.sigma, self.u_placed)

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a set and measurand: value, sigma, u, status; None: there is none."""
        count = len(self.quantities)
        columns = (each.reshape(-1, count) for each in (self.value, self.sigma, self.u_placed, self.u, self.status))
        return [
            {
                "scene": self.pictures[0].scene.name, "pictures": len(self.pictures), "image": i, "name": each.name,
                "kind": each.kind, "unit": self.units[m], "value": finite(values[m]), "sigma": finite(sigmas[m]),
                "u_placed": finite(before[m]), "u": finite(both[m]), "nominal": float(self.nominal[m]),
                "status": str(states[m]),
            }
            for i, (values, sigmas, before, both, states) in enumerate(zip(*columns, strict=True))
            for m, each in enumerate(self.quantities)
        ]  # fmt: skip

    def _line(self) -> str:
        rows = self.as_rows()[: len(self.quantities)]
        told = (
            f"{row['name']} {row['status']}" if row["value"] is None
            else f"{row['name']} {value(row['value'], row['u'], row['unit'])}, {row['status']}" for row in rows
        )  # fmt: skip
        return f"{len(self.pictures)} pictures: {'; '.join(told)}"


def bundle(
    shots: Sequence[tuple[np.ndarray, Picture]],
    sensors: Sensors | tuple[Sensors, ...] = "uncertain",
    *,
    shape: Shape = "in_space",
    axes: Axes = "known",
    cameras: Cameras = "one",
    estimator: str | None = None,
) -> Bundled:
    """Measure several pictures of one part together (bundle adjustment), its own features the ties.

    Parameters
    ----------
    shots : sequence of (ndarray, Picture)
        Images, shape (..., height, width), and what each shows: sensor, light, and the part about where it lies, within
        the capture of the locator.
    sensors, shape, axes, cameras
        What is not known before (`imaging.bundles.unknowns.Freedom`).
    estimator : str, optional
        As for `measure.measure`.

    Raises
    ------
    InvalidInput
        If the pictures are not of one part with the same measurands, or the images not of one leading shape.

    Notes
    -----
    The part's place counts as known to ``uncertainty.part_shift`` and ``part_tilt_deg``, datums on it to
    ``placement.datum_sd``. Part and sensors are expected anew, and looked for again, until that moves nothing by more
    than 0.02 px; of stacks where the mean of all images puts them.

    Examples
    --------
    >>> import scenes
    >>> task1 = scenes.load("task1")
    >>> black = np.zeros((task1.camera.height, task1.camera.width))
    >>> two = [Picture.of(task1, sensor, (15, 315)) for sensor in ((30, 135), (30, 225))]
    >>> bundle([(black, picture) for picture in two], "known", estimator="gradient").status.tolist()
    ['low_contrast']
    """
    freedom = Freedom(sensors, shape, axes, cameras)
    stacks, pictures, lead = _checked(shots)
    expected = Bundle.of(pictures, freedom)
    names = [estimator or best_estimator(picture) for picture in pictures]
    for _ in range(_STEPS):
        found = [find(*one) for one in zip(stacks, expected.pictures, names, strict=True)]
        every = [_One.of(expected, found, i) for i in range(len(stacks[0]))]
        numbers = np.mean([one.numbers for one in every], 0)
        if not np.isfinite(numbers).all() or expected.reach(numbers) < _SETTLED:
            break
        expected = expected.moved_by(numbers)
    return _gathered(expected, every, lead)


@dataclass(frozen=True, eq=False)
class _One:
    """One set of images: its adjustment, the unknowns (n,), values (M,), p-value and statuses (M,)."""

    chosen: Preferred
    numbers: np.ndarray
    value: np.ndarray
    p_value: float
    status: tuple[str, ...]

    @classmethod
    def of(cls, expected: Bundle, found: list[MeasuredFeatures], i: int) -> _One:
        states = [_states(each, i) for each in found]
        errors, off = [each.of_datums[i] for each in found], [each.offsets[i] for each in found]
        chosen = Preferred.of(expected, errors, states)
        numbers, squares = chosen.good.solved(off)
        value, freedom = expected.values(numbers), chosen.good.told.freedom
        if not chosen.by_good.all():
            everything, more = chosen.every.solved(off)
            value = np.where(chosen.by_good, value, expected.values(everything))
            if not chosen.by_good.any():
                numbers, squares, freedom = everything, more, chosen.every.told.freedom
        p_value = float(chdtrc(freedom, squares)) if freedom > 0 else 1.0
        fits = status.OK if p_value >= WORST else status.MISFIT
        told = tuple(status.worst(each, fits) for each in chosen.statuses(states))
        return cls(chosen, numbers, np.where(np.isin(told, _VALUED), value, np.nan), p_value, told)


_VALUED = tuple(each for each in status.MEASURED if each != status.UNPLACED)


def _states(found: MeasuredFeatures, i: int) -> np.ndarray:
    """Status of each edge and circle in the i-th image, (E + C,)."""
    edges = [status.worst(str(one), str(found.shape.whole[i])) for one in found.shape.counted[i]]
    return np.array([*edges, *(str(circle.state[i]) for circle in found.circles)])


def _checked(shots: Sequence[tuple[np.ndarray, Picture]]) -> tuple[list[np.ndarray], list[Picture], tuple[int, ...]]:
    if not shots:
        raise InvalidInput("shots must be at least one image with its picture, got none")
    stacks, pictures, leads = [], [], []
    for image, picture in shots:
        camera = picture.scene.camera
        images = checked_image(image, (camera.height, camera.width))
        leads.append(images.shape[:-2])
        stacks.append(images.reshape(-1, *images.shape[-2:]))
        pictures.append(picture)
    if len(set(leads)) > 1:
        raise InvalidInput(f"images must be of one leading shape in all shots, got {', '.join(map(str, leads))}")
    return stacks, pictures, leads[0]


def _gathered(expected: Bundle, every: list[_One], lead: tuple[int, ...]) -> Bundled:
    scene, count = expected.unknowns.scene, len(expected.quantities)
    own = [
        q.nominal if q.nominal is not None else v for q, v in zip(expected.quantities, expected.nominal[0], strict=True)
    ]
    has = np.array([np.isin(one.status, _VALUED) for one in every])
    covariance = of_measured(np.array([one.chosen.covariance for one in every]), has)
    before = [one.chosen.known_before for one in every]
    return Bundled(
        quantities=expected.quantities,
        units=tuple(scene.unit_of(each) for each in expected.quantities),
        nominal=np.array(own, float),
        value=np.array([one.value for one in every]).reshape(*lead, count),
        covariance=covariance.reshape(*lead, count, count),
        u_placed=np.array([one.chosen.u_placed for one in every]).reshape(*lead, count),
        known_before={name: np.array([one[name] for one in before]).reshape(*lead, count) for name in before[0]},
        status=np.array([one.status for one in every]).reshape(*lead, count),
        p_value=np.array([one.p_value for one in every]).reshape(lead),
        reason=every[0].chosen.reasons,
        pictures=expected.pictures,
        places=np.array([expected.at(one.numbers).aligned().laid() for one in every]).reshape(*lead, -1, 3),
        points=(*(expected.unknowns.vertex(i) for i in expected.unknowns.vertices), *expected.unknowns.circles),
    )
