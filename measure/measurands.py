"""All measurands of a scene measured in one image or in a stack, in px and in the scene's unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from measure.best import best_estimator
from measure.covariances import less_bias, of_measured
from measure.features.forms import FoundForm
from measure.known_bias import Correction
from measure.measurement import Measurement, check_method, check_same, checked_image, of_first
from measure.quantities import MeasuredFeatures, find
from measure.saturation import saturated
from scenes import Picture, Quantity, Scene, status
from scenes.results import Shown, finite, value


@dataclass(frozen=True, eq=False, repr=False)
class Measurements(Shown):
    """M quantities measured in images of leading shape (...); one image has the shape ().

    Attributes
    ----------
    quantities : tuple of Quantity
        What they are: names, kinds, features, tolerances.
    units : tuple of str
        Of `value`: the scene's unit of length, or degrees.
    nominal : ndarray, shape (M,)
        The scene's nominal values, or the object's own.
    value_image, value : ndarray, shape (..., M)
        In the image (px, degrees; the lens' distortion undone) and on the plane of the features (`units`); NaN where
        the status is neither ``ok`` nor ``clutter`` nor ``misfit``.
    covariance_image, covariance : ndarray, shape (..., M, M)
        Their joint covariances (not sigmas), from the estimators' own linear responses at the contrast measured in the
        image; infinite on the diagonal where there is no value, NaN beside it. Circles count as independent of each
        other and of the straight edges, for they are found from different pixels.
    status : ndarray of str, shape (..., M)
        As of `measure.distance`, from what each quantity needs.
    p_value : ndarray, shape (...)
        Goodness of fit, as of `measure.distance`.
    first : Measurement, optional
        The first quantity as `measure.distance` gives it, with its edges, if it is a distance.
    picture : Picture
        What the images are taken to show: scene, sensor, and the lights where they are known.
    saturated : ndarray of int, shape (...)
        How many of the pixels looked at are at the end of the sensor's scale.
    bias, u_bias : ndarray, shape (..., M)
        What a `Correction` has taken off the values, and its standard uncertainty (not variance), `units`; 0 and NaN
        where none was made; infinite where more pixels are saturated, or fewer, than those of which it tells. Where
        one was, the variances of what was ``clutter`` or ``misfit`` are those propagated in the simulated picture, for
        the estimator's own are those of a lone edge.
    u_placed : ndarray, shape (..., M)
        Standard uncertainty (not variance) of the values by what is not known of the part's place and of the datums on
        it (`scenes.Placement`), `units`; 0 where the place counts as known.
    forms : dict
        By name of each form (`scenes.measurands.form`) its points and their law in each image, in order
        (`measure.features.forms.FoundForm`); None where it is not found.
    estimator : str
        By which the straight edges are measured; empty where that is not told.
    """

    quantities: tuple[Quantity, ...]
    units: tuple[str, ...]
    nominal: np.ndarray
    value_image: np.ndarray
    value: np.ndarray
    covariance_image: np.ndarray
    covariance: np.ndarray
    status: np.ndarray
    p_value: np.ndarray
    first: Measurement | None
    picture: Picture
    saturated: np.ndarray
    bias: np.ndarray
    u_bias: np.ndarray
    forms: dict[str, tuple[FoundForm | None, ...]] = field(default_factory=dict)
    u_placed: np.ndarray = field(default_factory=lambda: np.zeros(()))
    estimator: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(quantity.name for quantity in self.quantities)

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviation of `value`, shape (..., M)."""
        return np.sqrt(np.einsum("...mm->...m", self.covariance))

    @property
    def u(self) -> np.ndarray:
        """Combined standard uncertainty, of noise, of the bias' correction and of the part's place, shape (..., M); NaN
        without a correction."""
        return np.sqrt(self.sigma**2 + self.u_bias**2 + self.u_placed**2)

    def as_rows(self) -> list[dict[str, Any]]:
        """One record an image and measurand: scene and poses, value, one sigma, u, status; None: there is none."""
        where, count = self.picture.row, len(self.quantities)
        columns = (each.reshape(-1, count) for each in (self.value, self.sigma, self.u_bias, self.u, self.status))
        return [
            where
            | {
                "image": i,
                "name": quantity.name,
                "kind": quantity.kind,
                "unit": self.units[m],
                "value": finite(values[m]),
                "sigma": finite(sigmas[m]),
                "u_bias": finite(doubts[m]),
                "u": finite(combined[m]),
                "nominal": float(self.nominal[m]),
                "status": str(states[m]),
            }
            for i, (values, sigmas, doubts, combined, states) in enumerate(zip(*columns, strict=True))
            for m, quantity in enumerate(self.quantities)
        ]

    def _line(self) -> str:
        images, count = int(np.prod(self.p_value.shape)), len(self.quantities)
        if images == 1:
            return "; ".join(_told(row) for row in self.as_rows())
        good = int((self.status == status.OK).sum())
        return f"{images} images, {count} measurands ({', '.join(self.names)}), {good} of {images * count} values ok"


def _told(row: dict[str, Any]) -> str:
    if row["value"] is None:
        return f"{row['name']} {row['status']}"
    return f"{row['name']} {value(row['value'], row['sigma'], row['unit'])}, {row['status']}"


def measure(
    image: np.ndarray,
    scene: Scene | Picture,
    sensor: Any = None,
    light: Any = None,
    estimator: str | None = None,
    threshold: float | None = None,
    *,
    correction: Correction | None = None,
) -> Measurements:
    """Measure all measurands of a scene, jointly.

    Parameters
    ----------
    image, scene, sensor, light, threshold
        As for `measure.distance`.
    estimator : str, optional
        Of the straight edges, as for `measure.distance`; `measure.best_estimator` when not given. Circles are found
        from edge points (zero crossing of the Gaussian second derivative) around their rims, in the plane that the pose
        tells, so that centre and diameter are the circle's own and not those of its image, an ellipse.
    correction : Correction, optional
        Biases to be subtracted (`measure.correction`), found for this picture; estimator and threshold are then its.

    Examples
    --------
    >>> import numpy as np, scenes
    >>> task1 = scenes.load("task1")
    >>> found = measure(np.zeros((task1.camera.height, task1.camera.width)), task1, (30, 135), (15, 315), "gradient")
    >>> found.names, found.units, found.status.tolist()
    (('distance',), ('cm',), ['low_contrast'])
    """
    picture = Picture.of(scene, sensor, light)
    if correction is not None:
        check_same(correction, picture, estimator, threshold)
        (found,) = measure_by(image, picture, ((correction.estimator, correction.threshold),))
        return corrected(found, correction, image)
    (found,) = measure_by(image, picture, ((estimator or best_estimator(picture), threshold),))
    return found


def corrected(found: Measurements, correction: Correction, image: np.ndarray) -> Measurements:
    """With the biases of a picture taken off that was found in ``image``, (..., height, width), and the statuses that
    this leaves."""
    shape = found.status.shape
    off, off_image, u_bias = correction.of_images(image.reshape(-1, *image.shape[-2:]))
    of = correction.is_of(found.saturated.ravel())
    told = zip(found.status.reshape(-1, shape[-1]), of, u_bias, strict=True)
    states = np.array([correction.status_of(*each) for each in told]).reshape(shape)
    off, off_image = (np.nan_to_num(each).reshape(shape) for each in (off, off_image))
    doubtful, measured = np.isin(found.status, (status.CLUTTER, status.MISFIT)), np.isin(states, status.MEASURED)
    value, covariance = less_bias(found.value, found.covariance, off, correction.covariance, doubtful, measured)
    value_image, covariance_image = less_bias(
        found.value_image, found.covariance_image, off_image, correction.covariance_image, doubtful, measured
    )
    return replace(
        found,
        value=value,
        value_image=value_image,
        covariance=covariance,
        covariance_image=covariance_image,
        status=states,
        first=found.first and _first_corrected(found.first, off_image[..., 0], states[..., 0]),
        bias=off,
        u_bias=np.where(of, u_bias, np.inf).reshape(shape),
    )


def _first_corrected(first: Measurement, bias: np.ndarray, states: np.ndarray) -> Measurement:
    measured = np.isfinite(first.value_px) & np.isin(states, status.MEASURED)
    return replace(
        first,
        value_px=np.where(measured, first.value_px - bias, np.nan),
        variance_px2=np.where(measured, first.variance_px2, np.inf),
        bias_px=np.where(measured, bias, 0.0),
        status=states,
    )


def measure_by(
    image: np.ndarray, picture: Picture, methods: Sequence[tuple[str, float | None]]
) -> tuple[Measurements, ...]:
    """The same by several methods (estimator, threshold of ``canny``) in the same images, checked once."""
    for name, threshold in methods:
        check_method(name, threshold)
    camera = picture.scene.camera
    return exposures_by(checked_image(image, (camera.height, camera.width)), picture, methods)


def exposures_by(
    images: np.ndarray, picture: Picture, methods: Sequence[tuple[str, float | None]]
) -> tuple[Measurements, ...]:
    """The same of float64 images that are known to be the camera's: looking at each pixel of them is most of the work
    where few are measured."""
    stack, lead = images.reshape(-1, *images.shape[-2:]), images.shape[:-2]
    return tuple(
        _gathered(find(stack, picture, *method), picture, method[0], saturated(stack, picture, method[0]), lead)
        for method in methods
    )


def _gathered(
    found: MeasuredFeatures, picture: Picture, estimator: str, saturation: np.ndarray, lead: tuple[int, ...]
) -> Measurements:
    quantities = found.known.quantities
    count = len(quantities)
    measured = np.isin(found.status, status.MEASURED)
    told = [
        q.nominal if q.nominal is not None else v for q, v in zip(quantities, found.known.value_object, strict=True)
    ]
    return Measurements(
        quantities=quantities,
        units=tuple(picture.scene.unit_of(quantity) for quantity in quantities),
        nominal=np.array(told, float),
        value_image=np.where(measured, found.image.value, np.nan).reshape(*lead, count),
        value=np.where(measured, found.plane.value, np.nan).reshape(*lead, count),
        covariance_image=of_measured(found.image.covariance, measured).reshape(*lead, count, count),
        covariance=of_measured(found.plane.covariance, measured).reshape(*lead, count, count),
        status=found.status.reshape(*lead, count),
        p_value=found.shape.p_value.reshape(lead),
        first=of_first(found, picture, lead) if quantities[0].kind == "distance" else None,
        picture=picture,
        saturated=saturation.reshape(lead),
        bias=np.zeros((*lead, count)),
        u_bias=np.full((*lead, count), np.nan),
        u_placed=np.sqrt(np.einsum("nmm->nm", found.placed)).reshape(*lead, count),
        forms={quantity.name: form.found for quantity, form in found.forms.items()},
        estimator=estimator,
    )
