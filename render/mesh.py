"""A solid becomes a Mitsuba mesh of flat faces."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from scenes import Solid


def triangles(solid: Solid) -> np.ndarray:
    """Faces as fans of triangles around their first vertex, vertex indices of shape (T, 3); right for convex faces."""
    return np.array([(face[0], *pair) for face in solid.faces for pair in pairwise(face[1:])])


def mesh(mitsuba: Any, solid: Solid, bsdf: dict) -> Any:
    """The solid's surface. Without vertex normals Mitsuba shades each triangle by its own plane: exactly flat."""
    properties = mitsuba.Properties()
    properties["bsdf"] = mitsuba.load_dict(bsdf)
    faces = triangles(solid)
    shape = mitsuba.Mesh("solid", vertex_count=len(solid.vertices), face_count=len(faces), props=properties)
    values = mitsuba.traverse(shape)
    values["vertex_positions"] = np.ascontiguousarray(solid.vertices, np.float32).ravel()
    values["faces"] = faces.astype(np.uint32).ravel()
    values.update()
    return shape
