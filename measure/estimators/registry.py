"""The estimators of the project, in the order of tables; of an estimator's name one that is prepared for a layout."""

from __future__ import annotations

from measure.estimators import arrangement, canny, gradient, isophote, strip
from measure.estimators.estimate import Estimator
from measure.estimators.kinds import ESTIMATORS
from measure.features.layout import Layout
from scenes import InvalidInput, Noise

_ALIKE = ("strip", "arrangement")  # those that take pixels for independent and equally noisy
SYNONYMS = {"polygon": "arrangement"}  # a polygon alone is the simplest arrangement

for _name, _kind in {
    "canny": canny.CANNY, "gradient": gradient.GRADIENT, "isophote": isophote.ISOPHOTE,
    "strip": strip.STRIP, "arrangement": arrangement.ARRANGEMENT,
}.items():  # fmt: skip
    ESTIMATORS.add(_name)(_kind)


def known_name(name: str) -> str:
    """The estimator's name, of a synonym too; raises InvalidInput if there is none of this name."""
    name = SYNONYMS.get(name, name)
    _ = ESTIMATORS[name]
    return name


def is_for(name: str, noise: Noise) -> bool:
    """Whether an estimator takes pixels for what they are under a sensor's noise."""
    return name not in _ALIKE or (noise.colour is None and not noise.is_shared)


def estimator(layout: Layout, name: str, threshold: float = 12.0) -> Estimator:
    """Prepare an estimator.

    Parameters
    ----------
    layout : Layout
    name : str
        One of `ESTIMATORS`; ``polygon`` is a synonym of ``arrangement``.
    threshold : float
        Gradient threshold of ``canny``, grey levels a pixel.

    Raises
    ------
    InvalidInput
        If the name is unknown or not for such a layout, or the threshold not positive.
    """
    name = known_name(name)
    if not threshold > 0:
        raise InvalidInput(f"threshold must be greater than 0, got {threshold!r}")
    sensor = layout.optics.sensor
    if not is_for(name, sensor):
        others = ", ".join(each for each in ESTIMATORS if each not in _ALIKE)
        why = "colour, whose pixels are not alike" if sensor.colour else "row_sigma or column_sigma, which pixels share"
        raise InvalidInput(f"estimator must be one of {others} with noise.{why}, got {name!r}")
    return ESTIMATORS[name].of(layout).prepare(layout, threshold)
