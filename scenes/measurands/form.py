"""Form tolerances (ISO 1101): the zone that all points of one feature need, beside a reference fitted to them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar, Literal

from scenes.measurands.evaluated import Evaluated
from scenes.measurands.kind import MEASURANDS, MeasurandKind

Reference = Literal["line", "circle", "nominal"]


class Form(MeasurandKind):
    """The size of zone that a feature's points need: no function of one line or circle, but of all edge points.

    The size is a maximum less a minimum, so that noise makes it larger: what is told has that taken off, and it is
    decided by the law of the points' joint errors (`imaging.models.form_law`). No filter is applied but the locator's
    own Gaussian along the edge.
    """

    nominals = 0
    zone = 1.0
    is_form = True
    reference: ClassVar[Reference]
    """From what the points' distances are taken: a least-squares line or circle, or the nominal place."""

    def in_image(self, seen: Any, quantity: Any) -> Evaluated:
        """In px: the size times the image of a unit length across the feature, at its middle."""
        return seen.form(quantity).times(seen.magnified(quantity.features[0]))

    def on_plane(self, seen: Any, quantity: Any) -> Evaluated:
        """The scene's unit."""
        return seen.form(quantity)


def forms_of(quantities: Iterable[Any]) -> tuple[Any, ...]:
    """Those of some quantities that are forms."""
    return tuple(each for each in quantities if reference_of(each) is not None)


def reference_of(quantity: Any) -> Reference | None:
    """From what distances of points are taken; None of what is no form."""
    kind = MEASURANDS[quantity.kind]
    return kind.reference if isinstance(kind, Form) else None
