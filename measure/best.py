"""By which estimator an image is measured where none is named."""

from __future__ import annotations

from imaging.light.appearance import is_plain
from imaging.models.arranged import is_arranged
from measure.estimators.arrangement import ArrangementEstimator
from measure.estimators.registry import is_for
from measure.features.arranged import is_told
from measure.features.layout import layout_of
from measure.features.shape import prepared
from scenes import Picture, Scene

_OTHERWISE = ("isophote", "strip")


def best_estimator(scene: Scene | Picture) -> str:
    """What an image of a scene is best measured by: ``arrangement`` where one convex body stands before darkness.

    There it is the most precise, and tells by its goodness of fit whether the image is what it takes it for. Where
    things hide or shade each other, and where a colour sensor's pixels are not alike or those of a row share noise,
    ``gradient``, whose errors and bias the planner knows. So it is of a picture that is known to tell too little of its
    arrangement, or not linearly in the noise: there ``arrangement`` is ``ill_conditioned``. No image is asked.
    """
    picture, scene = (scene, scene.scene) if isinstance(scene, Picture) else (None, scene)
    if not is_arranged(scene):
        return "gradient"
    return "arrangement" if picture is None or not picture.lights or _tells(picture) else "gradient"


def other_estimators(scene: Scene) -> tuple[str, ...]:
    """What may know more of some values where the best one does not know enough, the quickest first.

    Where things hide or light each other ``strip`` takes the levels beside an edge from the scene, with what that is
    not sure of as unknowns, and is asked alone. Elsewhere ``isophote`` reads less far beside an edge, and ``strip``
    finds levels where ``gradient`` finds slopes: what a shadow or a bright face nearby does to the one is not what it
    does to the other.
    """
    if not is_plain(scene) and is_for("strip", scene.noise):
        return ("strip",)
    return tuple(name for name in _OTHERWISE if is_for(name, scene.noise))


def _tells(picture: Picture) -> bool:
    layout = layout_of(picture)
    if not layout.names:
        return True
    tool = prepared(layout, "arrangement", picture.scene.locator.thresholds[0])
    assert isinstance(tool, ArrangementEstimator)
    return is_told(layout, tool)
