"""What is not known of a camera as an unknown of the adjustment: focal lengths, principal point, distortion."""

from __future__ import annotations

import numpy as np

from imaging.features.placing import around, rim_fit, rim_normals
from imaging.features.seen import Seen
from imaging.geometry.lens import image_centre, lens_jacobian, recorded
from imaging.geometry.projection import from_axis
from scenes import Camera, Scene
from scenes.cameras.covariance import ORDER
from scenes.cameras.lens import by_coefficients

_ALONG = np.linspace(0.0, 1.0, 11)  # of a line's image


def root(scene: Scene) -> np.ndarray:
    """Independent errors of variance 1 as errors of the parameters `ORDER`, (9, k); k is 0 where all are exact."""
    said, columns = scene.uncertainty, []
    if said.covariance is not None:
        rows = np.zeros((len(ORDER), len(said.covariance.names)))
        rows[[ORDER.index(name) for name in said.covariance.names], np.arange(rows.shape[1])] = 1.0
        if "fy" not in said.covariance.names:
            rows[ORDER.index("fy")] = rows[ORDER.index("fx")]
        sizes, axes = np.linalg.eigh(said.covariance.correlation)
        half = said.covariance.sd[:, None] * axes * np.sqrt(np.maximum(sizes, 0.0))
        columns.append(rows @ half)
    if said.principal_point_px is not None:
        columns.append(said.principal_point_px.u * np.eye(len(ORDER))[:, [ORDER.index("cx"), ORDER.index("cy")]])
    whole = np.concatenate(columns, 1) if columns else np.zeros((len(ORDER), 0))
    return whole[:, np.linalg.norm(whole, axis=0) > 0]


def shifts(images: np.ndarray, camera: Camera) -> np.ndarray:
    """Derivatives (n, 2, 9) of where image points (n, 2), ideal px from the middle, are found, by errors of `ORDER`.

    The camera records them by its true parameters, and they are taken back by those of the scene; distortion is
    OpenCV's.
    """
    ideal, focal = images + image_centre(camera), camera.focal_px
    there = recorded(ideal, camera) - image_centre(camera)
    zero, one = np.zeros(len(ideal)), np.ones(len(ideal))
    columns = (there[:, 0] / focal, zero), (zero, there[:, 1] / focal), (one, zero), (zero, one)
    pinhole = np.stack([np.stack(column, -1) for column in columns], -1)
    moved = np.concatenate([pinhole, focal * by_coefficients(images / focal)], -1)
    return np.linalg.solve(lens_jacobian(ideal, camera), moved)


def by_camera(seen: Seen) -> np.ndarray:
    """Derivatives (q, 9) of lines and circles of one picture by errors of `ORDER`, as they are fitted."""
    whole, fit = np.zeros((seen.count, len(ORDER))), np.linalg.pinv(np.stack([np.ones_like(_ALONG), _ALONG], -1))
    for e, (start, along, normal) in enumerate(zip(seen.start, seen.along, seen.normals, strict=True)):
        off = np.einsum("i,nik->nk", normal, shifts(start + _ALONG[:, None] * along, seen.camera))
        first, rise = fit @ off
        whole[2 * e], whole[2 * e + 1] = first, rise / np.linalg.norm(along)
    for c, name in enumerate(seen.circles):
        circle = seen.solid.circle(name)
        images = from_axis(circle.at(around(circle)), seen.sensors, seen.camera)
        off = np.einsum("ni,nik->nk", rim_normals(seen, circle), shifts(images, seen.camera))
        whole[seen.numbers(c)] = rim_fit(seen, circle)[1] @ off
    return whole
