"""Features of measurands - corners, circles, curved surfaces, edges - and where they are on an object."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Discriminator, Tag

from scenes.model import Model
from scenes.parts.solid import Solid

if TYPE_CHECKING:
    from scenes.measurands.measurands import Quantity

_FLAT = 1e-6  # of the object's size: how far a feature may be from the plane of the others


class Corner(Model):
    """A vertex of the object and the two edges whose images are intersected to find it."""

    vertex: str
    edges: tuple[str, str]


class Centre(Model):
    """A circular edge: its centre, or itself where its diameter is asked for."""

    circle: str

    @property
    def edges(self) -> tuple[str, ...]:
        """The circle's own name, for it is the one edge that is needed."""
        return (self.circle,)


class Wall(Model):
    """A curved surface of the object, by its limb."""

    surface: str
    """Its name."""

    @property
    def edges(self) -> tuple[str, ...]:
        """Its own name."""
        return (self.surface,)


class Side(Model):
    """A straight edge."""

    edge: str
    """Its name."""

    @property
    def edges(self) -> tuple[str, ...]:
        """Its own name."""
        return (self.edge,)


def _tag_of_feature(value: Any) -> str:
    for tag, kind, key in (("centre", Centre, "circle"), ("side", Side, "edge"), ("wall", Wall, "surface")):
        if isinstance(value, kind) or (isinstance(value, dict) and key in value):
            return tag
    return "corner"


Feature = Annotated[Annotated[Corner, Tag("corner")] | Annotated[Centre, Tag("centre")], Discriminator(_tag_of_feature)]
AnyFeature = Annotated[
    Annotated[Corner, Tag("corner")]
    | Annotated[Centre, Tag("centre")]
    | Annotated[Side, Tag("side")]
    | Annotated[Wall, Tag("wall")],
    Discriminator(_tag_of_feature),
]


def check_feature(solid: Solid, key: str, feature: Corner | Centre | Side | Wall) -> None:
    """See that the object has a feature.

    Raises
    ------
    ValueError
        If it has not.
    """
    check = {Corner: _check_corner, Centre: _check_centre, Side: _check_side, Wall: _check_wall}[type(feature)]
    check(solid, key, feature)


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

    The plane of its features: that of a circle if all lies in it, else the one that its centre and an edge span, whose
    heights may differ. Two points span none: theirs is the plane of the one face that has both. None where there is no
    such plane or there are several.
    """
    circles = [solid.circle(f.circle) for f in quantity.features if isinstance(f, Centre)]
    points = points_of(solid, quantity)
    near = _FLAT * solid.extent
    if any(isinstance(feature, Wall) for feature in quantity.features):
        return None
    if circles:
        flat = (np.abs((points - circles[0].centre) @ circles[0].axis) <= near).all()
        return circles[0].axis if flat else _spanned(points, near)
    if len(points) > 2:
        return np.linalg.svd(points - points.mean(0))[2][2]
    ends = [solid.vertex_names.index(f.vertex) for f in quantity.features]
    faces = sorted(set.intersection(*(solid.faces_at[end] for end in ends)))
    normals = solid.normals[faces]
    alike = len(faces) and (np.abs(normals @ normals[0]) > 1 - 1e-12).all()
    return normals[0] if alike else None


def _spanned(points: np.ndarray, near: float) -> np.ndarray | None:
    """Unit normal of the plane that points (n, 3) span, (3,); None where they lie on a line."""
    _, size, axes = np.linalg.svd(points - points.mean(0))
    return axes[2] if len(points) > 2 and size[1] > near else None


def is_flat(points: np.ndarray, extent: float) -> bool:
    """Whether points (n, 3) of an object of that size lie in one plane."""
    if len(points) < 4:
        return True
    away = points - points.mean(0)
    return bool(np.abs(away @ np.linalg.svd(away)[2][2]).max() <= _FLAT * extent)


def along_of(solid: Solid, side: Side) -> np.ndarray:
    """Unit vector along an edge, (3,)."""
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
    known = [circle.name for circle in solid.rims]
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
