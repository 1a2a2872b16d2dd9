"""What is known along the image of each edge: where its points are, their contrast, noise, blur and magnification."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from imaging.features.locator import reach, spacing
from imaging.features.measurand import Measurands, measurands, normals
from imaging.features.projected_edges import ProjectedEdges, cut, edge_ends, end_divisors, image_fractions
from imaging.geometry.blur import blur_at
from imaging.geometry.lens import lens_jacobian, recorded
from imaging.geometry.projection import depth, in_space
from imaging.geometry.visibility import longest_span
from imaging.light.backlight import backlights
from imaging.light.edge_sides import edge_contrast
from imaging.models.strong import strong_pieces
from imaging.pictures import Pictures
from scenes import Edge

NODES, NODE_WEIGHTS = np.polynomial.legendre.leggauss(16)
_UNCUT = 0.98  # of the noise's variance without an end of the scale: below, that has cut it off


@dataclass(frozen=True, eq=False)
class EdgeNodes:
    """Gauss-Legendre nodes along the used part of the image of each edge: (first end, nodes, last end).

    Attributes
    ----------
    t : ndarray, shape (..., E, n)
        Places from the middle of the used part, ideal px.
    middle, length : ndarray, shape (..., E, 1)
        That middle's distance from the edge's first end, and the used length, ideal px.
    spacing : ndarray, shape (..., E, 1)
        Between the edge points there (`locator.spacing`), ideal px.
    spatial : ndarray, shape (..., E, n)
        Fractions of the edge's length in space.
    blur : ndarray, shape (..., E, n), or float
        Standard deviation of the lens' blur there, px.
    across, along : ndarray, shape (..., E, n), or float
        Ideal px of offset for a recorded px across the edge, and recorded px for an ideal px along it.
    """

    t: np.ndarray
    middle: np.ndarray
    length: np.ndarray
    spacing: np.ndarray
    spatial: np.ndarray
    blur: np.ndarray | float
    across: np.ndarray | float
    along: np.ndarray | float


@dataclass(frozen=True, eq=False)
class Along:
    """Nodes, and the squared contrast and the noise's variance there, with the end of the scale and without, each
    (..., E, n)."""

    measurands: Measurands
    nodes: EdgeNodes
    squared: np.ndarray
    noise_variance: np.ndarray | float
    uncut_variance: np.ndarray | float

    @classmethod
    def of(cls, pictures: Pictures, *, trimmed: bool) -> Along:
        """Found once for each set of pictures."""
        return pictures.once(("along", trimmed), lambda: cls._of(pictures, trimmed))

    @property
    def cut_off(self) -> np.ndarray:
        """Of which edges the end of the scale has cut off levels, bool (..., E): it makes their noise less."""
        noise, uncut = (np.mean(each * np.ones(1), -1) for each in (self.noise_variance, self.uncut_variance))
        return np.broadcast_to(noise < _UNCUT * uncut, self.squared.shape[:-1])

    @classmethod
    def _of(cls, pictures: Pictures, trimmed: bool) -> Along:
        known = measurands(pictures)
        nodes = place_nodes(pictures, known.view, used_trims(pictures, known.view, trimmed=trimmed))
        return cls(known, nodes, *edge_contrast(pictures, known.view.names, nodes.spatial))


def place_nodes(pictures: Pictures, view: ProjectedEdges, trims: np.ndarray) -> EdgeNodes:
    """Nodes on what is left of each edge after trims (..., E, 2), px."""
    camera = pictures.scene.camera
    whole = np.where(view.lengths > 0, view.lengths, np.nan)[..., None]  # an edge seen end-on has no direction
    length = whole - trims.sum(-1, keepdims=True)
    length = np.where(length > 0, length, np.nan)
    middle = trims[..., :1] + length / 2
    t = length / 2 * np.concatenate([[-1], NODES, [1]])
    near, far = end_divisors(pictures.scene, view.names, pictures.sensors)
    fractions = (middle + t) / whole
    spatial = in_space(fractions, near, far)
    ends = depth(edge_ends(pictures.scene, view.names), pictures.sensors, camera)
    ends = ends.reshape(*ends.shape[:-1], len(view.names), 2)
    places = view.ends[..., :1, :] + fractions[..., None] * view.along[..., None, :]
    blur = blur_at(camera, ends[..., :1] + spatial * (ends[..., 1:] - ends[..., :1]), recorded(places, camera))
    across = along = 1.0
    if camera.lens.bends:
        across, along = _magnified(camera, view, places)
    return EdgeNodes(t, middle, length, spacing(length, pictures.scene.locator.scale_px), spatial, blur, across, along)


def _magnified(camera, view: ProjectedEdges, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ideal px across for a recorded px, and recorded px along for an ideal px, at ideal places (..., E, n, 2)."""
    slope = lens_jacobian(places, camera)
    tangent = view.along / np.where(view.lengths > 0, view.lengths, np.nan)[..., None]
    (a, b), (c, d) = np.moveaxis(slope, (-2, -1), (0, 1))
    nx, ny = np.moveaxis(normals(view)[..., None, :], -1, 0)
    back = np.hypot(d * nx - c * ny, a * ny - b * nx) / np.abs(a * d - b * c)  # length of J^-T n
    return back, np.linalg.norm(np.einsum("...nij,...j->...ni", slope, tangent), axis=-1)


def used_trims(pictures: Pictures, view: ProjectedEdges, *, trimmed: bool) -> np.ndarray:
    """Lengths left out at both ends of each edge, px, (..., E, 2): trims, and what is hidden, in shadow or does not
    stand out of the noise."""
    scene = pictures.scene
    trims = cut(view.framed, strong_pieces(pictures, view), view.lengths, 0.0) if trimmed else np.zeros_like(view.trims)
    if scene.bodies.is_convex or not view.names:
        return trims
    spans = [_span(pictures, scene.solid.edge(name)) for name in view.names]
    shown = image_fractions(scene, view.names, pictures.sensors, np.stack(spans, -2))
    return cut(trims, shown, view.lengths, reach(scene.locator.scale_px, scene.camera.most_blur_px) if trimmed else 0.0)


def _span(pictures: Pictures, edge: Edge) -> np.ndarray:
    """The longest part (..., 2) of an edge that the sensor sees and that lies in no light's shadow.

    Of several lights, those that do not reach the edge at all are passed over.
    """
    bodies, view, shown = pictures.scene.bodies, pictures.viewpoint, backlights(pictures.scene)
    lights_at = [at for i, at in enumerate(pictures.lights_at) if i not in shown]
    if len(lights_at) == 1:
        return longest_span(bodies, edge, view, *lights_at)
    found = longest_span(bodies, edge, view)
    for at in lights_at:
        lit = longest_span(bodies, edge, view, at)
        both = np.stack([np.maximum(found[..., 0], lit[..., 0]), np.minimum(found[..., 1], lit[..., 1])], -1)
        found = np.where(both[..., :1] < both[..., 1:], both, found)
    return found


def integral(values: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Integral along the edge of values at (first end, nodes, last end)."""
    return values[..., 1:-1] @ NODE_WEIGHTS * length[..., 0] / 2
