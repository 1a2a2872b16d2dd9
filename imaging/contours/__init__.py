"""Limbs: where the line of sight touches a curved surface, in space and in the image."""

from imaging.contours.contour import Contour, contour
from imaging.contours.limb import Limb, Strand, limb
from imaging.contours.statuses import BEHIND, CONCAVE, DEGENERATE, INSIDE, NONE, OK, TANGENT

__all__ = [
    "BEHIND", "CONCAVE", "DEGENERATE", "INSIDE", "NONE", "OK", "TANGENT",
    "Contour", "Limb", "Strand", "contour", "limb",
]  # fmt: skip
