"""A solid becomes a Mitsuba mesh of flat faces."""

from __future__ import annotations

from typing import Any

import numpy as np

from scenes import Solid


def mesh(mitsuba: Any, solid: Solid, bsdf: dict) -> Any:
    """The solid's surface. Without vertex normals Mitsuba shades each triangle by its own plane: exactly flat."""
    properties = mitsuba.Properties()
    properties["bsdf"] = mitsuba.load_dict(bsdf)
    corners = solid.triangles.reshape(-1, 3)
    shape = mitsuba.Mesh("solid", vertex_count=len(corners), face_count=len(solid.triangles), props=properties)
    values = mitsuba.traverse(shape)
    values["vertex_positions"] = np.ascontiguousarray(corners, np.float32).ravel()
    values["faces"] = np.arange(len(corners), dtype=np.uint32)
    values.update()
    return shape
