"""Several pictures of one part measured together: features found in each, adjusted with the sensors' places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtrc

from imaging.bundles.biases import FeatureBias, corrected, covariances
from imaging.bundles.bundle import Bundle
from imaging.bundles.preferred import Preferred
from imaging.bundles.unknowns import Axes, Cameras, Freedom, Sensors, Shape
from measure.best import best_estimator
from measure.covariances import of_measured, scaled
from measure.goodness import WORST
from measure.known_bias import Correction
from measure.measurement import check_same, checked_image
from measure.placement import Located, locate
from measure.quantities import MeasuredFeatures, find
from measure.saturation import saturated
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
        features lack. Where biases are taken off, `scenes.status.corrected` decides.
    bias, u_bias : ndarray, shape (..., M)
        What corrections have taken off the values, to first order, and its standard uncertainty (not variance); 0 and
        NaN where none were given; infinite where a bias is not known.
    p_value : ndarray, shape (...)
        Of the chi-square; 1 where nothing is seen twice.
    reason : tuple of str
        Of each quantity in the first set, why it is not told; empty where it is.
    preferred : Preferred
        The adjustments of the first set, with the values' derivatives by lines and circles of each picture.
    doubts : dict of str to ndarray, shape (M,), or None
        What `u_bias` of the first set is made of, by source; None without corrections.
    pictures : tuple of Picture
        As the first set shows them: with part and sensors where they were found, to a few hundredths of a px.
    placement, u_placement : ndarray, shape (..., 6 + c)
        Where the part lies beside where the scene says, and what is estimated of the (first) camera, as of
        `measure.Located`, with standard uncertainties (not variances); infinite where the pictures leave it open.
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
    bias: np.ndarray
    u_bias: np.ndarray
    p_value: np.ndarray
    reason: tuple[str, ...]
    preferred: Preferred
    doubts: dict[str, np.ndarray] | None
    pictures: tuple[Picture, ...]
    placement: np.ndarray
    u_placement: np.ndarray
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
        """Of noise, of what is not known before, and of the biases' correction where there is one, shape (..., M)."""
        return np.sqrt(self.sigma**2 + self.u_placed**2 + np.nan_to_num(self.u_bias, posinf=np.inf) ** 2)

    def as_rows(self) -> list[dict[str, Any]]:
        """One record a set and measurand: value, sigma, u_bias, u, status; None: there is none."""
        count = len(self.quantities)
        told = self.value, self.sigma, self.u_placed, self.u_bias, self.u, self.status
        columns = (each.reshape(-1, count) for each in told)
        return [
            {
                "scene": self.pictures[0].scene.name, "pictures": len(self.pictures), "image": i, "name": each.name,
                "kind": each.kind, "unit": self.units[m], "value": finite(values[m]), "sigma": finite(sigmas[m]),
                "u_placed": finite(before[m]), "u_bias": finite(doubt[m]), "u": finite(both[m]),
                "nominal": float(self.nominal[m]), "status": str(states[m]),
            }
            for i, (values, sigmas, before, doubt, both, states) in enumerate(zip(*columns, strict=True))
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
    corrections: Sequence[Correction] | None = None,
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
    corrections : sequence of Correction, optional
        Of each picture, whose lines' and circles' biases are taken off (`imaging.bundles.biases`); by its estimator.

    Raises
    ------
    InvalidInput
        If the pictures are not of one part with the same measurands, or the images not of one leading shape.

    Notes
    -----
    The part's place counts as known to ``uncertainty.part_shift`` and ``part_tilt_deg``, datums on it to
    ``placement.datum_sd``. Where placement is from datums or a board the part is found in each picture first
    (`measure.locate`). Part and sensors are expected anew, and looked for again, until that moves nothing by more
    than 0.02 px; of stacks where the mean of all images puts them. Biases are those of the pictures that are given:
    beside them, as far as sensors and part are moved, they count as the same.

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
    expected, where = _begun(stacks, Bundle.of(pictures, freedom))
    each = zip(stacks, pictures, _each(corrections, pictures), where, strict=True)
    known = [_Known.of_picture(*one, estimator) for one in each]
    for _ in range(_STEPS):
        found = [
            find(stack, there, *one.method) for stack, there, one in zip(stacks, expected.pictures, known, strict=True)
        ]
        every = [_One.of(expected, found, known, i) for i in range(len(stacks[0]))]
        numbers = np.mean([one.numbers for one in every], 0)
        if not np.isfinite(numbers).all() or expected.reach(numbers) < _SETTLED:
            break
        expected = expected.moved_by(numbers)
    return _gathered(expected, every, lead, [one.lost for one in known])


def _begun(stacks: Sequence[np.ndarray], bundle: Bundle) -> tuple[Bundle, list[Located | None]]:
    """The same where images (n, height, width) show part and camera, as each alone has them; and of each picture of
    which neither it nor, by where its sensor stands, another one tells where it is, why not.

    As the scene says where the part's place is not left to the pictures.
    """
    if not bundle.pictures[0].scene.placement.is_estimated:
        return bundle, [None] * len(stacks)
    each = [locate(stack.mean(0), picture) for stack, picture in zip(stacks, bundle.pictures, strict=True)]
    is_free = [told == "unknown" for told in bundle.freedom.of_sensors(len(each))]
    there = {k: one.placement for k, one in enumerate(each, 1) if one.status == status.OK}
    tied = [place for k, place in there.items() if not is_free[k - 1]]
    free = {k: place for k, place in there.items() if is_free[k - 1]}
    told = [k in there or (bool(tied) and not is_free[k - 1]) for k in range(1, len(each) + 1)]
    held = tied or list(there.values())[:1]
    begun = bundle.placed_at(np.mean(held, 0), free) if held else bundle
    return begun, [None if is_told else one for is_told, one in zip(told, each, strict=True)]


def _each(corrections: Sequence[Correction] | None, pictures: list[Picture]) -> Sequence[Correction | None]:
    if corrections is None:
        return [None] * len(pictures)
    if len(corrections) != len(pictures):
        raise InvalidInput(f"corrections must be one for each of {len(pictures)} pictures, got {len(corrections)}")
    return corrections


@dataclass(frozen=True, eq=False)
class _Known:
    """How one picture's images are measured, and what is known of its lines' and circles' biases.

    Attributes
    ----------
    method : (str, float or None)
        Estimator, and threshold of ``canny``.
    is_corrected : bool
    bias : FeatureBias or None
        None where it is not known.
    of : ndarray of bool, shape (n,)
        Of which images it is: as many pixels at the end of the scale as it allows.
    lost : Located or None
        Why nothing tells where the part is in it; None where something does.
    """

    method: tuple[str, float | None]
    is_corrected: bool
    bias: FeatureBias | None
    of: np.ndarray
    lost: Located | None

    @classmethod
    def of_picture(
        cls,
        images: np.ndarray,
        picture: Picture,
        correction: Correction | None,
        lost: Located | None,
        estimator: str | None,
    ) -> _Known:
        if correction is None:
            return cls((estimator or best_estimator(picture), None), False, None, np.ones(len(images), bool), lost)
        check_same(correction, picture, estimator, None)
        told, name = correction.features, correction.estimator
        cut, (least, most) = saturated(images, picture, name), (0.0, np.inf) if told is None else told.saturated
        return cls((name, correction.threshold), True, told, (cut >= least) & (cut <= most), lost)

    def taken(self, found: MeasuredFeatures, i: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, FeatureBias | None]:
        """Of the i-th image how far off lines and circles are (q,), their covariance by noise (q, q), statuses
        (E + C,) and biases."""
        off, errors, states = found.offsets[i], _without_misfits(found, i), found.states(i)
        if self.lost is not None:
            return off, np.diag(np.full(len(off), np.inf)), np.full(len(states), self.lost.status), None
        if not self.is_corrected:
            return off, errors, states, None
        if self.bias is None or not self.of[i]:
            return off, errors, np.where(states == status.OK, status.CLUTTER, states), None
        known, seen = self.bias.is_known, found.known.seen
        doubtful = seen.of_features(np.isin(states, (status.CLUTTER, status.MISFIT)))
        states = self.bias.states_of(states, ~seen.features_of(~known))
        errors = scaled(errors, np.where(np.eye(len(known), dtype=bool), self.bias.errors, 0.0), doubtful & known)
        return off - np.where(known, self.bias.bias, 0.0), errors, states, self.bias


def _without_misfits(found: MeasuredFeatures, i: int) -> np.ndarray:
    """Covariance (q, q) of lines and circles of the i-th image; infinite of a board whose points do not fit it."""
    errors = found.of_datums[i]
    if found.board is None or found.board.state[i] != status.MISFIT:
        return errors
    lost, board = errors.copy(), found.known.seen.of_board
    lost[board, board] = np.diag(np.full(found.known.seen.board, np.inf))
    return lost


@dataclass(frozen=True, eq=False)
class _One:
    """One set of images: its adjustment, the unknowns (n,), values (M,), biases and their standard uncertainties (M,),
    p-value and statuses (M,)."""

    chosen: Preferred
    numbers: np.ndarray
    value: np.ndarray
    bias: np.ndarray
    u_bias: np.ndarray
    doubts: dict[str, np.ndarray] | None
    p_value: float
    status: tuple[str, ...]

    @classmethod
    def of(cls, expected: Bundle, found: list[MeasuredFeatures], known: list[_Known], i: int) -> _One:
        off, errors, states, biases = zip(
            *(one.taken(each, i) for one, each in zip(known, found, strict=True)), strict=True
        )
        chosen = Preferred.of(expected, errors, states, covariances(biases, errors))
        numbers, squares = chosen.placed_by.solved(off)
        value, freedom = expected.values(numbers), chosen.placed_by.told.freedom
        if chosen.placed_by is chosen.good and not chosen.by_good.all():
            value = np.where(chosen.by_good, value, expected.values(chosen.every.solved(off)[0]))
        p_value = float(chdtrc(freedom, squares)) if freedom > 0 else 1.0
        fits = status.OK if p_value >= WORST else status.MISFIT
        told = tuple(status.worst(each, fits) for each in chosen.statuses(states))
        bias, u_bias, doubts = np.zeros(len(value)), np.full(len(value), np.nan), None
        if any(one.is_corrected for one in known):
            (bias, u_bias), doubts = chosen.biased(biases), chosen.doubts(biases)
            told = corrected(told, u_bias, np.sqrt(np.diag(chosen.covariance)), expected.quantities)
        return cls(
            chosen, numbers, np.where(np.isin(told, _VALUED), value, np.nan), bias, u_bias, doubts, p_value, told
        )


_VALUED = tuple(each for each in status.MEASURED if each != status.UNPLACED)


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


def _gathered(expected: Bundle, every: list[_One], lead: tuple[int, ...], lost: list[Located | None]) -> Bundled:
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
        bias=np.array([one.bias for one in every]).reshape(*lead, count),
        u_bias=np.array([one.u_bias for one in every]).reshape(*lead, count),
        p_value=np.array([one.p_value for one in every]).reshape(lead),
        reason=tuple(_with_lost(reason, lost) for reason in every[0].chosen.reasons),
        preferred=every[0].chosen,
        doubts=every[0].doubts,
        pictures=expected.pictures,
        placement=np.array([expected.placement_by(one.numbers) for one in every]).reshape(*lead, -1),
        u_placement=np.array([one.chosen.placed_by.u_placement for one in every]).reshape(*lead, -1),
        places=np.array([expected.at(one.numbers).aligned().laid() for one in every]).reshape(*lead, -1, 3),
        points=(*(expected.unknowns.vertex(i) for i in expected.unknowns.vertices), *expected.unknowns.circles),
    )


def _with_lost(reason: str, lost: list[Located | None]) -> str:
    """Why a value is not told, with the pictures in which the part is not found; empty where it is told."""
    if not reason:
        return reason
    where = (f"picture {k}: {one.reason}" for k, one in enumerate(lost, 1) if one is not None)
    return "; ".join([*where, reason])
