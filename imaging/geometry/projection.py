"""Poses and projection: where the sensor and the light stand, and where points of the scene land in the image.

Everything takes arrays of poses, shape (..., 2) = (polar, azimuth) in degrees, and keeps the leading shape.
Image coordinates are px with (0, 0) the centre of the first pixel, x to the right, y down.

One formula serves all kinds of cameras: what lies beside the axis by b at the depth z is seen f b / ((1 - s) d + s z)
from the image's middle, f the camera's ``focal_px``, d its distance, s its share of perspective: 1 of a pinhole, 0
where all lines of sight are parallel (`scenes.Camera.divisor`, `scenes.viewpoint`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imaging.geometry.lens import image_centre, lens_jacobian, recorded
from scenes import Camera, Luminaire, Solid
from scenes.viewpoint import Viewpoint

_EDGE_ON = 1e-12  # of the distance: how far over a face's plane the sensor must stand to see it


class Frame(NamedTuple):
    """Axes of a sensor that looks at its reference point: unit vectors, shape (..., 3)."""

    right: np.ndarray
    down: np.ndarray
    forward: np.ndarray


def direction(poses: np.ndarray) -> np.ndarray:
    """Unit vector from the origin to each pose, shape (..., 3)."""
    sine, cosine = _turns(poses)
    return _vectors(sine[..., 0] * cosine[..., 1], sine[..., 0] * sine[..., 1], cosine[..., 0])


def _turns(poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sines and cosines of poses' angles, each shape (..., 2)."""
    angles = np.radians(poses)
    return np.sin(angles), np.cos(angles)


def _vectors(x: np.ndarray, y: np.ndarray, z: np.ndarray | float) -> np.ndarray:
    """Vectors (..., 3) of their components: `numpy.stack` for the many calls with a single pose."""
    found = np.empty((*np.shape(x), 3))
    found[..., 0], found[..., 1], found[..., 2] = x, y, z
    return found


def frame(poses: np.ndarray) -> Frame:
    """Axes of the sensor at each pose.

    They are derivatives of the direction by the angles, so they exist at the poles too, where "the object's
    z axis up" says nothing.
    """
    sine, cosine = _turns(poses)
    up, aside, level, ahead = sine[..., 0], sine[..., 1], cosine[..., 0], cosine[..., 1]
    return Frame(
        _vectors(-aside, ahead, 0.0),
        _vectors(level * ahead, level * aside, -up),
        -_vectors(up * ahead, up * aside, level),
    )


def camera_frame(camera: Camera, poses: np.ndarray) -> Frame:
    """The same of a camera that is turned about its axis by ``roll_deg``, from right towards down."""
    axes, roll = frame(poses), np.radians(camera.roll_deg)
    if not roll:
        return axes
    cosine, sine = np.cos(roll), np.sin(roll)
    return Frame(cosine * axes.right + sine * axes.down, cosine * axes.down - sine * axes.right, axes.forward)


def light_frame(camera: Camera, light: Luminaire, poses: np.ndarray) -> Frame:
    """Axes of a light: right, down, and towards the reference point; one at the camera, before the object, turns with
    it."""
    turns = light.mount == "camera" and not light.faces_sensor
    return camera_frame(camera, poses) if turns else frame(poses)


def sensor_position(camera: Camera, poses: np.ndarray) -> np.ndarray:
    """Where the sensor stands, scene units, shape (..., 3)."""
    return np.array(camera.look_at) + camera.distance * direction(poses)


def viewpoint(camera: Camera, poses: np.ndarray) -> Viewpoint:
    """From where the camera looks: where it stands, or a direction where its lines of sight are parallel."""
    share = camera.perspective
    return Viewpoint(share * np.array(camera.look_at) + camera.distance * direction(poses), share)


def light_position(camera: Camera, light: Luminaire, poses: np.ndarray) -> np.ndarray:
    """Where a light stands, scene units, shape (..., 3): on a sphere around the point that the camera looks at.

    One at the camera may be aside of the axis.
    """
    centre = np.array(camera.look_at) + light.distance * direction(poses)
    if any(light.offset):
        axes = light_frame(camera, light, poses)
        centre = centre + light.offset[0] * axes.right + light.offset[1] * axes.down
    return centre


def project(points: np.ndarray, poses: np.ndarray, camera: Camera) -> np.ndarray:
    """Where the camera records points, the lens' distortion included.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Object coordinates, scene units.
    poses : ndarray, shape (..., 2)
        Sensor poses.

    Returns
    -------
    ndarray, shape (..., n, 2)
        Recorded image coordinates, px; NaN for points that are not in front of the sensor.
    """
    return recorded(project_ideal(points, poses, camera), camera)


def project_ideal(points: np.ndarray, poses: np.ndarray, camera: Camera) -> np.ndarray:
    """Ideal image coordinates of points (n, 3): those of a camera without distortion, px, shape (..., n, 2)."""
    return image_centre(camera) + from_axis(points, poses, camera)


