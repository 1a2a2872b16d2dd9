"""From where cells of sensors look, and what is linear in the direction towards them, enclosed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.certifying.enclosed import Enclosed, variables
from planner.certifying.series import direction, dot, frame
from scenes import Edge, Scene


@dataclass(frozen=True, eq=False)
class View:
    """From where n cells of sensors look.

    Attributes
    ----------
    scene : Scene
    axis, right, down : list of Enclosed
        Unit vectors towards the sensor and along the image's axes, by their components, shape (n,) each.
    seen : ndarray of bool, shape (F,)
        Which of the solid's faces all see.
    """

    scene: Scene
    axis: list[Enclosed]
    right: list[Enclosed]
    down: list[Enclosed]
    seen: np.ndarray

    @classmethod
    def of(cls, scene: Scene, polar: np.ndarray, azimuth: np.ndarray, seen: np.ndarray) -> View:
        """From cells (n, 2), (n, 2), rad."""
        angles = variables(polar, azimuth)
        return cls(scene, direction(*angles), *frame(*angles, np.radians(scene.camera.roll_deg)), seen)

    def of_boxes(self, some: np.ndarray) -> View:
        """Of some of the cells alone."""
        axes = ([part.of_boxes(some) for part in axis] for axis in (self.axis, self.right, self.down))
        return View(self.scene, *axes, self.seen)

    def along(self, vector: np.ndarray) -> Enclosed:
        """Of a vector (3,) the part along the axis, its unit."""
        return dot(self.axis, vector)

    def from_eye(self, place: np.ndarray, vector: np.ndarray) -> Enclosed:
        """w . vector of a place (3,)."""
        camera = self.scene.camera
        rest = camera.perspective * float((np.array(camera.look_at) - place) @ vector)
        return self.along(camera.distance * vector) + rest

    def divisor(self, place: np.ndarray) -> Enclosed:
        """D of a place (3,), scene units."""
        camera = self.scene.camera
        return self.along(-camera.perspective * (place - np.array(camera.look_at))) + camera.distance

    def image(self, place: np.ndarray) -> tuple[Enclosed, Enclosed]:
        """Where a place (3,) is seen, px from the image's middle to the right and down."""
        away, scale = place - np.array(self.scene.camera.look_at), self.divisor(place).inverse()
        x, y = (dot(axis, away * self.scene.camera.focal_px) * scale for axis in (self.right, self.down))
        return x, y

    def over(self, corner: np.ndarray, one: np.ndarray, other: np.ndarray, edges: tuple[Edge, Edge]) -> Enclosed:
        """w . (one x other) of a corner and directions of edges that meet there, of the sign that a face tells that
        has both."""
        normal = np.cross(one, other)
        found, shared = self.from_eye(corner, normal), set(edges[0].faces) & set(edges[1].faces)
        if not shared:
            return found
        face = min(shared)
        up = 1.0 if (normal @ self.scene.solid.normals[face] > 0) == self.seen[face] else -1.0
        return (found * up).at_least(0.0) * up

    def height(self, start: np.ndarray, stop: np.ndarray) -> Enclosed:
        """h of the line from one place to another, scene units."""
        camera = self.scene.camera
        way, away = (stop - start) / np.linalg.norm(stop - start), start - np.array(camera.look_at)
        level, turned, share = self.along(way), np.cross(way, away), camera.perspective
        lean = (self.along(away) - level * float(way @ away)) * (2 * camera.distance * share)
        found = -(level.square()) * camera.distance**2 - lean - self.along(share * turned).square()
        return (found + camera.distance**2 + share**2 * float(turned @ turned)).sqrt()
