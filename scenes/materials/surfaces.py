"""Which face is made of what."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from scenes.materials.brdf import Brdf
from scenes.materials.on_faces import AnyFaceMaterial
from scenes.parts.solid import Solid


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Materials and the faces that are made of them.

    Attributes
    ----------
    materials : tuple of Brdf
        The different ones; the first is that of all faces that nothing else is said of, and of the obstacles.
    kinds : ndarray of int, shape (F,)
        For each face of object and obstacles which of them it is made of.
    """

    materials: tuple[Brdf, ...]
    kinds: np.ndarray

    def of(self, face: int) -> Brdf:
        """The material of a face."""
        return self.materials[self.kinds[face]]

    @cached_property
    def used(self) -> tuple[Brdf, ...]:
        """The materials that any face is made of."""
        return tuple(self.materials[kind] for kind in np.unique(self.kinds))

    @cached_property
    def is_diffuse(self) -> bool:
        """Whether the specular term is exactly zero everywhere."""
        return all(material.is_diffuse for material in self.used)


@lru_cache(maxsize=64)
def surfaces(material: Brdf, materials: tuple[AnyFaceMaterial, ...], measured: Solid, faces: int) -> Surfaces:
    """Of an object and obstacles of so many ``faces`` together.

    Raises
    ------
    ValueError
        If a material's name comes twice, a face is unknown or has two materials, or the wall of a circle has several.
    """
    kinds, owners = np.zeros(faces, int), {}
    for i, each in enumerate(materials):
        key = f"materials[{i}]"
        if each.name in [other.name for other in materials[:i]]:
            raise ValueError(f"{key}.name must be a name of its own, got {each.name!r} again")
        for face in each.chosen(measured, key):
            if face in owners:
                got = f"{measured.face_names[face]!r}, which is of {owners[face]!r}"
                raise ValueError(
                    f"{key}.{'faces' if each.faces else 'where'} must be faces without a material, got {got}"
                )
            owners[face], kinds[face] = each.name, i + 1
    _check_walls(measured, kinds)
    return Surfaces((material, *(each.material for each in materials)), kinds)


def _check_walls(solid: Solid, kinds: np.ndarray) -> None:
    """The wall of a circle is one surface, which stands for all its facets."""
    for circle in solid.circles:
        walls = {face for name in circle.edges for face in solid.edge(name).faces} - {circle.face}
        if len({int(kinds[face]) for face in walls}) > 1:
            raise ValueError(f"materials must leave the wall of circle {circle.name} one material, got several")
