"""The kinds of estimators by name: how each is prepared for a layout, and what is stated of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from measure.estimators.estimate import Estimator
from measure.features.layout import Layout
from scenes.registry import Registry


@dataclass(frozen=True)
class EstimatorKind:
    """An estimator of the straight edges of a layout.

    Attributes
    ----------
    prepare : callable
        Of a `Layout` and the gradient threshold (grey levels a pixel, which only ``canny`` asks for), an `Estimator`.
    capture_px : float
        Largest offset from the expected edge at which the result is as good as at none; infinite where it follows the
        edge itself.
    exact_px : float
        How far off, at most, a length of about 100 px is in an exact image without noise.
    bias_predicted : bool
        Whether its bias is what `imaging.models.bias` says.
    local : bool
        Whether it looks at no pixel farther from its edges than the scene's `window_px` and the scale of its filter.
    """

    prepare: Callable[[Layout, float], Estimator]
    capture_px: float
    exact_px: float
    bias_predicted: bool = False
    local: bool = False


ESTIMATORS: Registry[EstimatorKind] = Registry("estimator")
