"""How far an edge is from straight."""

from __future__ import annotations

from scenes.measurands.features import Side
from scenes.measurands.form import Form
from scenes.measurands.kind import MEASURANDS


class Straightness(Form):
    """Distance between the two lines, parallel to an edge's least-squares line, that hold all its points.

    ISO 12780-1: STRt (peak to valley) about LSLI, in the plane of the larger of the two faces that meet in the edge;
    of the part of the edge that can be measured, its corners left out.
    """

    features = ("e",)
    reference = "line"

    def check(self, solid, key, quantity) -> None:
        """An edge of the part: what lies between others has no points of its own."""
        if not isinstance(quantity.features[0], Side):
            raise ValueError(f"{key} must be an edge for kind straightness, got {', '.join(quantity.edges)}")


MEASURANDS.add("straightness")(Straightness())
