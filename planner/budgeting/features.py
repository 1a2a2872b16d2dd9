"""What a picture of another station does to lines, circles and boards that are found in it by who believes the scene.

Every point of a feature is recorded elsewhere; the believed camera's model takes it back to ideal coordinates, and the
least-squares line or circle through all points of the feature follows. It is found as the estimators find it: densely
along the part of an edge that is used, weighted by contrast around a rim.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.features.circles import RimImage, rim
from imaging.features.limb_outline import limb_outline
from imaging.features.limbs import limb_rim
from imaging.features.locator import MIN_CONTRAST
from imaging.features.measurand import Measurands, measurands, normals
from imaging.features.rim_sides import outward_normals
from imaging.geometry.lens import undistorted
from imaging.geometry.projection import edge_points, project_ideal
from imaging.models import DEFAULT_MODEL, variance_model
from imaging.models.along import NODE_WEIGHTS, EdgeNodes, place_nodes, used_trims
from imaging.models.form_law import needed, residues
from imaging.pictures import Pictures
from planner.budgeting.station import Station, records
from scenes import Curved, Quantity
from scenes.measurands.features import place_of
from scenes.measurands.form import reference_of


@dataclass(frozen=True, eq=False)
class Features:
    """The lines and circles of one picture as the scene says it, ready to be found in pictures of other stations.

    Attributes
    ----------
    pictures : Pictures
        One picture.
    of_rims : bool
        Whether circles are found. They cost most of the time; without them what depends on them is NaN.
    """

    pictures: Pictures
    of_rims: bool = True

    @cached_property
    def known(self) -> Measurands:
        """Values and derivatives by the features' errors."""
        return measurands(self.pictures)

    @cached_property
    def gradient_object(self) -> np.ndarray:
        """Derivatives (M, q) of the values in the object by those errors, the part's place adjusted."""
        if self.known.placing is None:
            return self.known.gradient_object
        return variance_model(DEFAULT_MODEL)(self.pictures).gradient_object

    def errors(self, stations: Sequence[Station]) -> np.ndarray:
        """Errors of lines and circles in the pictures of S stations, as numbered in `imaging.features.seen`, (S, q).

        Displacement of each line at its first end's place (ideal px) and tangent of its rotation; shifts of each
        circle's centre in its plane and change of its radius (the scene's unit); the zones of forms, with the sign of
        the farthest point's side (the scene's unit); a board's own parameters. NaN where a feature is not seen.
        """
        on_edges, *on_rims = self._displaced(stations)
        parts = [self._lines(on_edges), *self._circles(on_rims)]
        parts += [self._forms(on_edges, on_rims), np.stack([self._board(each) for each in stations])]
        return np.concatenate(parts, -1)

    @cached_property
    def _nodes(self) -> tuple[EdgeNodes, np.ndarray]:
        """Along the edges, and their points in space (E, n, 3)."""
        view = self.known.view
        nodes = place_nodes(self.pictures, view, used_trims(self.pictures, view, trimmed=True))
        solid = self.pictures.scene.solid
        return nodes, edge_points(solid, view.names, nodes.spatial[..., 1:-1])

    def _lines(self, moved: np.ndarray) -> np.ndarray:
        """(d, tan theta) of each edge, (..., 2 E): of the line through its points, displaced by (..., E, n, 2)."""
        view = self.known.view
        if not view.names:
            return np.zeros((len(moved), 0))
        (nodes, _), normal = self._nodes, normals(view)
        off = np.einsum("...eni,ei->...en", moved, normal)
        tangent = np.stack([normal[:, 1], -normal[:, 0]], -1)
        along = nodes.middle + nodes.t[..., 1:-1] + np.einsum("...eni,ei->...en", moved, tangent)
        middle, mean = (part @ NODE_WEIGHTS / 2 for part in (along, off))
        lever = along - middle[..., None]
        turn = ((off * lever) @ NODE_WEIGHTS) / (lever**2 @ NODE_WEIGHTS)
        return np.stack([mean - turn * middle, turn], -1).reshape(len(moved), -1)

    def _circles(self, moved: list[np.ndarray]) -> list[np.ndarray]:
        """Shifts and growth of each circle, (S, 3) or (S, 4), of displacements (S, n, 2) of its points."""
        if not self.of_rims:
            return [
                np.full((len(each), count), np.nan) for each, count in zip(moved, self.known.seen.sizes, strict=True)
            ]
        return [off @ fit.T for (_, _, fit), off in zip(self._rims, self._outwards(moved), strict=True)]

    @cached_property
    def _rims(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Of each circle its points in space (n, 3), their image's normals (n, 2), and the fit (p, n)."""
        if not self.of_rims:
            return [(np.zeros((0, 3)), np.zeros((0, 2)), np.zeros((0, 0)))] * len(self.known.circles)
        found = []
        for name in self.known.circles:
            circle = self.pictures.scene.solid.round(name)
            if isinstance(circle, Curved):
                found.append(self._limb(circle))
                continue
            seen = rim(self.pictures, circle)
            angle = circle.angles(seen.design.shape[-2])
            normal, _, _ = outward_normals(self.pictures, circle, angle)
            points = circle.at(angle)
            found.append((points, normal, _fit(seen)))
        return found

    def _limb(self, curved: Curved) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same of a limb: to first order its image moves along its normal as a point of the surface there does."""
        outline = limb_outline(curved, self.pictures.sensors, self.pictures.scene.camera)
        points = np.where(outline.seen[:, None], outline.points, curved.centre)
        return points, np.nan_to_num(outline.outward), _fit(limb_rim(self.pictures, curved))

    def _outwards(self, on_rims: list[np.ndarray]) -> list[np.ndarray]:
        """Along the normals of each circle's image, (..., n), displacements (..., n, 2)."""
        return [np.einsum("...ni,ni->...n", moved, each[1]) for moved, each in zip(on_rims, self._rims, strict=True)]

    def _forms(self, on_edges: np.ndarray, on_rims: list[np.ndarray]) -> np.ndarray:
        """Zones of forms, (S, F)."""
        quantities = self.known.seen.forms
        found = [
            [self._form(on_edges[s], [each[s] for each in on_rims], quantity) for quantity in quantities]
            for s in range(len(on_edges))
        ]
        return np.reshape(found, (len(on_edges), len(quantities)))

    def _form(self, on_edges: np.ndarray, on_rims: list[np.ndarray], quantity: Quantity) -> float:
        """Of points that a perfect feature has elsewhere: their zone, which is as large to either side of an input."""
        name = place_of(quantity.features[0])
        if name in self.known.circles and not self.of_rims:
            return np.nan
        if name in self.known.circles:
            off, design = self._beside_rim(on_rims, self.known.circles.index(name))
        else:
            off, design = self._beside_edge(on_edges, quantity)
        if reference_of(quantity) != "nominal" and len(off):
            off = residues(design) @ off
        if not (len(off) and np.isfinite(off).all()):
            return np.nan
        size = needed(reference_of(quantity))(off)
        return float(size * np.sign(off[np.abs(off).argmax()]))

    def _board(self, station: Station) -> np.ndarray:
        """Parameters of a board, of which none are where there is none."""
        here, there = self.pictures.scene.placement.board, station.scene.placement.board
        board = self.known.board
        if here is None or there is None or board is None:
            return np.zeros(0)
        camera = self.pictures.scene.camera
        found = undistorted(station.record(station.board_at(there.points)), camera)
        moved = found - project_ideal(here.points, self.pictures.sensors, camera)
        return np.einsum("kni,ni->k", board.gain(), moved)

    def _beside_edge(self, moved: np.ndarray, quantity: Quantity) -> tuple[np.ndarray, np.ndarray]:
        """Distances of an edge's points, the scene's unit, and the design of its line."""
        view = self.known.view
        e = view.names.index(place_of(quantity.features[0]))
        nodes, points = self._nodes
        normal = normals(view)[e]
        scale = self.known.seen.per_unit(quantity.features[0], points[e], normal)
        off = moved[e] @ normal / scale
        return off, np.stack([np.ones(off.size), nodes.t[e, 1:-1]], -1)

    def _beside_rim(self, on_rims: list[np.ndarray], c: int) -> tuple[np.ndarray, np.ndarray]:
        """Outward distances of a circle's points that are used, the scene's unit, and the design of its circle."""
        fit = self._rims[c][2]
        used = (fit != 0).any(0) & np.isfinite(fit).all()
        each = self.pictures.scene.solid.round(self.known.circles[c])
        image = limb_rim(self.pictures, each) if isinstance(each, Curved) else rim(self.pictures, each)
        design = image.design[used]
        off = self._outwards(on_rims)[c][used]
        return off / design[:, 2], design[:, :3] / design[:, 2:3]

    @cached_property
    def _points(self) -> list[np.ndarray]:
        """In space: along the edges (E, n, 3), then around each circle (n, 3)."""
        on_edges = self._nodes[1] if self.known.view.names else np.zeros((0, 0, 3))
        return [on_edges, *(points for points, _, _ in self._rims)]

    @cached_property
    def _believed(self) -> tuple[np.ndarray, np.ndarray]:
        """All of them in a row (N, 3), and where the believed camera sees them, ideal px (N, 2)."""
        flat = np.concatenate([each.reshape(-1, 3) for each in self._points])
        return flat, project_ideal(flat, self.pictures.sensors, self.pictures.scene.camera)

    def _displaced(self, stations: Sequence[Station]) -> list[np.ndarray]:
        """How far off the points are found, ideal px of the believed camera, (S, ..., 2) for each of `_points`."""
        flat, believed = self._believed
        off = undistorted(records(stations, flat), self.pictures.scene.camera) - believed
        sizes = np.cumsum([each.size // 3 for each in self._points])[:-1]
        parts = np.split(off, sizes, axis=1)
        return [some.reshape(len(stations), *at.shape[:-1], 2) for some, at in zip(parts, self._points, strict=True)]


def _fit(seen: RimImage) -> np.ndarray:
    """Weighted least squares from offsets around a rim to its circle, (p, n); NaN where it is not found."""
    ratio = seen.squared / seen.noise_variance
    weight = np.where(ratio >= MIN_CONTRAST**2, seen.share * ratio * seen.arc, 0.0)
    size = np.sqrt(np.einsum("n,ni,ni->i", weight, seen.design, seen.design))
    if not (size > 0).all():
        return np.full((seen.design.shape[1], len(weight)), np.nan)
    design = seen.design / size
    gram = np.einsum("n,ni,nj->ij", weight, design, design)
    if np.linalg.eigvalsh(gram)[0] < 1e-10:
        return np.full((seen.design.shape[1], len(weight)), np.nan)
    return np.linalg.solve(gram, (design * weight[:, None]).T) / size[:, None]
