"""What is looked at: the bundled scenes' settings, the paper's block through a bent lens, and at random poses."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import scenes
from scenes import InvalidInput, Pose, Scene
from validation.batch.campaign import changed

DISTORTED, POSES = "task1 distorted", "task1 poses"
_BENT = {"camera.lens.distortion": -0.2}  # k1
_SENSOR_POLAR, _LIGHT_POLAR = (5.0, 75.0), (2.0, 75.0)  # degrees


@dataclass(frozen=True)
class Place:
    """One setting of a group: what the group is called, its number there, the scene, and the poses."""

    group: str
    index: int
    scene: Scene
    sensor: Pose
    light: Pose

    def rng(self, seed: int, batch: int) -> np.random.Generator:
        """Random numbers that depend on seed, setting and batch alone: not on what else is run, nor by whom."""
        key = zlib.crc32(self.group.encode()), self.index, batch
        return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def groups() -> tuple[str, ...]:
    """Names of all groups: the bundled scenes that have settings and one distance, and the two made from Task1."""
    loaded = {name: scenes.load(name) for name in scenes.names()}
    return (*(name for name, scene in loaded.items() if scene.settings and scene.task), DISTORTED, POSES)


def places(wanted: tuple[str, ...], poses: int, seed: int) -> list[Place]:
    """All settings of the groups wanted.

    Parameters
    ----------
    wanted : tuple of str
        Some of `groups`.
    poses, seed : int
        How many random poses, and the seed they come from.

    Raises
    ------
    InvalidInput
        If there is no such group.
    """
    for name in wanted:
        if name not in groups():
            raise InvalidInput(f"--scenes must be some of {', '.join(groups())}, got {name!r}")
    return [place for name in wanted for place in _group(name, poses, seed)]


def _group(name: str, poses: int, seed: int) -> Iterator[Place]:
    if name == POSES:
        yield from random_poses(poses, seed)
        return
    scene = scenes.load("task1" if name == DISTORTED else name)
    seen = changed(scene, _BENT) if name == DISTORTED else scene
    for index, setting in enumerate(scene.settings):
        yield Place(name, index, seen, setting.sensor, setting.light)


def random_poses(count: int, seed: int) -> Iterator[Place]:
    """Task1 from anywhere that its top is seen and lit: poses that no table has; more of them begin with the fewer."""
    scene = scenes.load("task1")
    for index in range(count):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index,)))
        sensor, light = (Pose(rng.uniform(*polar), rng.uniform(0, 360)) for polar in (_SENSOR_POLAR, _LIGHT_POLAR))
        yield Place(POSES, index, scene, sensor, light)
