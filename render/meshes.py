"""Triangles become a Mitsuba mesh of flat faces."""

from __future__ import annotations

from typing import Any

import numpy as np


def mesh(
    mitsuba: Any, triangles: np.ndarray, bsdf: dict, texels: np.ndarray | None = None, emitter: dict | None = None,
    normals: np.ndarray | None = None, sent: np.ndarray | None = None,
) -> Any:  # fmt: skip
    """Triangles, shape (T, 3, 3), and where their corners lie in a texture, shape (T, 3, 2), if they have one.

    With an ``emitter`` their outside shines; with ``sent`` of the corners, shape (T, 3), by so much.

    Without ``normals`` of the corners, shape (T, 3, 3), Mitsuba shades each triangle by its own plane: exactly flat.
    """
    properties = mitsuba.Properties()
    properties["bsdf"] = mitsuba.load_dict(bsdf)
    if sent is not None:
        emitter = {"type": "area", "radiance": {"type": "mesh_attribute", "name": "vertex_sent"}}
    if emitter is not None:
        properties["emitter"] = mitsuba.load_dict(emitter)
    corners = triangles.reshape(-1, 3)
    sizes = {"vertex_count": len(corners), "face_count": len(triangles)}
    has = {"has_vertex_texcoords": texels is not None, "has_vertex_normals": normals is not None}
    shape = mitsuba.Mesh("solid", **sizes, props=properties, **has)
    values = mitsuba.traverse(shape)
    values["vertex_positions"] = np.ascontiguousarray(corners, np.float32).ravel()
    values["faces"] = np.arange(len(corners), dtype=np.uint32)
    if texels is not None:
        values["vertex_texcoords"] = np.ascontiguousarray(texels, np.float32).ravel()
    if normals is not None:
        values["vertex_normals"] = np.ascontiguousarray(normals, np.float32).ravel()
    values.update()
    if sent is not None:
        shape.add_attribute("vertex_sent", 1, np.ascontiguousarray(sent, np.float32).ravel())
    return shape
