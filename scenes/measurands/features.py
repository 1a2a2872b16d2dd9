"""Features of measurands - corners, circles, curved surfaces, edges - and where they are on an object.

What is constructed between them, midpoints and the like, is in `scenes.measurands.between`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Protocol

import numpy as np
from pydantic import Discriminator, Tag

from scenes.measurands.evaluated import Line, Point
from scenes.model import Model
from scenes.parts.solid import Circle, Solid

if TYPE_CHECKING:
    from scenes.measurands.measurands import Quantity

_DIGITS = 6  # by which components of a normal are compared, so that rounding chooses none
_FLAT = 1e-6  # of the object's size: how far a feature may be from the plane of the others
_PARALLEL = np.sin(np.radians(1.0))  # sine of the angle between lines that count as parallel, at most
_OFF_LINE = 1e-3  # of a pattern's size: how far from one line its centres are, at least


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


class Lookup(Protocol):
    """What gives points and lines of features, in the image (``plane`` None) or on a plane of that unit normal."""

    def point(self, feature: Any, plane: np.ndarray | None) -> Point: ...

    def line(self, feature: Any, plane: np.ndarray | None) -> Line: ...

    def left(self, parts: tuple, plane: np.ndarray | None) -> Any: ...


class Between(Model):
    """A point or a line that is constructed of other features, in the plane of these."""

    is_line: ClassVar[bool] = False
    """Whether it is a line."""

    @property
    def parts(self) -> tuple[Basic, ...]:
        """The features that it is made of."""
        raise NotImplementedError

    @property
    def edges(self) -> tuple[str, ...]:
        """Names of the edges and circles that it needs, each once."""
        return tuple(dict.fromkeys(name for part in self.parts for name in part.edges))

    def check(self, solid: Solid, key: str) -> None:
        """See that its features, each of which is there, make one; ValueError if not."""
        points = places(solid, self.parts)
        if not is_flat(points, solid.extent):
            raise ValueError(f"{key} must be features in one plane, got {', '.join(map(place_of, self.parts))}")

    def made(self, seen: Lookup, plane: np.ndarray | None) -> Any:
        """The `Point`, or the `Line`, with its derivatives."""
        raise NotImplementedError


Basic = Corner | Centre | Side | Wall


def tag_of_feature(value: Any) -> str:
    for tag, kind, key in (("centre", Centre, "circle"), ("side", Side, "edge"), ("wall", Wall, "surface")):
        if isinstance(value, kind) or (isinstance(value, dict) and key in value):
            return tag
    return "corner"


Feature = Annotated[Annotated[Corner, Tag("corner")] | Annotated[Centre, Tag("centre")], Discriminator(tag_of_feature)]


def check_feature(solid: Solid, key: str, feature: Basic | Between) -> None:
    """See that the object has a feature.

    Raises
    ------
    ValueError
        If it has not.
    """
    if isinstance(feature, Between):
        for k, part in enumerate(feature.parts):
            check_feature(solid, f"{key}.{_key(feature)}[{k}]", part)
        feature.check(solid, f"{key}.{_key(feature)}")
        return
    check = {Corner: _check_corner, Centre: _check_centre, Side: _check_side, Wall: _check_wall}[type(feature)]
    check(solid, key, feature)


def place_of(feature: Basic | Between) -> str:
    """Name of the vertex, circle, edge or surface that a feature is; of what lies between some, how and of which."""
    if isinstance(feature, Between):
        return f"{_key(feature).replace('_', ' ')} of {' and '.join(map(place_of, feature.parts))}"
    return getattr(feature, {Corner: "vertex", Centre: "circle", Side: "edge", Wall: "surface"}[type(feature)])


def _key(feature: Between) -> str:
    """The key by which a scene file tells what lies between others."""
    return next(iter(type(feature).model_fields))


def basic_of(features: tuple[Basic | Between, ...]) -> tuple[Basic, ...]:
    """Features that are found in a picture, those that others are made of among them, in their order."""
    return sum((f.parts if isinstance(f, Between) else (f,) for f in features), ())


def is_line(feature: Basic | Between) -> bool:
    """Whether it is an edge, or a line between others."""
    return isinstance(feature, Side) or (isinstance(feature, Between) and feature.is_line)


@dataclass(frozen=True)
class Nominal:
    """Features where an object has them, in space; nothing moves."""

    solid: Solid

    def point(self, feature: Any, plane: np.ndarray | None) -> Point:
        return Point(point_of(self.solid, feature), {})

    def line(self, feature: Any, plane: np.ndarray | None) -> Line:
        start, stop = ends_of(self.solid, feature)
        return Line(Point(start, {}), Point(stop, {}))

    def left(self, parts: tuple, plane: np.ndarray) -> float:
        """+1 or -1: whether a plane's normal points outwards, so that `across` of a direction is to the left of it."""
        return float(np.sign(outward(plane) @ plane))

    def of(self, feature: Between) -> Any:
        """What lies between others."""
        points = places(self.solid, feature.parts)
        return feature.made(self, np.linalg.svd(points - points.mean(0))[2][2])


def point_of(solid: Solid, feature: Basic | Between) -> np.ndarray:
    """Where a corner, a centre or a point between others is in space, shape (3,)."""
    if isinstance(feature, Between):
        return Nominal(solid).of(feature).at
    if isinstance(feature, Wall):
        return solid.round(feature.surface).centre
    return solid.circle(feature.circle).centre if isinstance(feature, Centre) else solid.vertex(feature.vertex)


