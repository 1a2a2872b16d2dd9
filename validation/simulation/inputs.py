"""What closed form tells of inputs that a scene is not sure of, and which of them nothing tells."""

from __future__ import annotations

import numpy as np

from imaging.features.measurand import measurands
from imaging.light.appearance import is_plain
from imaging.models.bias import bias
from imaging.models.inputs import with_lights_moved
from imaging.pictures import Pictures
from scenes import Picture
from scenes.materials import Brdf
from validation.simulation.how import How

REFLECTANCE, LIGHT = "reflectance", "light_place"


def of_unknown_kinds(picture: Picture) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Infinite where a material that matters is of a kind that does not say how it reflects less."""
    scene = picture.scene
    used = (*scene.materials, *((scene.material,) if scene.materials or not is_plain(scene) else ()))
    if all(isinstance(each, Brdf) and each.dimmed(0.5) is not None for each in used):
        return {}
    unknown = np.full(len(picture.scene.quantities), np.inf)
    return {REFLECTANCE: (unknown, unknown)}


def light_in_closed_form(picture: Picture, how: How) -> tuple[np.ndarray, np.ndarray] | None:
    """Standard uncertainties (M,) of the bias by lights' places, in the object and in the image.

    None where the closed form of the bias is another one's than that of what measures, or has no value.
    """
    if not (how.predicted and is_plain(picture.scene)):
        return None
    here, found = bias(Pictures.of(picture)), []
    for other in with_lights_moved(picture):
        moved = bias(Pictures.of(other))
        found.append((moved.values_object - here.values_object, moved.values - here.values))
    squares = np.square(found).sum(0) if found else np.zeros((2, len(picture.scene.quantities)))
    return tuple(np.sqrt(squares.reshape(2, -1))) if np.isfinite(squares).all() else None


def lines_by_lights(picture: Picture) -> np.ndarray:
    """What each light's place moves lines by, (k, q), in closed form; circles by nothing."""
    here, known, rows = bias(Pictures.of(picture)), measurands(Pictures.of(picture)), []
    lengths = np.linalg.norm(known.seen.along, axis=-1)
    for other in with_lights_moved(picture):
        start, stop = np.moveaxis(bias(Pictures.of(other)).lines - here.lines, -1, 0)
        rows.append(np.zeros(known.seen.count))
        rows[-1][: 2 * len(lengths)] = np.stack([start, (stop - start) / lengths], -1).ravel()
    return np.array(rows).reshape(-1, known.seen.count)