def from_axis(points: np.ndarray, poses: np.ndarray, camera: Camera) -> np.ndarray:
    """The same from the image's middle, px: what is small against the image keeps its digits in differences."""
    axes = camera_frame(camera, poses)
    beside = (points - np.array(camera.look_at)) @ np.stack([axes.right, axes.down], -1)
    away = _along(points, camera, axes)[..., None]
    over = camera.divisor(away)
    return camera.focal_px * beside / np.where((away > 0) & (over > 0), over, np.nan)


def depth(points: np.ndarray, poses: np.ndarray, camera: Camera) -> np.ndarray:
    """Distance of points (..., n, 3) from the sensor along its axis, scene units, shape (..., n)."""
    return _along(points, camera, frame(poses))


def divisor(points: np.ndarray, poses: np.ndarray, camera: Camera) -> np.ndarray:
    """What ``focal_px`` is divided by for the px of a unit length at points (..., n, 3), scene units, shape (..., n).

    It changes linearly along a line in space; shares of a line's image follow from it as from a pinhole's depth.
    """
    return camera.divisor(depth(points, poses, camera))


def in_space(fractions: np.ndarray, near: np.ndarray, far: np.ndarray) -> np.ndarray:
    """Fractions of a line in space from those of its image, by the divisors at both ends; of broadcast shapes.

    >>> float(in_space(0.5, 1.0, 3.0))
    0.25
    """
    return fractions * near / (far + fractions * (near - far))


def _along(points: np.ndarray, camera: Camera, axes: Frame) -> np.ndarray:
    return camera.distance + np.einsum("...ni,...i->...n", points - np.array(camera.look_at), axes.forward)


def jacobian(points: np.ndarray, poses: np.ndarray, camera: Camera) -> np.ndarray:
    """Derivative of `project` (px) by the position (scene units) of points (n, 3), shape (..., n, 2, 3)."""
    ideal = project_ideal(points, poses, camera)
    return lens_jacobian(ideal, camera) @ jacobian_ideal(points, poses, camera)


def jacobian_ideal(points: np.ndarray, poses: np.ndarray, camera: Camera) -> np.ndarray:
    """Derivative of `project_ideal` (px) by the position (scene units) of points (n, 3), shape (..., n, 2, 3)."""
    axes = camera_frame(camera, poses)
    over, share = camera.divisor(_along(points, camera, axes))[..., None, None], camera.perspective
    screen = np.stack([axes.right, axes.down], -2)[..., None, :, :]
    beside = (points - np.array(camera.look_at)) @ np.moveaxis(screen[..., 0, :, :], -2, -1)
    return camera.focal_px * (screen / over - share * beside[..., None] * axes.forward[..., None, None, :] / over**2)


def rays(image: np.ndarray, poses: np.ndarray, camera: Camera) -> np.ndarray:
    """Vectors (..., 3) along lines of sight through ideal image points (..., 2), px from the middle; `from_axis` back.

    Along the axis they are ``focal_px`` long; they begin at `ray_origins`. Poses (..., 2) are broadcast against the
    points.
    """
    axes, share = camera_frame(camera, poses), camera.perspective
    return share * image[..., :1] * axes.right + share * image[..., 1:] * axes.down + camera.focal_px * axes.forward


def ray_origins(image: np.ndarray, poses: np.ndarray, camera: Camera) -> np.ndarray:
    """Where lines of sight through ideal image points (..., 2), px from the middle, begin, scene units, (..., 3).

    In the plane across the axis in which the sensor stands; all in one place where the camera is a pinhole.
    """
    share = camera.perspective
    if share == 1:
        place = sensor_position(camera, poses)
        return np.broadcast_to(place, np.broadcast_shapes(place.shape, (*np.shape(image)[:-1], 3)))
    axes, scale = camera_frame(camera, poses), camera.distance / camera.focal_px
    beside = scale * (image[..., :1] * axes.right + image[..., 1:] * axes.down)
    return sensor_position(camera, poses) + (1 - share) * beside


def facing(solid: Solid, positions: np.ndarray | Viewpoint) -> np.ndarray:
    """Which faces turn towards a position (scene units, shape (..., 3)) or a viewpoint; bool, shape (..., F)."""
    return above(positions, solid.normals, solid.offsets)


def above(positions: np.ndarray | Viewpoint, normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Which planes (F, 3), (F,) positions (..., 3) or viewpoints stand over; bool, shape (..., F).

    A plane seen edge-on is not seen: cos(270 degrees) is -2e-16 in floating point, cos(-90 degrees) +6e-17, and a
    face must not come and go with the way in which an angle is written.
    """
    view = Viewpoint.of(positions)
    return view.height(normals, offsets) > _EDGE_ON * np.linalg.norm(view.at, axis=-1, keepdims=True)


def edge_points(solid: Solid, names: tuple[str, ...], fractions: np.ndarray) -> np.ndarray:
    """Points on E edges at fractions (n,) or (..., E, n) of their length, scene units, shape (..., E, n, 3)."""
    ends = np.array([solid.vertices[list(solid.edge(name).ends)] for name in names]).reshape(-1, 2, 3)
    return ends[:, None, 0] + fractions[..., None] * (ends[:, 1] - ends[:, 0])[:, None]