def ends_of(solid: Solid, feature: Side | Between) -> np.ndarray:
    """Ends of an edge or of a line between others, shape (2, 3)."""
    if isinstance(feature, Between):
        line = Nominal(solid).of(feature)
        return np.stack([line.start.at, line.stop.at])
    return solid.vertices[list(solid.edge(feature.edge).ends)]


def points_of(solid: Solid, quantity: Quantity) -> np.ndarray:
    """Points that stand for the features of a quantity: corners, centres, ends of lines, shape (n, 3)."""
    return places(solid, quantity.features)


def found_at(solid: Solid, quantity: Quantity) -> np.ndarray:
    """Points that span the features which have to be found for a quantity, shape (n, 3)."""
    return places(solid, basic_of(quantity.features))


def places(solid: Solid, features: tuple) -> np.ndarray:
    """Points that stand for features: corners, centres, ends of lines, shape (n, 3)."""
    points: list[np.ndarray] = []
    for feature in features:
        points.extend(ends_of(solid, feature) if is_line(feature) else [point_of(solid, feature)])
    return np.array(points)


def plane_of(solid: Solid, quantity: Quantity) -> np.ndarray | None:
    """Unit normal of the plane in which a quantity is measured, shape (3,); its sign has no meaning.

    The plane of its features: that of a circle if all lies in it, else the one that its centre and an edge span, whose
    heights may differ; of at least three circles in parallel planes the one that is parallel to these. Two points span
    none: theirs is the plane of the one face that has both. A single edge's is that of the larger face beside it. None
    where there is no such plane or there are several.
    """
    features = basic_of(quantity.features)
    circles = [solid.circle(f.circle) for f in features if isinstance(f, Centre)]
    points = places(solid, features)
    near = _FLAT * solid.extent
    if any(isinstance(feature, Wall) for feature in features):
        return None
    if circles:
        flat = (np.abs((points - circles[0].centre) @ circles[0].axis) <= near).all()
        return circles[0].axis if flat or are_level(circles, features) else _spanned(points, near)
    if len(points) > 2:
        return np.linalg.svd(points - points.mean(0))[2][2]
    if isinstance(features[0], Side):
        return face_beside(solid, features[0])
    ends = [solid.vertex_names.index(f.vertex) for f in features]
    faces = sorted(set.intersection(*(solid.faces_at[end] for end in ends)))
    normals = solid.normals[faces]
    alike = len(faces) and (np.abs(normals @ normals[0]) > 1 - 1e-12).all()
    return normals[0] if alike else None


def face_beside(solid: Solid, side: Side) -> np.ndarray:
    """Unit normal of the larger of the two faces that meet in an edge, shape (3,)."""
    faces = sorted(set(solid.edge(side.edge).faces))
    shares = solid.areas[faces] / solid.areas[faces].max()
    return solid.normals[faces[int(shares.round(_DIGITS).argmax())]]


def are_level(circles: list[Circle], features: tuple) -> bool:
    """Whether features are at least three circles in parallel planes."""
    axes = np.array([circle.axis for circle in circles])
    return len(features) == len(circles) > 2 and bool((np.abs(axes @ axes[0]) > 1 - 1e-12).all())


def _spanned(points: np.ndarray, near: float) -> np.ndarray | None:
    """Unit normal of the plane that points (n, 3) span, (3,); None where they lie on a line."""
    _, size, axes = np.linalg.svd(points - points.mean(0))
    return axes[2] if len(points) > 2 and size[1] > near else None


def outward(normal: np.ndarray) -> np.ndarray:
    """A plane's normal (..., 3) with the sign that its largest component is positive: the side that signs refer to."""
    largest = np.abs(normal).round(_DIGITS).argmax(-1)[..., None]
    return normal * np.sign(np.take_along_axis(normal, largest, -1))


def is_flat(points: np.ndarray, extent: float) -> bool:
    """Whether points (n, 3) of an object of that size lie in one plane."""
    if len(points) < 4:
        return True
    away = points - points.mean(0)
    return bool(np.abs(away @ np.linalg.svd(away)[2][2]).max() <= _FLAT * extent)


def along_of(solid: Solid, side: Side | Between) -> np.ndarray:
    """Unit vector along an edge or a line between others, (3,)."""
    start, stop = ends_of(solid, side)
    return (stop - start) / np.linalg.norm(stop - start)


def check_parallel(solid: Solid, key: str, sides: tuple[Side | Between, ...], names: tuple[str, ...]) -> None:
    """Two lines are within 1 degree of parallel.

    Raises
    ------
    ValueError
        If they are not; ``names`` are said.
    """
    if np.linalg.norm(np.cross(*(along_of(solid, side) for side in sides))) > _PARALLEL:
        raise ValueError(f"{key} must be edges within 1 degree of parallel, got {', '.join(names)}")


def check_off_line(key: str, centres: np.ndarray, names: tuple[str, ...]) -> None:
    """Centres of circles, (n, 3), are not on one line.

    Raises
    ------
    ValueError
        If they are; ``names`` are said.
    """
    if np.linalg.svd(centres - centres.mean(0))[1][1] < _OFF_LINE * np.ptp(centres, axis=0).max():
        raise ValueError(f"{key} must be circles that are not on one line, got {', '.join(names)}")


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
