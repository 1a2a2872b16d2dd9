"""What some faces of the object are made of: every kind of material has a counterpart that names its faces."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import create_model

from scenes.materials.brdf import Brdf
from scenes.materials.kinds import MATERIALS
from scenes.materials.torrance_sparrow import Material
from scenes.model import Name
from scenes.registry import OneOf, Registry
from scenes.selection import OnFaces


class Applied(OnFaces):
    """A material of a name, on the faces that are chosen."""

    name: Name
    """For messages and tables."""

    made_of: ClassVar[type[Brdf]]

    @property
    def material(self) -> Brdf:
        """The material itself."""
        return self.made_of(**{key: getattr(self, key) for key in self.made_of.model_fields})


class FaceMaterial(Material, Applied):
    """What some faces of the object are made of, instead of `material`."""

    made_of = Material


FACE_MATERIALS: Registry[type[Applied]] = Registry("materials.kind")
FACE_MATERIALS.add("torrance_sparrow")(FaceMaterial)
AnyFaceMaterial = Annotated[Applied, OneOf(FACE_MATERIALS, "torrance_sparrow")]


def _follow() -> None:
    """A counterpart for each kind of material, and none for one that is gone."""
    for name in set(FACE_MATERIALS) - set(MATERIALS):
        FACE_MATERIALS.remove(name)
    for name in set(MATERIALS) - set(FACE_MATERIALS):
        kind = MATERIALS[name]
        made = create_model(f"Face{kind.__name__}", __base__=(kind, Applied), __module__=kind.__module__)
        made.made_of = kind
        FACE_MATERIALS.add(name)(made)


MATERIALS.followed_by(_follow)
