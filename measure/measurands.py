"""All measurands of a scene measured in one image or in a stack, in px and in the scene's unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from measure.estimators.registry import best_estimator
from measure.measurement import Measurement, check_method, checked_image, of_first
from measure.quantities import Found, find
from scenes import Picture, Quantity, Scene, status
from scenes.results import Shown, finite, value


@dataclass(frozen=True, repr=False)
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

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(quantity.name for quantity in self.quantities)

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviation of `value`, shape (..., M)."""
        return np.sqrt(np.einsum("...mm->...m", self.covariance))

    def as_rows(self) -> list[dict[str, Any]]:
        """One record an image and measurand: scene and poses, value, one sigma, status; None where there is none."""
        where, count = self.picture.row, len(self.quantities)
        columns = (each.reshape(-1, count) for each in (self.value, self.sigma, self.status))
        return [
            where
            | {
                "image": i,
                "name": quantity.name,
                "kind": quantity.kind,
                "unit": self.units[m],
                "value": finite(values[m]),
                "sigma": finite(sigmas[m]),
                "nominal": float(self.nominal[m]),
                "status": str(states[m]),
            }
            for i, (values, sigmas, states) in enumerate(zip(*columns, strict=True))
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

    Examples
    --------
    >>> import numpy as np, scenes
    >>> task1 = scenes.load("task1")
    >>> found = measure(np.zeros((task1.camera.height, task1.camera.width)), task1, (30, 135), (15, 315), "gradient")
    >>> found.names, found.units, found.status.tolist()
    (('distance',), ('cm',), ['low_contrast'])
    """
    picture = Picture.of(scene, sensor, light)
    (found,) = measure_by(image, picture, ((estimator or best_estimator(picture.scene), threshold),))
    return found


def measure_by(
    image: np.ndarray, picture: Picture, methods: Sequence[tuple[str, float | None]]
) -> tuple[Measurements, ...]:
    """The same by several methods (estimator, threshold of ``canny``) in the same images, checked once."""
    for name, threshold in methods:
        check_method(name, threshold)
    camera = picture.scene.camera
    images = checked_image(image, (camera.height, camera.width))
    stack, lead = images.reshape(-1, *images.shape[-2:]), images.shape[:-2]
    return tuple(_gathered(find(stack, picture, *method), picture, lead) for method in methods)


def _gathered(found: Found, picture: Picture, lead: tuple[int, ...]) -> Measurements:
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
        covariance_image=_known(found.image.covariance, measured).reshape(*lead, count, count),
        covariance=_known(found.plane.covariance, measured).reshape(*lead, count, count),
        status=found.status.reshape(*lead, count),
        p_value=found.shape.p_value.reshape(lead),
        first=of_first(found, picture, lead) if quantities[0].kind == "distance" else None,
        picture=picture,
    )


def _known(covariance: np.ndarray, measured: np.ndarray) -> np.ndarray:
    both = measured[:, :, None] & measured[:, None, :]
    lost = np.where(np.eye(measured.shape[1], dtype=bool), np.inf, np.nan)
    return np.where(both, covariance, lost)
