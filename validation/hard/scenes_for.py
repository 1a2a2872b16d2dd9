"""Scenes of the catalogue: Task1 with one thing changed, and solids that no bundled file has."""

from __future__ import annotations

from typing import Any

import numpy as np

import scenes
from scenes import Mesh, Scene
from scenes.parts.solid import Solid, block
from scenes.units import Unit


def task1(**changes: dict[str, Any]) -> Scene:
    """Task1 with some keys of some tables changed, e.g. ``task1(camera={"distance": 1e4})``; validated anew."""
    document = scenes.load("task1").model_dump(mode="json", exclude={"settings", "same_scale"})
    for table, values in changes.items():
        document[table] = {**document[table], **values}
    return Scene.model_validate(document)


def scaled(factor: float) -> Scene:
    """Task1 with every length of space multiplied."""
    old = scenes.load("task1")
    return task1(
        object={"size": [factor * side for side in old.object.size]},
        camera={"distance": factor * old.camera.distance},
        light={"distance": factor * old.light.distance},
    )


class _Made(Mesh):
    """A solid that no file holds."""

    made: Any

    def solid_in(self, unit: Unit | None) -> Solid:
        return self.made

    def __hash__(self) -> int:
        return id(self.made)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Made) and self.made is other.made


def with_solid(scene: Scene, solid: Solid) -> Scene:
    """The scene with another solid of the block's names, wherever it stands."""
    return scene.model_copy(update={"object": _Made(kind="mesh", file="made.stl", made=solid)})


def moved_block(scene: Scene, shift: tuple[float, float, float]) -> Scene:
    """The scene with its block away from the origin, shift in cm."""
    old = block(scene.object.size)
    return with_solid(scene, Solid(old.vertex_names, old.vertices + np.array(shift), old.faces, old.edges))
