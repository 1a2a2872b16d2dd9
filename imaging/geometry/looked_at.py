"""What is seen at places of the image."""

from __future__ import annotations

import numpy as np

from imaging.geometry.lens import image_centre
from imaging.geometry.projection import ray_origins, rays
from imaging.geometry.rays import first_face
from scenes import Picture

_MARGIN = 1e-7  # of the part's size: what passes a triangle's side more closely is decided in double precision


def looked_at(picture: Picture, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces of the bodies that a camera without distortion sees.

    Parameters
    ----------
    picture : Picture
    seen : ndarray, shape (n, 2)
        Ideal image coordinates (x, y), px.

    Returns
    -------
    faces : ndarray of int, shape (n,)
        -1 where there is none.
    places : ndarray, shape (n, 3)
        Where on them, scene units; where the line of sight begins where there is none.
    """
    camera, sensor = picture.scene.camera, np.array(list(picture.sensor))
    image = seen - image_centre(camera)
    ways, origins = rays(image, sensor, camera), ray_origins(image, sensor, camera)
    faces, t = first_face(picture.scene.bodies, origins, ways, (), margin=_MARGIN)
    return faces, origins + np.where(faces >= 0, t, 0.0)[:, None] * ways
