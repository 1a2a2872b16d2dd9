"""What a user's set-up allows: where sensor and light may stand, and what the sensor must see."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.features.projected_edges import projected_edges
from planner.imaging.pictures import Pictures
from planner.imaging.projection import direction, light_position, project
from scenes import InvalidInput, Scene

Region = tuple[float, float, float]  # polar, azimuth, radius, degrees


@dataclass(frozen=True)
class Constraints:
    """Limits on a plan; the default is the upper hemisphere.

    Attributes
    ----------
    sensor_polar_deg, light_polar_deg : pair of float
        Least and greatest polar angle.
    forbidden_sensor, forbidden_light : tuple of (polar, azimuth, radius)
        Regions, degrees, in which it may not stand.
    min_edge_px : float
        Least usable length of every required edge, px.
    min_clearance_px : float
        Least distance in the image between any two required edges that do not share a vertex, px.
    light_out_of_view : bool
        Whether the light must not stand within the sensor's image.
    min_separation_deg : float
        Least angle between sensor and light, seen from the object.
    same_mount : bool
        Whether the light is mounted at the sensor: both in the same direction.
    """

    sensor_polar_deg: tuple[float, float] = (0.0, 90.0)
    light_polar_deg: tuple[float, float] = (0.0, 90.0)
    forbidden_sensor: tuple[Region, ...] = ()
    forbidden_light: tuple[Region, ...] = ()
    min_edge_px: float = 0.0
    min_clearance_px: float = 0.0
    light_out_of_view: bool = False
    min_separation_deg: float = 0.0
    same_mount: bool = False

    def __post_init__(self) -> None:
        for name in ("sensor_polar_deg", "light_polar_deg"):
            low, high = getattr(self, name)
            if not 0 <= low <= high <= 180:
                raise InvalidInput(f"{name} must be two rising angles between 0 and 180, got {(low, high)}")
        for name, most in (("min_edge_px", 1e9), ("min_clearance_px", 1e9), ("min_separation_deg", 180)):
            value = getattr(self, name)
            if not 0 <= value <= most:
                raise InvalidInput(f"{name} must be at {f'most {most:g}' if value > most else 'least 0'}, got {value}")
        for name in ("forbidden_sensor", "forbidden_light"):
            for region in getattr(self, name):
                polar, azimuth, radius = region
                if not (0 <= polar <= 180 and np.isfinite(azimuth) and 0 <= radius <= 180):
                    raise InvalidInput(f"{name} must be polar, azimuth and radius in degrees, got {region}")

    @property
    def on_pairs(self) -> bool:
        """Whether anything is asked of sensor and light together."""
        return self.light_out_of_view or self.min_separation_deg > 0 or self.same_mount

    def sensors(self, scene: Scene, poses: np.ndarray) -> np.ndarray:
        """Which sensor poses (n, 2) are allowed; bool, shape (n,)."""
        allowed = _polar(poses, self.sensor_polar_deg) & _outside(poses, self.forbidden_sensor)
        if self.min_edge_px > 0 or self.min_clearance_px > 0:
            view = projected_edges(Pictures.of(scene, poses))
            allowed &= (view.usable >= self.min_edge_px).all(-1) & view.visible.all(-1)
            if self.min_clearance_px > 0:
                allowed &= _clearance(scene, view) >= self.min_clearance_px
        return allowed

    def lights(self, poses: np.ndarray) -> np.ndarray:
        """Which light poses (n, 2) are allowed; bool, shape (n,)."""
        return _polar(poses, self.light_polar_deg) & _outside(poses, self.forbidden_light)

    def pairs(self, scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """Which pairs of poses (..., 2), broadcast, are allowed; bool, shape (...)."""
        cosine = np.einsum("...i,...i->...", *np.broadcast_arrays(direction(sensors), direction(lights)))
        allowed = cosine <= np.cos(np.radians(self.min_separation_deg)) + (self.min_separation_deg == 0)
        if self.same_mount:
            allowed = allowed & (cosine > 1 - 1e-12)
        if self.light_out_of_view:
            allowed = allowed & ~_in_view(scene, sensors, lights)
        return allowed

    def allows(self, scene: Scene, sensor: np.ndarray, light: np.ndarray) -> bool:
        """Whether one setting is allowed."""
        return bool(
            self.sensors(scene, sensor[None])[0] and self.lights(light[None])[0] and self.pairs(scene, sensor, light)
        )


def _polar(poses: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    return (poses[:, 0] >= limits[0] - 1e-9) & (poses[:, 0] <= limits[1] + 1e-9)


def _outside(poses: np.ndarray, regions: tuple[Region, ...]) -> np.ndarray:
    allowed = np.ones(len(poses), bool)
    for polar, azimuth, radius in regions:
        allowed &= direction(poses) @ direction(np.array([polar, azimuth])) < np.cos(np.radians(radius))
    return allowed


def _in_view(scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
    """Whether the light's image falls into the sensor's."""
    sensors, lights = np.broadcast_arrays(sensors, lights)
    image = project(light_position(scene.camera, scene.light, lights)[..., None, :], sensors, scene.camera)[..., 0, :]
    size = np.array([scene.camera.width, scene.camera.height])
    return ((image > -0.5) & (image < size - 0.5)).all(-1)


def _clearance(scene: Scene, view) -> np.ndarray:
    """Least distance between the images of required edges without a common vertex, px; infinite if there are none."""
    least = np.full(view.visible.shape[:-1], np.inf)
    edges = [scene.solid.edge(name) for name in view.names]
    fractions = np.linspace(0, 1, 17)[:, None]
    for i, one in enumerate(edges):
        for j, other in enumerate(edges):
            if i != j and not set(one.ends) & set(other.ends):
                start, stop = view.ends[..., i, :1, :], view.ends[..., i, 1:, :]
                points = start + fractions * (stop - start)
                least = np.minimum(least, _to_segment(points, view.ends[..., j, :, :]).min(-1))
    return least


def _to_segment(points: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Distance of points (..., n, 2) from the segment with ends (..., 2, 2), px."""
    start, along = ends[..., :1, :], ends[..., 1:, :] - ends[..., :1, :]
    size = np.maximum((along**2).sum(-1), np.finfo(float).tiny)
    fraction = np.clip(((points - start) * along).sum(-1) / size, 0, 1)
    return np.linalg.norm(points - start - fraction[..., None] * along, axis=-1)
