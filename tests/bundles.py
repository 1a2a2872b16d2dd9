"""What exact images tell of a part's corners in space and of where sensors stand, by no line and no adjustment."""

from __future__ import annotations

import numpy as np

from imaging.features.seen import Seen
from imaging.models.bound import information, response
from imaging.pictures import Pictures
from scenes import Picture, Quantity, Scene

SENSOR_SD = np.array([0.1, *np.radians([0.02, 0.02, 0.05])])  # distance, turns about right and down, roll
UNSURE = {
    "part_shift": None,
    "part_tilt_deg": None,
    "sensor_deg": 0.02,
    "sensor_distance": 0.1,
    "sensor_roll_deg": 0.05,
}
"""The same of a scene of mm."""


def project(points: np.ndarray, position: np.ndarray, axes: np.ndarray, focal: float) -> np.ndarray:
    """Images (n, 2) of points by a pinhole, px from the image's middle; axes (3, 3): right, down, forward."""
    away = (points - position) @ axes.T
    return focal * away[:, :2] / away[:, 2:]


def camera(scene: Scene, pose: tuple[float, float], numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Place, axes and focal length of a sensor that is off by numbers as of `SENSOR_SD`, (4,)."""
    polar, azimuth = np.radians(pose)
    out = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    down = np.cross(-out, right)
    reach, *turn = numbers
    vector = turn[0] * right + turn[1] * down - turn[2] * out
    angle = np.linalg.norm(vector) + 1e-300
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    place = np.array(scene.camera.look_at) + turned @ (scene.camera.distance * out) - reach * out
    return place, np.stack([right, down, -out]) @ turned.T, scene.camera.focal_px


def widths(solid, quantities: tuple[Quantity, ...], vertices: np.ndarray) -> np.ndarray:
    """Values (M,) of widths of a part whose vertices (n, 3) are elsewhere."""
    found = []
    for quantity in quantities:
        (a, b), (c, d) = (vertices[list(solid.edge(side.edge).ends)] for side in quantity.features)
        unit, away = (d - c) / np.linalg.norm(d - c), (a + b) / 2 - c
        found.append(np.linalg.norm(away - (away @ unit) * unit))
    return np.array(found)


def exact_covariance(pictures: tuple[Picture, ...], sensor_sd: np.ndarray | None) -> np.ndarray:
    """Cramer-Rao bound (M, M) of widths by all pixels of exact images, levels of faces left free.

    Unknown are all vertices in space, and each sensor's four numbers to their standard deviations; None: known.
    Derivatives of the images are by their vertices', of these central differences of `project`.
    """
    scene, count = pictures[0].scene, 4 * len(pictures)
    vertices = scene.solid.vertices
    whole = np.zeros((count + vertices.size, count + vertices.size))
    for k, picture in enumerate(pictures):
        pose = tuple(picture.sensor)
        corners, told = corners_of(picture)

        def images(numbers, k=k, pose=pose, corners=corners):
            there = vertices + numbers[count:].reshape(-1, 3)
            return project(there[corners], *camera(scene, pose, numbers[4 * k : 4 * k + 4])).ravel()

        steps = 1e-4 * np.eye(len(whole))
        slopes = np.stack([(images(step) - images(-step)) / 2e-4 for step in steps], -1)
        whole += slopes.T @ told @ slopes
    if sensor_sd is None:
        whole[:count], whole[:, :count] = 0.0, 0.0
    else:
        whole[:count, :count] += np.diag(1 / np.tile(sensor_sd, len(pictures)) ** 2)
    steps = 1e-4 * np.eye(vertices.size).reshape(-1, *vertices.shape)
    ahead, behind = (
        np.array([widths(scene.solid, scene.quantities, vertices + s * h) for h in steps]) for s in (1, -1)
    )
    gradient = np.concatenate([np.zeros((len(scene.quantities), count)), (ahead - behind).T / 2e-4], 1)
    return gradient @ np.linalg.pinv(whole, rcond=1e-11, hermitian=True) @ gradient.T


def corners_of(picture: Picture) -> tuple[np.ndarray, np.ndarray]:
    """Which vertices an image shows, and its Fisher information (2 n, 2 n) of their places in it."""
    model = information(Pictures.of(picture), reach=np.inf).model
    start = model.start()
    image, slopes = model.evaluate(start)
    levels, gain = response(picture.scene.noise, image)
    slopes = slopes * (gain / np.sqrt(levels.noise_variance))[:, None]
    own, free = slopes[:, : 2 * model.free.size], slopes[:, 2 * model.free.size : -1]
    basis, _ = np.linalg.qr(free[:, np.abs(free).sum(0) > 0])
    own = own - basis @ (basis.T @ own)
    scene = picture.scene
    there = project(scene.solid.vertices, *camera(scene, tuple(picture.sensor), np.zeros(4)))
    middle = (np.array([scene.camera.width, scene.camera.height]) - 1) / 2
    away = np.linalg.norm(there[:, None] + middle - start.vertices[model.free], axis=-1)
    corners = away.argmin(0)
    if away.min(0).max() > 1e-6:
        raise AssertionError(f"vertices must be where they are projected, got {away.min(0).max():g} px off")
    return corners, own.T @ own


def line_covariance(picture: Picture, seen: Seen) -> np.ndarray:
    """Cramer-Rao bound (q, q) of lines by the same pixels; infinite on the diagonal of those that are not seen."""
    corners, told = corners_of(picture)
    place, rows = {int(corner): k for k, corner in enumerate(corners)}, np.full((seen.count, len(told)), np.nan)
    for e, name in enumerate(seen.names):
        first, last = (place.get(end) for end in seen.solid.edge(name).ends)
        if first is None or last is None:
            continue
        rows[2 * e : 2 * e + 2] = 0.0
        rows[2 * e, 2 * first : 2 * first + 2] = seen.normals[e]
        turn = seen.normals[e] / np.linalg.norm(seen.along[e])
        rows[2 * e + 1, 2 * first : 2 * first + 2], rows[2 * e + 1, 2 * last : 2 * last + 2] = -turn, turn
    lost = np.isnan(rows).any(1)
    rows[lost] = 0.0
    return rows @ np.linalg.inv(told) @ rows.T + np.diag(np.where(lost, np.inf, 0.0))
