"""What is found in a photograph before it is measured: a shape's kind, where it roughly is, how it stands out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from measure.features.conic import around

QUADRILATERAL, CIRCLE, ELLIPSE, TAG, CHESSBOARD = KINDS = ("quadrilateral", "circle", "ellipse", "tag", "chessboard")


@dataclass(frozen=True, eq=False)
class Candidate:
    """A shape that stands out in a photograph; lengths in px of the photograph.

    Attributes
    ----------
    kind : {"quadrilateral", "circle", "ellipse", "tag", "chessboard"}
        A circle is an ellipse whose axes could be equal.
    outline : ndarray, shape (k, 2)
        (x, y), (0, 0) the centre of the first pixel: the four corners of a quadrilateral, the first the one nearest to
        the image's upper left corner, and of a tag's black square in the tag's own order; 64 points of an ellipse; the
        four outer ones of a chessboard's inner corners. To a pixel or two (of half a megapixel, where there are more).
    support : float
        Part of the outline, of a quadrilateral's worst side, on which the image changes across it: by more than four
        standard deviations of the noise and at least a quarter of what is usual along it.
    contrast : float
        Difference of the grey levels inside and outside the weakest side over the noise's standard deviation;
        negative where the inside is darker.
    score : float
        Signal to noise ratio of the whole outline: size of contrast * support * root of its length in px. Candidates
        are ranked by it.
    parameters : ndarray, shape (5,), optional
        Centre x, y, semi-axes a >= b, px, and angle of a, degrees, of an ellipse.
    identifier : int, optional
        Number of a tag.
    family : str, optional
        Dictionary of a tag, as OpenCV calls it.
    grid : ndarray, shape (rows, columns, 2), optional
        All inner corners of a chessboard.
    """

    kind: str
    outline: np.ndarray
    support: float
    contrast: float
    score: float
    parameters: np.ndarray | None = None
    identifier: int | None = None
    family: str | None = None
    grid: np.ndarray | None = None

    @property
    def centre(self) -> np.ndarray:
        """Mean of the outline, (2,)."""
        return self.outline.mean(0)

    @property
    def area(self) -> float:
        """Of the outline, px^2."""
        return float(cv2.contourArea(self.outline.astype(np.float32)))

    @property
    def sizes(self) -> tuple[float, ...]:
        """Mean lengths of both pairs of opposite sides, or both axes of an ellipse, px."""
        if self.parameters is not None:
            return tuple((2 * self.parameters[2:4]).tolist())
        sides = np.linalg.norm(np.roll(self.outline, -1, 0) - self.outline, axis=1)
        return float(sides[0::2].mean()), float(sides[1::2].mean())

    def distance(self, point: np.ndarray) -> float:
        """How far a point (2,) is outside the outline, px; negative inside."""
        return -cv2.pointPolygonTest(self.outline.astype(np.float32), tuple(map(float, point)), True)

    def moved(self, by: np.ndarray) -> Candidate:
        """The same, moved by (x, y), px."""
        moved = {"outline": self.outline + by}
        if self.parameters is not None:
            moved["parameters"] = self.parameters + [*by, 0, 0, 0]
        if self.grid is not None:
            moved["grid"] = self.grid + by
        return replace(self, **moved)


def ellipse_outline(parameters: np.ndarray, count: int = 64) -> np.ndarray:
    """Points (count, 2) of an ellipse x, y, a, b, angle (degrees)."""
    return around(parameters, count)[0]
