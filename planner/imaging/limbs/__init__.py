"""Limbs: where the line of sight touches a curved surface, in space and in the image."""

from planner.imaging.limbs.conics import Ellipse, ellipse_of, image_conic
from planner.imaging.limbs.contour import Contour, contour
from planner.imaging.limbs.limb import Limb, Strand, limb
from planner.imaging.limbs.statuses import BEHIND, CONCAVE, DEGENERATE, INSIDE, NONE, OK, TANGENT

__all__ = [
    "BEHIND", "CONCAVE", "DEGENERATE", "INSIDE", "NONE", "OK", "TANGENT",
    "Contour", "Ellipse", "Limb", "Strand", "contour", "ellipse_of", "image_conic", "limb",
]  # fmt: skip
