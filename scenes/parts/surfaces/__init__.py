"""Curved and plane surfaces that faces lie on: points, normals, rays, and how a change of their numbers moves them."""

from scenes.parts.surfaces.cone import Cone
from scenes.parts.surfaces.cylinder import Cylinder
from scenes.parts.surfaces.plane import Plane
from scenes.parts.surfaces.quadric import Quadric
from scenes.parts.surfaces.sphere import Sphere
from scenes.parts.surfaces.surface import Surface, axes_beside
from scenes.parts.surfaces.torus import Torus

__all__ = ["Cone", "Cylinder", "Plane", "Quadric", "Sphere", "Surface", "Torus", "axes_beside"]
