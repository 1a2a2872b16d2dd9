"""How lines and circles of a picture move: with the part, and with what is not known of the camera.

Numbered as in `imaging.features.seen`; 0 of forms and of a board.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

import numpy as np

from imaging.features.seen import Seen
from imaging.geometry.lens import image_centre, lens_jacobian, recorded
from imaging.geometry.projection import from_axis, jacobian_ideal
from scenes import Camera, Circle, Scene
from scenes.cameras.covariance import ORDER
from scenes.cameras.lens import by_coefficients
from scenes.cameras.lens_modes import LensMode

if TYPE_CHECKING:
    from scenes.cameras.splined import Splined

_AROUND = 64  # points of a circle
_ALONG = np.linspace(0.0, 1.0, 11)  # of a line's image
_UNITS = np.repeat([1.0, np.pi / 180], 3)  # of a placement's components: the scene's unit, and degrees


def by_place(seen: Seen, pivot: np.ndarray | None = None) -> np.ndarray:
    """Derivatives of lines and circles by shifts and turns (rad) of the part, (..., q, 6); 0 of forms.

    It turns about a pivot (3,), the point that the camera looks at where none is given.
    """
    pivot = np.array(seen.camera.look_at) if pivot is None else pivot
    found = np.zeros((*seen.sensors.shape[:-1], seen.count, 6))
    lengths = np.linalg.norm(seen.along, axis=-1)[..., None]
    for e, name in enumerate(seen.names):
        ends = seen.solid.vertices[list(seen.solid.edge(name).ends)]
        off = np.einsum("...i,...nij->...nj", seen.normals[..., e, :], _moved(seen, ends, pivot))
        found[..., 2 * e, :] = off[..., 0, :]
        found[..., 2 * e + 1, :] = (off[..., 1, :] - off[..., 0, :]) / lengths[..., e, :]
    for c, name in enumerate(seen.circles):
        circle = seen.solid.circle(name)
        found[..., seen.numbers(c), :] = of_circle(seen, circle, steps(circle.at(around(circle)), pivot))
    return found


def _moved(seen: Seen, points: np.ndarray, pivot: np.ndarray) -> np.ndarray:
    """Derivatives of the images of points (n, 3) by the placement, px, (..., n, 2, 6)."""
    return seen.slopes(points) @ steps(points, pivot)


def steps(points: np.ndarray, pivot: np.ndarray) -> np.ndarray:
    """How points (n, 3) of a part move with its shift and turn about a pivot, (n, 3, 6)."""
    turned = np.cross(np.eye(3), (points - pivot)[:, None, :])  # (n, axis, 3)
    return np.concatenate([np.broadcast_to(np.eye(3), (len(points), 3, 3)), np.swapaxes(turned, 1, 2)], -1)


def of_circle(seen: Seen, circle: Circle, moves: np.ndarray) -> np.ndarray:
    """Derivatives of a circle's shifts and radius, (..., 3, k), where `around` of it is moved by ``moves`` (n, 3, k):
    least squares around its rim, as it is found."""
    across, solve = rim_fit(seen, circle)
    return solve @ np.einsum("...nj,njk->...nk", across, moves)


def rim_fit(seen: Seen, circle: Circle) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of how far the image of `around` a circle is off outwards by these places, px, (..., n, 3), and of
    the circle's shifts and radius by how far that is, (..., 3, n)."""
    normal, slopes, speed, radial = _outwards(seen, circle)
    one, two = circle.axes
    across = np.einsum("...ni,...nij->...nj", normal, slopes)
    design = np.stack([across @ one, across @ two, np.einsum("...nj,nj->...n", across, radial)], -1)
    weighted = np.swapaxes(design * speed, -1, -2)
    return across, np.linalg.solve(weighted @ design, weighted)


def rim_normals(seen: Seen, circle: Circle) -> np.ndarray:
    """Unit normals of its image at `around` of it, outwards, (..., n, 2)."""
    return _outwards(seen, circle)[0]


def around(circle: Circle) -> np.ndarray:
    """Angles of the places of a circle by which its image is told, rad, (n,)."""
    return circle.angles(_AROUND)


