"""What surfaces are made of, what is printed on them, and which face is made of what."""

from scenes.materials.brdf import Brdf, Index
from scenes.materials.kinds import MATERIALS, AnyMaterial
from scenes.materials.on_faces import AnyFaceMaterial, FaceMaterial
from scenes.materials.torrance_sparrow import Material

__all__ = ["MATERIALS", "AnyFaceMaterial", "AnyMaterial", "Brdf", "FaceMaterial", "Index", "Material"]
