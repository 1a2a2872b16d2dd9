"""The features of measurands on an object: whether it has them, where they are, and in which plane they lie."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from scenes.measurands.measurands import Centre, Corner, Quantity, Side, Wall
from scenes.parts.solid import Solid
from scenes.parts.surfaces import Cone, Sphere

_FLAT = 1e-6  # of the object's size: how far a feature may be from the plane of the others
_PARALLEL = 1e-6  # sine of an angle that is none


def check_feature(solid: Solid, key: str, feature: Corner | Centre | Side | Wall) -> None:
    """See that the object has a feature.

    Raises
    ------
    ValueError
        If it has not.
    """
    check = {Corner: _check_corner, Centre: _check_centre, Side: _check_side, Wall: _check_wall}[type(feature)]
    check(solid, key, feature)


def check_quantity(solid: Solid, key: str, quantity: Quantity) -> None:
    """See that features, each of which is there, make a quantity: different ones, in one plane.

    Raises
    ------
    ValueError
        If they do not.
    """
    for one, other in combinations(quantity.features, 2):
        if place_of(one) == place_of(other):
            raise ValueError(f"{key} must be different features, got {place_of(one)!r} twice")
    _check_shape(solid, key, quantity)
    if quantity.kind == "distance":
        return
    points = points_of(solid, quantity)
    if not _is_flat(points, solid.extent):
        raise ValueError(f"{key} must be features in one plane, got {', '.join(quantity.edges)}")
    along = [_along(solid, feature) for feature in quantity.features if isinstance(feature, Side)]
    if quantity.kind == "angle" and np.linalg.norm(np.cross(*along)) < _PARALLEL:
        raise ValueError(f"{key} must be edges that are not parallel, got {', '.join(quantity.edges)}")
    if quantity.kind == "width" and np.linalg.norm(np.cross(*along)) > np.sin(np.radians(30)):
        raise ValueError(f"{key} must be edges within 30 degrees of parallel, got {', '.join(quantity.edges)}")


def _check_shape(solid: Solid, key: str, quantity: Quantity) -> None:
    """A taper is a cone's, a position without datum edges a ball's."""
    wanted = {"taper": Cone, "position": Sphere}.get(quantity.kind)
    if wanted is None or not isinstance(quantity.features[0], Wall):
        return
    name = quantity.features[0].surface
    if not isinstance(solid.round(name).surface, wanted):
        word = {Cone: "a cone", Sphere: "a ball"}[wanted]
        raise ValueError(f"{key} must be {word} for kind {quantity.kind}, got {name!r}")


def place_of(feature: Corner | Centre | Side | Wall) -> str:
    """Name of the vertex, circle, edge or surface that a feature is."""
    return getattr(feature, {Corner: "vertex", Centre: "circle", Side: "edge", Wall: "surface"}[type(feature)])


def point_of(solid: Solid, feature: Corner | Centre | Wall) -> np.ndarray:
    """Where a corner or a centre is in space, shape (3,)."""
    if isinstance(feature, Wall):
        return solid.round(feature.surface).centre
    return solid.circle(feature.circle).centre if isinstance(feature, Centre) else solid.vertex(feature.vertex)


def points_of(solid: Solid, quantity: Quantity) -> np.ndarray:
    """Points that span the features of a quantity: corners, centres, ends of edges, shape (n, 3)."""
    points = []
    for feature in quantity.features:
        if isinstance(feature, Side):
            points.extend(solid.vertices[list(solid.edge(feature.edge).ends)])
        else:
            points.append(point_of(solid, feature))
    return np.array(points)


def plane_of(solid: Solid, quantity: Quantity) -> np.ndarray | None:
    """Unit normal of the plane in which a quantity is measured, shape (3,); its sign has no meaning.

    The plane of its features. Two points span none: theirs is the plane of the one face that has both, or that of a
    circle if the other point lies in it; None where there is no such plane or there are several.
    """
    circles = [solid.circle(f.circle) for f in quantity.features if isinstance(f, Centre)]
    points = points_of(solid, quantity)
    near = _FLAT * solid.extent
    if any(isinstance(feature, Wall) for feature in quantity.features):
        return None
    if circles:
        flat = (np.abs((points - circles[0].centre) @ circles[0].axis) <= near).all()
        return circles[0].axis if flat else None
    if len(points) > 2:
        return np.linalg.svd(points - points.mean(0))[2][2]
    ends = [solid.vertex_names.index(f.vertex) for f in quantity.features]
    faces = [f for f, loop in enumerate(solid.faces) if set(ends) <= set(loop)]
    normals = solid.normals[faces]
    alike = len(faces) and (np.abs(normals @ normals[0]) > 1 - 1e-12).all()
    return normals[0] if alike else None


def _is_flat(points: np.ndarray, extent: float) -> bool:
    """Whether points (n, 3) lie in one plane."""
    if len(points) < 4:
        return True
    away = points - points.mean(0)
    return bool(np.abs(away @ np.linalg.svd(away)[2][2]).max() <= _FLAT * extent)


def _along(solid: Solid, side: Side) -> np.ndarray:
    start, stop = solid.vertices[list(solid.edge(side.edge).ends)]
    return (stop - start) / np.linalg.norm(stop - start)


def _check_corner(solid: Solid, key: str, corner: Corner) -> None:
    if corner.vertex not in solid.corner_names:
        raise ValueError(f"{key}.vertex must be one of {', '.join(solid.corner_names)}, got {corner.vertex!r}")
    there = [edge.name for edge in solid.edges_at(corner.vertex)]
    for name in corner.edges:
        if name not in there:
            raise ValueError(f"{key}.edges must be edges at {corner.vertex} ({', '.join(there)}), got {name!r}")
    if corner.edges[0] == corner.edges[1]:
        raise ValueError(f"{key}.edges must be two different edges, got {list(corner.edges)}")


def _check_centre(solid: Solid, key: str, centre: Centre) -> None:
    known = [circle.name for circle in solid.circles]
    if centre.circle not in known:
        raise ValueError(f"{key}.circle must be one of {', '.join(known) or '(none here)'}, got {centre.circle!r}")


def _check_wall(solid: Solid, key: str, wall: Wall) -> None:
    known = [curved.name for curved in solid.curved]
    if wall.surface not in known:
        raise ValueError(f"{key}.surface must be one of {', '.join(known) or '(none here)'}, got {wall.surface!r}")


def _check_side(solid: Solid, key: str, side: Side) -> None:
    known = [edge.name for edge in solid.sharp]
    if side.edge not in known:
        raise ValueError(f"{key}.edge must be one of {', '.join(known)}, got {side.edge!r}")
