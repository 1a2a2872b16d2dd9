"""The kinds of estimators by name: how each is prepared for a layout, and what is stated of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import cast

from imaging.light.appearance import is_plain
from measure.estimators.estimate import Estimator
from measure.estimators.separate import SeparateEstimator
from measure.features.layout import Layout
from scenes import InvalidInput, Scene
from scenes.registry import Registry

_AND, _AT = ", ", " at "


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
    separate : bool
        Whether it measures each edge by itself, so that others may be measured by another one (`mixed_estimator`).
    knowing : EstimatorKind, optional
        What stands in its place where things hide or light each other and the scene's levels are known.
    """

    prepare: Callable[[Layout, float], Estimator]
    capture_px: float
    exact_px: float
    bias_predicted: bool = False
    local: bool = False
    separate: bool = False
    knowing: EstimatorKind | None = None

    def of(self, layout: Layout) -> EstimatorKind:
        """The kind that measures in a layout."""
        return self if self.knowing is None or layout.levels is None else self.knowing

    def within(self, scene: Scene) -> EstimatorKind:
        """The kind that measures in a scene whose lights are known."""
        return self if self.knowing is None or is_plain(scene) else self.knowing

    def with_edges(self, other: EstimatorKind, edges: frozenset[str]) -> EstimatorKind:
        """The kind that measures these edges, by their names, by another one."""

        def prepare(layout: Layout, threshold: float) -> SeparateEstimator:
            if not edges <= set(layout.names):
                raise InvalidInput(f"estimator must be at edges that are measured, got {' '.join(sorted(edges))!r}")
            tools = [cast("SeparateEstimator", kind.prepare(layout, threshold)) for kind in (self, other)]
            of = [tools[name in edges] for name in layout.names]
            return SeparateEstimator(
                tuple(tool.calipers[e] for e, tool in enumerate(of)), tuple(tool.parts[e] for e, tool in enumerate(of))
            )

        return EstimatorKind(
            prepare,
            capture_px=min(self.capture_px, other.capture_px),
            exact_px=max(self.exact_px, other.exact_px),
            local=self.local and other.local,
            separate=True,
        )


class Estimators(Registry[EstimatorKind]):
    """By their names; by that of `mixed_estimator`, too, which is not listed."""

    def __getitem__(self, name: str) -> EstimatorKind:
        one, comma, rest = str(name).partition(_AND)
        other, at, edges = rest.partition(_AT)
        if not (comma and at):
            return super().__getitem__(name)
        pair = tuple(kind if kind.separate else kind.knowing or kind for kind in map(super().__getitem__, (one, other)))
        if not all(kind.separate for kind in pair):
            raise InvalidInput(f"estimator must be of two that measure each edge by itself, got {name!r}")
        return pair[0].with_edges(pair[1], frozenset(edges.split()))


def mixed_estimator(one: str, other: str, edges: Iterable[str], scene: Scene | None = None) -> str | None:
    """Name of the estimator that measures as one does, but some edges, by their names, as another does.

    None where one of the two does not measure each edge by itself, in a scene or in all of them.

    Examples
    --------
    >>> mixed_estimator("gradient", "isophote", ["e7", "e3"])
    'gradient, isophote at e3 e7'
    >>> mixed_estimator("gradient", "arrangement", ["e7"])
    """
    kinds = [ESTIMATORS[name] if scene is None else ESTIMATORS[name].within(scene) for name in (one, other)]
    if not all(kind.separate for kind in kinds):
        return None
    return f"{one}{_AND}{other}{_AT}{' '.join(sorted(edges))}"


ESTIMATORS = Estimators("estimator")
