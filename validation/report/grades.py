"""How grades look: colours that differ in lightness, and shapes of balloons that differ without any colour; and what
each of them means."""

from __future__ import annotations

from dataclasses import dataclass

from validation.report.requirements import WELL, Grade


@dataclass(frozen=True)
class Look:
    """Of a balloon: fill, border and text, colours as in CSS; its marker for matplotlib, and for a page an SVG path.

    The path lies in a square from (0, 0) to (24, 24).
    """

    fill: str
    border: str
    text: str
    marker: str
    path: str


_CIRCLE = "M12 1a11 11 0 1 0 .01 0z"
_SQUARE = "M2 2h20v20h-20z"
_DIAMOND = "M12 .5L23.5 12L12 23.5L.5 12z"
_OCTAGON = "M7.5 1h9L23 7.5v9L16.5 23h-9L1 16.5v-9z"

LOOKS = {
    Grade.WELL: Look("#0b5a8f", "#0b5a8f", "#ffffff", "o", _CIRCLE),
    Grade.WITHIN: Look("#f3c33c", "#5c4700", "#000000", "s", _SQUARE),
    Grade.OVER: Look("#8c1a11", "#8c1a11", "#ffffff", "D", _DIAMOND),
    Grade.OPEN: Look("#e4e4e4", "#333333", "#000000", "o", _CIRCLE),
    Grade.DOUBT: Look("#ffffff", "#8c1a11", "#000000", "8", _OCTAGON),
    Grade.MISSING: Look("#8c1a11", "#8c1a11", "#ffffff", "8", _OCTAGON),
}
MEANS = {
    Grade.WELL: f"{Grade.WELL} (U / half zone at most {100 * WELL:.0f} %)",
    Grade.WITHIN: f"{Grade.WITHIN} (U / half zone {100 * WELL:.0f} to 100 %)",
    Grade.OVER: f"{Grade.OVER} (U / half zone over 100 %)",
    Grade.OPEN: str(Grade.OPEN),
    Grade.DOUBT: f"{Grade.DOUBT} (do not rely on the value)",
    Grade.MISSING: f"{Grade.MISSING} (there is no value)",
}
