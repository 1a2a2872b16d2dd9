"""What a user's set-up allows: where sensor and light may stand, and what the sensor must see."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from imaging.features.projected_edges import projected_edges
from imaging.geometry.projection import direction, light_position, project
from imaging.geometry.rays import reaches
from imaging.pictures import Pictures
from scenes import InvalidInput, Pose, Scene

WHOLE = (0.0, 180.0)  # polar angles of the sphere
_BODY = 0.05  # of the distance: radius of a body of which nothing is said
_CAP = 1e-4  # of the part's size, squared: smaller places that its file leaves open may be seen
Region = tuple[float, float, float]  # polar, azimuth, radius, degrees


@dataclass(frozen=True)
class Constraints:
    """Limits on a plan; by default camera and lamp stay clear of each other, each on its side of the part.

    Attributes
    ----------
    sensor_polar_deg, light_polar_deg : pair of float, optional
        Least and greatest polar angle. Where not given, those of the hemisphere in which the scene's first setting has
        it, the upper one without any (`on_side_of`).
    sensor_azimuth_deg, light_azimuth_deg : pair of float, optional
        From one azimuth to another, growing: (350, 20) are 30 degrees. All where not given.
    camera_body, light_body : float, optional
        Radius of the sphere about each that holds its body, in the scene's unit; a twentieth of its distance where not
        given, 0 for a point. The two bodies must not touch.
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
        Whether the light is mounted at the sensor: both in the same direction. Their bodies are then one.
    """

    sensor_polar_deg: tuple[float, float] | None = None
    light_polar_deg: tuple[float, float] | None = None
    sensor_azimuth_deg: tuple[float, float] | None = None
    light_azimuth_deg: tuple[float, float] | None = None
    camera_body: float | None = None
    light_body: float | None = None
    forbidden_sensor: tuple[Region, ...] = ()
    forbidden_light: tuple[Region, ...] = ()
    min_edge_px: float = 0.0
    min_clearance_px: float = 0.0
    light_out_of_view: bool = False
    min_separation_deg: float = 0.0
    same_mount: bool = False

    def __post_init__(self) -> None:
        for role in ("sensor", "light"):
            low, high = getattr(self, f"{role}_polar_deg") or WHOLE
            _check(0 <= low <= high <= 180, f"{role}_polar_deg", "two rising angles between 0 and 180", (low, high))
            limits = getattr(self, f"{role}_azimuth_deg")
            told = limits is None or (np.isfinite(limits).all() and abs(limits[1] - limits[0]) <= 360)
            _check(told, f"{role}_azimuth_deg", "two azimuths at most 360 degrees apart", limits)
            for polar, azimuth, radius in getattr(self, f"forbidden_{role}"):
                told = 0 <= polar <= 180 and np.isfinite(azimuth) and 0 <= radius <= 180
                _check(told, f"forbidden_{role}", "polar, azimuth and radius in degrees", (polar, azimuth, radius))
        for name in ("camera_body", "light_body"):
            radius = getattr(self, name)
            _check(radius is None or 0 <= radius <= 1e12, name, "a radius of at least 0", radius)
        for name, most in (("min_edge_px", 1e9), ("min_clearance_px", 1e9), ("min_separation_deg", 180)):
            value = getattr(self, name)
            _check(0 <= value <= most, name, f"at {f'most {most:g}' if value > most else 'least 0'}", value)
        _check(not (self.same_mount and self.min_separation_deg > 0), "min_separation_deg", "0 with same_mount",
               self.min_separation_deg)  # fmt: skip

    def on_side_of(self, scene: Scene) -> Constraints:
        """The same, with the polar angles that are not given: a part that is seen from below is planned from below."""
        first = scene.settings[:1]
        sensor = self.sensor_polar_deg or same_side(each.sensor for each in first)
        light = self.light_polar_deg or same_side(pose for each in first for pose in each.lights)
        return replace(self, sensor_polar_deg=sensor, light_polar_deg=light)

    @property
    def on_pairs(self) -> bool:
        """Whether anything is asked of sensor and light together."""
        return self.coupled or self.camera_body != 0 or self.light_body != 0

    @property
    def coupled(self) -> bool:
        """Whether more is asked than that their bodies are clear of each other."""
        return self.light_out_of_view or self.min_separation_deg > 0 or self.same_mount

    def sensors(self, scene: Scene, poses: np.ndarray) -> np.ndarray:
        """Which sensor poses (n, 2) are allowed, bool (n,); none that sees what the part's file leaves open."""
        allowed = _polar(poses, self.sensor_polar_deg) & _outside(poses, self.forbidden_sensor)
        allowed &= _around(poses, self.sensor_azimuth_deg)
        if scene.solid.caps:
            allowed &= ~_sees_caps(scene, poses)
        if self.min_edge_px > 0 or self.min_clearance_px > 0:
            view = projected_edges(Pictures.of(scene, poses))
            allowed &= (view.usable >= self.min_edge_px).all(-1) & view.visible.all(-1)
            if self.min_clearance_px > 0:
                allowed &= _clearance(scene, view) >= self.min_clearance_px
        return allowed

    def lights(self, poses: np.ndarray) -> np.ndarray:
        """Which light poses (n, 2) are allowed; bool, shape (n,)."""
        allowed = _polar(poses, self.light_polar_deg) & _outside(poses, self.forbidden_light)
        return allowed & _around(poses, self.light_azimuth_deg)

    def pairs(self, scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """Which pairs of a sensor's (..., 2) and the free lights' (..., 2 F) poses, broadcast, are allowed; bool."""
        allowed = np.ones(np.broadcast_shapes(sensors.shape[:-1], lights.shape[:-1]), bool)
        for i, which in enumerate(scene.free):
            allowed &= self._pairs(scene, sensors, lights[..., 2 * i : 2 * i + 2], which)
        return allowed

    def _pairs(self, scene: Scene, sensors: np.ndarray, lights: np.ndarray, which: int) -> np.ndarray:
        """The same of one of the lights."""
        cosine = np.einsum("...i,...i->...", direction(sensors), direction(lights))
        allowed = cosine <= self.largest_cosine(scene, which)
        if self.same_mount:
            allowed = allowed & (cosine > 1 - 1e-12)
        if self.light_out_of_view:
            allowed = allowed & ~_in_view(scene, sensors, lights, which)
        return allowed

    def largest_cosine(self, scene: Scene, which: int) -> float:
        """Largest cosine of the angle between sensor and a light; above 1 where any is allowed."""
        apart = np.cos(np.radians(self.min_separation_deg)) if self.min_separation_deg > 0 else np.inf
        if self.same_mount:
            return float(apart)
        camera, light = scene.camera.distance, scene.lights[which].distance
        bodies = _BODY * camera if self.camera_body is None else self.camera_body
        bodies += _BODY * light if self.light_body is None else self.light_body
        if bodies <= abs(camera - light):
            return float(apart)
        return float(min(apart, (camera**2 + light**2 - bodies**2) / (2 * camera * light)))

    def allows(self, scene: Scene, sensor: np.ndarray, light: np.ndarray) -> bool:
        """Whether one setting, a sensor (2,) and the free lights (2 F,), is allowed."""
        return bool(self.allowed(scene, sensor[None], light[None])[0])

    def allowed(self, scene: Scene, sensors: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """Which settings, sensors (n, 2) and the free lights (n, 2 F), are allowed; bool, shape (n,)."""
        lit = self.lights(lights.reshape(-1, 2)).reshape(len(lights), -1).all(-1)
        return self.sensors(scene, sensors) & lit & self.pairs(scene, sensors, lights)


def _check(good: bool, name: str, must: str, got: object) -> None:
    if not good:
        raise InvalidInput(f"{name} must be {must}, got {got}")


def _around(poses: np.ndarray, limits: tuple[float, float] | None) -> np.ndarray:
    """Whether azimuths lie from one to another, growing; at the pole any does."""
    if limits is None:
        return np.ones(len(poses), bool)
    return ((poses[:, 1] - limits[0] + 1e-9) % 360 <= turn_of(limits) + 2e-9) | (poses[:, 0] < 1e-9)


def _sees_caps(scene: Scene, poses: np.ndarray) -> np.ndarray:
    """Which sensor poses (n, 2) see a face that closes what the part's file leaves open; bool, shape (n,)."""
    solid = scene.solid
    wide = [face for face in solid.caps if solid.areas[face] >= _CAP * solid.extent**2]
    shown = np.isin(solid.triangle_faces, wide)
    points, faces = solid.triangles[shown].mean(1), solid.triangle_faces[shown]
    at = Pictures.of(scene, poses).viewpoint.widened().origins(points)
    return reaches(solid, points, faces, at).any(-1)


def turn_of(azimuths: tuple[float, float]) -> float:
    """How far it is from one azimuth to another, growing, degrees; all around between such as are 360 apart.

    >>> turn_of((350, 20)), turn_of((180, -180)), turn_of((7, 7))
    (30, 360, 0)
    """
    low, high = azimuths
    return 360 if abs(high - low) == 360 else (high - low) % 360


def same_side(poses: Iterable[Pose]) -> tuple[float, float]:
    """Polar angles of the hemisphere in which poses stand: the upper one without any, both where some are in each.

    >>> same_side([Pose(160, 20)]), same_side([]), same_side([Pose(20, 0), Pose(100, 0)])
    ((90.0, 180.0), (0.0, 90.0), (0.0, 180.0))
    """
    polar = [pose.polar_deg for pose in poses]
    return (0.0 if min(polar, default=0.0) <= 90 else 90.0), (180.0 if max(polar, default=0.0) > 90 else 90.0)


def _polar(poses: np.ndarray, limits: tuple[float, float] | None) -> np.ndarray:
    low, high = limits or WHOLE
    return (poses[:, 0] >= low - 1e-9) & (poses[:, 0] <= high + 1e-9)


def _outside(poses: np.ndarray, regions: tuple[Region, ...]) -> np.ndarray:
    allowed = np.ones(len(poses), bool)
    for polar, azimuth, radius in regions:
        allowed &= direction(poses) @ direction(np.array([polar, azimuth])) < np.cos(np.radians(radius))
    return allowed


def _in_view(scene: Scene, sensors: np.ndarray, lights: np.ndarray, which: int) -> np.ndarray:
    """Whether the light's image falls into the sensor's."""
    sensors, lights = np.broadcast_arrays(sensors, lights)
    image = project(light_position(scene.camera, scene.lights[which], lights)[..., None, :], sensors, scene.camera)[
        ..., 0, :
    ]
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


UNCONSTRAINED = Constraints(WHOLE, WHOLE, camera_body=0.0, light_body=0.0)
