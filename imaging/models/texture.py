"""What textures do to edges: a bias that is the same in every picture of a part, and a scatter over parts.

The zero crossing of the smoothed image's second derivative lies where F(u) = 0. A factor T on the face beside an edge
adds to F(0) the integral of G''(u) G(v) I (T - 1) over that face, I its diffuse brightness and G the Gaussian of image
and locator together, and to F'(0), which is -C / (sqrt(2 pi) w^3) for a lone step, that of -G'''(u) G(v) I (T - 1). To
first order the crossing is at -F / F'. A line's displacement and rotation are linear in the crossings of its points,
so they are a sum over the texture's nodes; of a random field, filtered white noise, the same filter applied to that
sum's weights gives the covariance over parts, of all edges together and exactly for the field as it is rendered.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.blurred.boundaries import sided
from imaging.features.locator import edge_blur
from imaging.features.measurand import Measurands, measurands, normals
from imaging.geometry.lens import image_centre
from imaging.geometry.projection import edge_points, facing, jacobian_ideal, ray_origins, rays
from imaging.light.appearance import diffuse_signal
from imaging.light.edge_sides import side_signals
from imaging.light.sheets import Sheet, sheets
from imaging.models.along import place_nodes, used_trims
from imaging.pictures import Pictures
from scenes import Solid
from scenes.materials.textures import ImageTexture

_FAR = 5.0  # standard deviations of the smoothed edge beyond which a texture is not felt
_MOST_ALONG, _ACROSS = 2000, (16, 64)  # places
_FARTHEST, _STEEPER = 0.25, 0.1  # px that a print may move a crossing, part by which it may change its slope


@dataclass(frozen=True, eq=False)
class TextureErrors:
    """What textures add to displacement and rotation (d, theta) of E lines, in turn, in one picture; ideal px and rad.

    Attributes
    ----------
    part : ndarray, shape (2 E,)
        Of statistical textures on the part that the seeds roll.
    printed : ndarray, shape (2 E,)
        Of images, the same on every part.
    disturbed : ndarray of bool, shape (E,)
        Edges that a print moves or changes too much for the first order.
    unknown : ndarray of bool, shape (E + C,)
        Edges past which another face is seen, which may be textured, and circles with a textured side.
    measurands : Measurands
    responses : tuple of (Sheet, list)
        What each field adds: rows, places in nodes (k, 2) and weights (2, k).
    """

    part: np.ndarray
    printed: np.ndarray
    disturbed: np.ndarray
    unknown: np.ndarray
    measurands: Measurands
    responses: tuple[tuple[Sheet, list[tuple[slice, np.ndarray, np.ndarray]]], ...]

    @cached_property
    def covariance(self) -> np.ndarray:
        """Over parts, of statistical textures, shape (2 E, 2 E)."""
        count = len(self.part)
        return sum((field_covariance(sheet, parts, count) for sheet, parts in self.responses), np.zeros((count, count)))

    @property
    def variances(self) -> tuple[np.ndarray, np.ndarray]:
        """Variances (M,) over parts of all quantities in the image and in the object; NaN where unknown."""
        return tuple(np.einsum("mi,ij,mj->m", pull, self.covariance, pull) for pull in self._pulls)

    @property
    def shifts(self) -> tuple[np.ndarray, np.ndarray]:
        """Bias of the same by statistical textures on this part."""
        return tuple(pull @ self.part for pull in self._pulls)

    @property
    def _pulls(self) -> tuple[np.ndarray, np.ndarray]:
        """Gradients (M, 2 E) by d and theta in image and object; NaN for a quantity that needs what is not known."""
        lost = (self.measurands.depends() & self.unknown).any(1)[:, None]
        known = self.measurands.gradient, self.measurands.gradient_object
        return tuple(np.where(lost, np.nan, gradient[:, : len(self.part)]) for gradient in known)


@dataclass(frozen=True, eq=False)
class _Places:
    """Places beside the used part of one edge, ideal px.

    Attributes
    ----------
    t, weights : ndarray, shape (n,)
        Edge points from the used part's middle, and weights of their mean.
    v : ndarray, shape (k,)
        The same beyond both ends.
    spread : ndarray, shape (n, k)
        Gaussian weights along the edge.
    u, second, third : ndarray, shape (j,)
        Distances across the edge on either side, and G'' and G''' there with the weights of an integral.
    width : float
        Standard deviation across the edge.
    """

    t: np.ndarray
    weights: np.ndarray
    v: np.ndarray
    spread: np.ndarray
    u: np.ndarray
    second: np.ndarray
    third: np.ndarray
    width: float

    @classmethod
    def of(cls, length: float, width: float, along: float, finest: float) -> _Places:
        """For a used length, widths of the smoothed edge across and along it, and the finest detail of a texture."""
        step = max(min(along, finest) / 2, length / _MOST_ALONG)
        t = np.linspace(-length / 2, length / 2, max(int(np.ceil(length / step)) + 1, 9))
        weights = np.full(t.size, 1.0)
        weights[[0, -1]] = 0.5
        extra = int(np.ceil(_FAR * along / (t[1] - t[0])))
        v = (t[1] - t[0]) * (np.arange(t.size + 2 * extra) - extra) - length / 2
        spread = np.exp(-(((v - t[:, None]) / along) ** 2) / 2)
        count = int(np.clip(np.ceil(2 * _FAR * width / min(width, finest)), *_ACROSS))
        nodes, node_weights = np.polynomial.legendre.leggauss(count)
        u, area = _FAR * width * (nodes + 1) / 2, _FAR * width * node_weights / 2
        gauss = area * np.exp(-((u / width) ** 2) / 2) / (np.sqrt(2 * np.pi) * width)
        second = gauss * (u**2 / width**4 - 1 / width**2)
        third = gauss * (3 * u / width**4 - u**3 / width**6)
        spread = spread / spread.sum(1, keepdims=True)
        return cls(t, weights / weights.sum(), v, spread, u, second, third, width)

    @property
    def line(self) -> np.ndarray:
        """Mean and slope of the least-squares line as weights of the points, (2, n)."""
        return np.stack([self.weights, self.weights * self.t / (self.weights @ self.t**2)])


def texture_errors(pictures: Pictures) -> TextureErrors | None:
    """Of one picture, found once; None without textures."""
    if not pictures.scene.textures:
        return None
    return pictures.once("texture", lambda: _texture_errors(pictures))


def _texture_errors(pictures: Pictures) -> TextureErrors:
    scene, told = pictures.scene, measurands(pictures)
    view, known = told.view, sheets(scene)
    count = len(view.names)
    nodes = place_nodes(pictures, view, used_trims(pictures, view, trimmed=True))
    seen = facing(scene.solid, pictures.viewpoint)
    part, print_, responses = np.zeros(2 * count), np.zeros(2 * count), {face: [] for face in known}
    disturbed, unknown = np.zeros(count, bool), np.zeros(count, bool)
    rims = [not known.keys().isdisjoint(_around(scene.solid, name)) for name in told.circles]
    for e in range(count):
        length = float(nodes.length[e, 0])
        own = list(scene.solid.edge(view.names[e]).faces)
        textured = [face for face in own if face in known and seen[face]]
        unknown[e] = (~seen[own] & ~scene.bodies.outer[own]).any()  # past an outer face there is none
        if not textured or not length > 0 or not view.visible[e]:
            continue
        found = _of_edge(pictures, e, nodes, length)
        take = np.array([[1.0, -float(nodes.middle[e, 0])], [0.0, 1.0]])  # to displacement at the first end, and slope
        rows = slice(2 * e, 2 * e + 2)
        print_[rows], part[rows] = take @ found.printed, take @ found.part
        disturbed[e] = found.disturbed
        for face, places, weights in found.responses:
            responses[face].append((rows, places, np.einsum("ij,jk->ik", take, weights)))
    unknown = np.concatenate([unknown, np.array(rims, bool)])
    fields = tuple((known[face], parts) for face, parts in responses.items() if parts)
    return TextureErrors(part, print_, disturbed, unknown, told, fields)


def _around(solid: Solid, circle: str) -> set[int]:
    """Faces beside a circle."""
    return {face for name in solid.circle(circle).edges for face in solid.edge(name).faces}


@dataclass(frozen=True, eq=False)
class _OfEdge:
    """Mean and slope (2,) of a line by prints and by fields; and weights (2, k) of its field at places (k, 2)."""

    printed: np.ndarray
    part: np.ndarray
    disturbed: bool
    responses: list[tuple[int, np.ndarray, np.ndarray]]


def _of_edge(pictures: Pictures, e: int, nodes, length: float) -> _OfEdge:
    scene, view = pictures.scene, measurands(pictures).view
    solid, known, name = scene.solid, sheets(scene), view.names[e]
    blur = np.hypot(edge_blur(np.mean(np.broadcast_to(nodes.blur, nodes.t.shape)[e])), scene.locator.scale_px)
    across, along = (float(np.mean(np.broadcast_to(part, nodes.t.shape)[e])) for part in (nodes.across, nodes.along))
    index = [edge.name for edge in solid.edges].index(name)
    faces = sided(solid)[index].tolist()  # opposite to the normal, and on its side
    seen = facing(solid, pictures.viewpoint)
    places = _Places.of(
        length,
        float(blur) * across,
        float(blur) / along,
        _finest(pictures, name, [face for face in faces if seen[face]]),
    )
    spatial = np.interp(places.t, nodes.t[e], nodes.spatial[e])
    bare = pictures.with_scene(scene.model_copy(update={"textures": ()}))
    levels = side_signals(bare, (name,), edge_points(solid, (name,), spatial))[0]
    levels = levels if solid.edge(name).faces[0] == faces[0] else levels[::-1]
    slope = -(levels[1] - levels[0]) / (np.sqrt(2 * np.pi) * places.width**3)
    value = {"printed": np.zeros(places.t.size), "part": np.zeros(places.t.size)}
    steeper, fields = {"printed": np.zeros(places.t.size), "part": np.zeros(places.t.size)}, []
    for sign, face, level in zip((-1.0, 1.0), faces, levels, strict=True):
        sheet = known.get(face)
        if sheet is None or not seen[face] or not level.max() > 0:
            continue
        points = _on_face(pictures, view, e, float(nodes.middle[e, 0]) + places.v, sign * places.u, face)
        bright = diffuse_signal(bare, points.reshape(-1, 3), face, 1).reshape(points.shape[:-1])
        bright = np.where(np.interp(places.v, places.t, level) > 0, bright, 0.0)
        uneven = bright * (sheet.at(points) - 1)
        which = "printed" if sheet.field is None else "part"
        value[which] += places.spread @ (places.second @ uneven)
        steeper[which] -= sign * (places.spread @ (places.third @ uneven))
        if sheet.field is not None:
            fields.append((face, sheet.nodes(points).reshape(-1, 2), places.second[:, None] * bright))
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = -1 / (slope + steeper["printed"])
        whole = -(value["printed"] + value["part"]) / (slope + steeper["printed"] + steeper["part"])
        offset = gain * value["printed"]
    changed = np.abs(steeper["printed"]) > _STEEPER * np.abs(slope)
    disturbed = bool((~(np.abs(offset) <= _FARTHEST) | changed).any()) and bool(value["printed"].any())
    weights = [
        (face, where, ((places.line * gain) @ places.spread)[:, None] * bright) for face, where, bright in fields
    ]
    return _OfEdge(
        places.line @ offset,
        places.line @ (whole - offset),
        disturbed,
        [(face, where, part.reshape(2, -1)) for face, where, part in weights],
    )


def _finest(pictures: Pictures, name: str, faces: list[int]) -> float:
    """The least length, ideal px, over which a texture beside an edge changes, foreshortened."""
    scene, found = pictures.scene, np.inf
    middle = edge_points(scene.solid, (name,), np.array([0.5]))[0]
    slope = jacobian_ideal(middle, pictures.sensors, scene.camera)[0]
    for texture in scene.textures:
        for face in set(texture.check(scene.solid, "textures").tolist()) & set(faces):
            least = np.linalg.svd(slope @ sheets(scene)[face].rectangle.axes.T, compute_uv=False)[-1]
            found = min(found, least * (2 * texture.step if isinstance(texture, ImageTexture) else texture.correlation))
    return float(found)


def _on_face(pictures: Pictures, view, e: int, along: np.ndarray, across: np.ndarray, face: int) -> np.ndarray:
    """Points (j, k, 3) of a face's plane that are seen at distances along (k,) and across (j,) an edge, ideal px."""
    camera, solid = pictures.scene.camera, pictures.scene.solid
    tangent, normal = view.along[e] / view.lengths[e], normals(view)[e]
    image = view.ends[e, 0] + along[:, None] * tangent + across[:, None, None] * normal - image_centre(camera)
    way, start = (make(image, pictures.sensors, camera) for make in (rays, ray_origins))
    height = solid.offsets[face] - start @ solid.normals[face]
    return start + (height / (way @ solid.normals[face]))[..., None] * way


def field_covariance(sheet: Sheet, parts, count: int) -> np.ndarray:
    """Covariance (count, count) over parts of sums over a field: the field's filter applied to the sums' weights."""
    margin, shape = np.array(sheet.field.margin), np.array(sheet.values.shape)
    places = np.concatenate([where for _, where, _ in parts])[:, ::-1]
    low = np.clip(np.floor(places.min(0)).astype(int), 0, shape - 1)
    size = np.clip(np.ceil(places.max(0)).astype(int) + 1, 0, shape - 1) - low + 1
    found = np.zeros((count, *(size + 2 * margin)))
    inner = found[:, margin[0] : margin[0] + size[0], margin[1] : margin[1] + size[1]]
    for rows, where, weights in parts:
        inner[rows] += [_deposited(where[:, ::-1] - low, each, size) for each in weights]
    used = np.unique(np.concatenate([np.arange(count)[rows] for rows, *_ in parts]))
    flat = np.stack([sheet.field.filtered(found[k]).ravel() for k in used])
    whole = np.zeros((count, count))
    whole[np.ix_(used, used)] = flat @ flat.T
    return whole


def _deposited(places: np.ndarray, weights: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Weights (k,) at places (row, column) as weights of the nodes between which a texture is interpolated."""
    places = np.clip(places, 0, size - 1)
    first = np.minimum(places.astype(int), size - 2)
    part = places - first
    found = np.zeros(int(np.prod(size)))
    for i in (0, 1):
        for j in (0, 1):
            share = np.abs(1 - i - part[:, 0]) * np.abs(1 - j - part[:, 1])
            flat = (first[:, 0] + i) * size[1] + first[:, 1] + j
            found += np.bincount(flat, share * weights, found.size)
    return found.reshape(size)
