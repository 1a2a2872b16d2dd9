"""Values of displaced lines and circles, evaluated with the nominal model (poses and camera as the scene says).

Not linearised: displacements may be large. Only the adjustment of a part's place from datums is linear in them.
"""

from __future__ import annotations

import numpy as np

from imaging.features.kinds import on_plane
from imaging.features.measurand import measurands
from imaging.features.seen import unit_normals
from imaging.geometry.lens import image_centre
from imaging.models import DEFAULT_MODEL, variance_model
from imaging.pictures import Pictures
from measure.features.layout import layout_of
from measure.quantities import found_in_images, values
from scenes import Picture


def believed(picture: Picture, errors: np.ndarray) -> np.ndarray:
    """Values of all M quantities in the object, shape (n, M).

    Parameters
    ----------
    picture : Picture
        As it is believed to be taken.
    errors : ndarray, shape (n, q)
        Of lines and circles, as numbered in `imaging.features.seen`.

    Returns
    -------
    ndarray
        The scene's unit, or degrees; NaN where a feature that is needed is.

    Examples
    --------
    >>> import scenes
    >>> picture = Picture.of(scenes.load("task1"), (30, 135), (15, 315))
    >>> believed(picture, np.zeros((1, 8))).round(4).tolist()
    [[14.5774]]
    """
    known, errors = measurands(Pictures.of(picture)), np.asarray(errors, float)
    edges = len(known.view.names)
    offset, turn = errors[:, 0 : 2 * edges : 2, None], errors[:, 1 : 2 * edges : 2, None]
    along = np.broadcast_to(known.seen.along, (len(errors), edges, 2))
    normal = np.broadcast_to(known.seen.normals, along.shape)
    points = known.seen.start + offset * normal + image_centre(known.seen.camera)
    turned = unit_normals(along + turn * np.linalg.norm(along, axis=-1, keepdims=True) * normal)
    circles = tuple(errors[:, known.seen.numbers(c)] for c in range(len(known.circles)))
    forms = dict(zip(known.seen.forms, errors[:, known.seen.of_forms].T, strict=True))
    seen = found_in_images(known, layout_of(picture), turned, points, circles, forms)
    none = np.zeros((len(errors), errors.shape[1], errors.shape[1]))
    found = values(seen, known.quantities, on_plane, none)
    if known.placing is None:
        return found.value
    adjustment = variance_model(DEFAULT_MODEL)(Pictures.of(picture)).adjustment
    return found.value - np.einsum("nmk,nk->nm", adjustment.pulls(found.gradient), adjustment.estimate(errors))
