"""How well the estimator ``arrangement`` knows lines, which is taken where one convex body stands before darkness."""

from __future__ import annotations

import numpy as np

from imaging.blurred.arrangement import arrangement_of
from imaging.features.measurand import measurands
from imaging.light.appearance import is_plain
from imaging.models.bound import information, joint_lines
from imaging.models.calibrated import calibrated
from imaging.models.extremes import with_extremes
from imaging.models.reach import reach_of
from imaging.pictures import Pictures
from scenes import Scene


def is_arranged(scene: Scene) -> bool:
    """Whether images of a scene are measured by ``arrangement`` where no estimator is named: one convex body before
    darkness, in pixels that are alike and independent."""
    return is_plain(scene) and scene.noise.colour is None and not scene.noise.is_shared


def arranged(pictures: Pictures) -> np.ndarray:
    """Joint covariance (q, q) of lines, circles and board of one picture, as of `Errors.of_features`.

    Lines are known together, at the bound of the pixels that ``arrangement`` looks at and of a blur that is not known:
    edges that share corners and levels of faces are correlated. Circles and boards are found as by any other estimator.
    Infinite on the diagonal of what is not seen.
    """
    camera, noise = pictures.scene.camera, pictures.scene.noise
    reach = reach_of(arrangement_of(pictures), (camera.height, camera.width), noise)
    whole, known = calibrated(pictures).of_features.copy(), measurands(pictures)
    joint, seen = joint_lines(known, information(pictures, free_blur=True, reach=reach))
    lines = slice(0, len(joint))
    lost = ~(np.repeat(seen, 2) & np.isfinite(np.diag(whole)[lines]))
    whole[lines, lines] = np.where(lost[:, None] | lost, np.diag(np.where(lost, np.inf, 0.0)), joint)
    return whole


def arranged_variances(pictures: Pictures) -> np.ndarray:
    """Variances (M,) of all quantities of one picture in the object as ``arrangement`` finds them, the scene's unit
    squared or degrees^2; infinite where one cannot be measured."""
    errors, whole = calibrated(pictures), arranged(pictures)
    known = errors.measurands
    placing, gradient, forms = known.placing, known.gradient_object, known.seen.of_forms
    whole[forms, forms] = np.diag(np.array(errors.forms, float))
    gradient = gradient if placing is None else placing.adjusted(whole).gradient(gradient)
    lost = np.isinf(np.diag(whole))
    joint = gradient @ np.where(lost[:, None] | lost, 0.0, whole) @ gradient.T
    told = np.diag(with_extremes(known.quantities, known.value_object, gradient, joint)[1])
    return np.where(((gradient != 0) & lost).any(1), np.inf, told)