def _outwards(seen: Seen, circle: Circle) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of `around`: unit normals of the image, its derivatives by the places, px per rad around, and unit spokes."""
    points, radial = circle.at(around(circle)), circle.spokes(around(circle))
    slopes = seen.slopes(points)
    along = np.einsum("...nij,nj->...ni", slopes, np.cross(circle.axis, radial))
    speed = np.linalg.norm(along, axis=-1, keepdims=True)
    return np.stack([along[..., 1], -along[..., 0]], -1) / speed, slopes, speed, radial


def shifts(images: np.ndarray, camera: Camera, modes: Sequence[LensMode] = ()) -> np.ndarray:
    """Derivatives (..., 2, 9 + m) of where image points (..., 2), ideal px from the middle, are found, by errors
    `ORDER` and by m errors of a splined lens.

    The camera records them by its true parameters, and they are taken back by those of the scene; distortion is
    OpenCV's.
    """
    ideal, focal = images + image_centre(camera), camera.focal_px
    there = recorded(ideal, camera) - image_centre(camera)
    zero, one = np.zeros(there.shape[:-1]), np.ones(there.shape[:-1])
    columns = (there[..., 0] / focal, zero), (zero, there[..., 1] / focal), (one, zero), (zero, one)
    pinhole = np.stack([np.stack(column, -1) for column in columns], -1)
    lens = cast("Splined", camera.lens)  # where there are modes
    bent = [focal * mode.shifts(lens, images / focal) + mode.focal_px / focal * there for mode in modes]
    moved = np.concatenate([pinhole, focal * by_coefficients(images / focal), *(each[..., None] for each in bent)], -1)
    return np.linalg.solve(lens_jacobian(ideal, camera), moved)


def by_camera(seen: Seen, modes: Sequence[LensMode] = ()) -> np.ndarray:
    """Derivatives (..., q, 9 + m) of lines and circles by errors of `ORDER`, and m of a splined lens, as they are
    fitted."""
    whole = np.zeros((*seen.sensors.shape[:-1], seen.count, len(ORDER) + len(modes)))
    fit = np.linalg.pinv(np.stack([np.ones_like(_ALONG), _ALONG], -1))
    for e in range(len(seen.names)):
        start, along, normal = (each[..., e, None, :] for each in (seen.start, seen.along, seen.normals))
        off = np.einsum("...nik,...ni->...nk", shifts(start + _ALONG[:, None] * along, seen.camera, modes), normal)
        lines = fit @ off
        lines[..., 1, :] /= np.linalg.norm(along, axis=-1)
        whole[..., 2 * e : 2 * e + 2, :] = lines
    for c, name in enumerate(seen.circles):
        circle = seen.solid.circle(name)
        images = from_axis(circle.at(around(circle)), seen.sensors, seen.camera)
        off = np.einsum("...ni,...nik->...nk", rim_normals(seen, circle), shifts(images, seen.camera, modes))
        whole[..., seen.numbers(c), :] = rim_fit(seen, circle)[1] @ off
    return whole


def by_deviations(seen: Seen, scene: Scene) -> np.ndarray:
    """Derivatives (..., q, 6 + c) of lines and circles by a placement, the scene's unit and degrees, and by what is
    estimated of the camera."""
    moved = by_place(seen) * _UNITS
    return np.concatenate([moved, by_camera(seen) @ by_estimated(scene)], -1) if scene.placement.camera else moved


def points_by_deviations(points: np.ndarray, poses: np.ndarray, scene: Scene) -> np.ndarray:
    """The same of where points (n, 3) of the part or its board are found, ideal px, (..., n, 2, 6 + c)."""
    camera = scene.camera
    moved = jacobian_ideal(points, poses, camera) @ (steps(points, np.array(camera.look_at)) * _UNITS)
    if not scene.placement.camera:
        return moved
    return np.concatenate([moved, shifts(from_axis(points, poses, camera), camera) @ by_estimated(scene)], -1)


def by_estimated(scene: Scene) -> np.ndarray:
    """What is estimated of the camera as errors of a calibration's parameters (`ORDER`), (9, c)."""
    rows = {"focal": np.isin(ORDER, ("fx", "fy")) * scene.camera.focal_px, "k1": np.isin(ORDER, ("k1",)) * 1.0}
    return np.array([rows[name] for name in scene.placement.camera]).reshape(-1, len(ORDER)).T
