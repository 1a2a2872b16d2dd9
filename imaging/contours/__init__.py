"""Limbs: where the line of sight touches a curved surface, in space and in the image."""

from imaging.contours.conics import Ellipse, ellipse_of, image_conic
from imaging.contours.contour import Contour, contour
from imaging.contours.limb import Limb, Strand, limb
from imaging.contours.statuses import BEHIND, CONCAVE, DEGENERATE, INSIDE, NONE, OK, TANGENT

__all__ = [
    "BEHIND", "CONCAVE", "DEGENERATE", "INSIDE", "NONE", "OK", "TANGENT",
    "Contour", "Ellipse", "Limb", "Strand", "contour", "ellipse_of", "image_conic", "limb",
]  # fmt: skip
