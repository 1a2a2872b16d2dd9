"""The picture of a part that lies elsewhere: the same part in its own frame, camera and lights moved the other way.

So whatever sees, renders or measures a picture does it with a displaced part too, exactly: a rigid motion of the part
is one of all else. Only a light's turn about its own axis is not carried along unless it is the camera's.
"""

from __future__ import annotations

import numpy as np

from imaging.geometry.projection import camera_frame, direction, frame
from scenes import Picture, Pose
from scenes.cameras import estimated
from scenes.placement import prior


def turn(vector_deg: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector, degrees (Rodrigues)."""
    vector = np.radians(np.asarray(vector_deg, float))
    x, y, z = vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = float(np.linalg.norm(vector))
    sine, cosine = np.sinc(angle / np.pi), np.sinc(angle / (2 * np.pi)) ** 2 / 2  # sin a / a, (1 - cos a) / a^2
    return np.eye(3) + sine * cross + cosine * cross @ cross


def turn_vector(rotation: np.ndarray) -> np.ndarray:
    """Rotation vector of a matrix that turns by less than 180 degrees, degrees.

    >>> turn_vector(turn([1.0, -20.0, 30.0])).round(9).tolist()
    [1.0, -20.0, 30.0]
    """
    odd = rotation - rotation.T
    twice = np.array([odd[2, 1], odd[0, 2], odd[1, 0]])
    sine, cosine = float(np.linalg.norm(twice)) / 2, (float(np.trace(rotation)) - 1) / 2
    angle = np.arctan2(sine, cosine)
    return np.degrees(twice / 2 * (angle / sine if sine > 0 else 1.0))


def placed(picture: Picture, placement: np.ndarray) -> Picture:
    """The picture with its part shifted and turned.

    Parameters
    ----------
    picture : Picture
    placement : ndarray, shape (6,) or (6 + c,)
        Shift along x, y and z, the scene's unit, and rotation vector about the point that the camera looks at, degrees;
        then the deviations of what is estimated of the camera (`scenes.cameras.estimated`), else 0.

    Returns
    -------
    Picture
        Of the same part in its own frame. What is expected of its place (`scenes.Placement.expected`) is as much less.

    Examples
    --------
    >>> import scenes
    >>> task1 = Picture.of(scenes.load("task1"), (30, 135), (15, 315))
    >>> placed(task1, np.array([0, 0, 0, 0, 0, 10.0])).sensor.printed
    '(30.0, 125.0)'
    """
    scene, numbers = picture.scene, picture.scene.placement.camera
    placement = np.asarray(placement, float)
    placement = np.pad(placement, (0, 6 + len(numbers) - placement.size))
    shift, back = placement[:3], turn(placement[3:6]).T
    lights = tuple(_turned(pose, back) for pose in picture.lights)
    moved = [
        light if light.pose is None else light.tried(pose=_turned(light.pose, back)) for light in scene.lights
    ]  # fmt: skip
    camera, sensor = scene.camera, np.array(list(picture.sensor))
    pose = _turned(picture.sensor, back)
    right, level = back @ camera_frame(camera, sensor).right, frame(np.array(list(pose)))
    roll = float(np.degrees(np.arctan2(right @ level.down, right @ level.right)))
    at = np.array(camera.look_at) - back @ shift
    moved_camera = camera.tried(look_at=tuple(at.tolist()), roll_deg=roll)
    changes = {"camera": estimated.adjusted(moved_camera, numbers, placement[6:])}
    changes["placement"] = scene.placement.tried(expected=_left(picture, placement, back))
    whole = scene.tried(**changes)
    return Picture(whole.lit_by(*moved) if any(light.pose for light in moved) else whole, pose, lights)


def combined(first: np.ndarray, then: np.ndarray) -> np.ndarray:
    """The placement (6 + c,) of a part that is placed by ``then`` in the picture that ``first`` made.

    >>> combined(np.array([1.0, 0, 0, 0, 0, 90.0]), np.array([1.0, 0, 0, 0, 0, 0])).round(9).tolist()
    [1.0, 1.0, 0.0, 0.0, 0.0, 90.0]
    """
    turned, more = turn(first[3:6]), turn(then[3:6])
    shift = turned @ more @ turned.T @ first[:3] + turned @ then[:3]
    return np.concatenate([shift, turn_vector(turned @ more), first[6:] + then[6:]])


def difference(there: np.ndarray, here: np.ndarray) -> np.ndarray:
    """The placement (6 + c,) that takes the picture of ``here`` to that of ``there``: of `combined` the inverse."""
    turned, wanted = turn(here[3:6]), turn(there[3:6])
    more = turned.T @ wanted
    shift = turned.T @ (there[:3] - turned @ more @ turned.T @ here[:3])
    return np.concatenate([shift, turn_vector(more), there[6:] - here[6:]])


def _left(picture: Picture, placement: np.ndarray, back: np.ndarray) -> tuple[float, ...]:
    """What is expected of the place beside a placement, along the part's own axes, to first order in both."""
    free = prior(picture.scene.uncertainty) > 0
    left = picture.scene.placement.mean - placement
    first = np.where(free, np.concatenate([back @ left[:3], back @ left[3:6]]), 0.0)
    return (*first.tolist(), *left[6:].tolist())


def _turned(pose: Pose, back: np.ndarray) -> Pose:
    """A pose whose direction is turned by a matrix."""
    x, y, z = back @ direction(np.array(list(pose)))
    return Pose(float(np.degrees(np.arctan2(np.hypot(x, y), z))), float(np.degrees(np.arctan2(y, x))) % 360)
