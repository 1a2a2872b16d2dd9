"""The image of an arrangement under a Gaussian blur and square pixels, and its derivatives, exact for any polygons.

With k(u) = Phi((u + 1/2) / s) - Phi((u - 1/2) / s) and its integral K, the part of a pixel that a region covers is the
integral of k(x) k(y) over the region, and by Green's theorem that of K(x) k(y) dy along its boundary. Moving the
boundary changes it by the integral of k(x) k(y) times the normal displacement: derivatives cost no more than the image.
Boundaries are taken where they are recorded, so a lens' distortion is exact; defocus and the lens' field change s from
node to node.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from imaging.blurred.arrangement import BACKGROUND, Arrangement
from imaging.blurred.kernels import Kernels, Scatter
from imaging.blurred.quadrature import PieceNodes
from imaging.geometry.lens import lens_jacobian

_HALFWAY = tuple((1 + each) / 2 if i == 0 else each / 2 for i, each in enumerate(np.polynomial.legendre.leggauss(4)))
LEAST_BLUR = 0.3  # px; a sharper image is modelled as this sharp


class State(NamedTuple):
    """What is free: vertices (V, 2), ideal px; all regions' coefficients; blur, px."""

    vertices: np.ndarray
    levels: np.ndarray
    blur: float


class Traced(NamedTuple):
    """The nodes' recorded places (n, 2), tangents dx/dt (n, 2), area factors of the lens (n,), blurs (n,)."""

    place: np.ndarray
    tangent: np.ndarray
    area: np.ndarray
    blur: np.ndarray


@dataclass(frozen=True, eq=False)
class BlurredModel:
    """Expected image of an arrangement at P pixels.

    Attributes
    ----------
    arrangement : Arrangement
    x, y : ndarray of int, shape (P,)
        The pixels.
    free : ndarray of int, shape (F,)
        Vertices whose positions are free.
    """

    arrangement: Arrangement
    x: np.ndarray
    y: np.ndarray
    free: np.ndarray

    @property
    def count(self) -> int:
        """Number of parameters: free vertices' x and y, levels, blur."""
        return 2 * self.free.size + self.arrangement.level_slices[-1].stop + 1

    @cached_property
    def moving(self) -> np.ndarray:
        """The pieces that free vertices move, shape (N,)."""
        return np.flatnonzero(np.isin(self.arrangement.pieces, self.free).any(1))

    @cached_property
    def points(self) -> np.ndarray:
        """The pixels' centres, recorded px, shape (P, 2)."""
        return np.stack([self.x, self.y], 1).astype(float)

    @cached_property
    def basis(self) -> tuple[np.ndarray, ...]:
        """Each region's basis functions at the pixels, (count, P)."""
        return tuple(region.basis(self.points) for region in self.arrangement.regions)

    @cached_property
    def slopes(self) -> tuple[np.ndarray, ...]:
        """Their derivatives, (count, 2, P)."""
        return tuple(region.slope(self.points) for region in self.arrangement.regions)

    @cached_property
    def nodes(self) -> PieceNodes:
        """Fixed by the expected place, so that the model is a smooth function of its parameters."""
        arrangement = self.arrangement
        ends = arrangement.recorded(arrangement.vertices[arrangement.pieces])
        lengths = np.nan_to_num(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1))
        start, stop = arrangement.vertices[arrangement.pieces].swapaxes(0, 1)[..., None, :]
        beside = arrangement.beside_blur(start + np.linspace(0, 1, 9)[:, None] * (stop - start)).min(initial=0.0)
        return PieceNodes.on(lengths, max(float(np.sqrt(max(arrangement.blur_px**2 + beside, 0.0))), LEAST_BLUR))

    @cached_property
    def _beside_blur(self) -> np.ndarray:
        """Variance that the field adds at the nodes, where they are expected, (n,)."""
        start, stop = self.arrangement.vertices[self.arrangement.pieces[self.nodes.piece]].swapaxes(0, 1)
        return self.arrangement.beside_blur(start + self.nodes.t[:, None] * (stop - start))

    @cached_property
    def _window(self) -> tuple[int, int, int, int]:
        """First column and row, width and height of the part of the image that the pixels span."""
        left, top = int(self.x.min()), int(self.y.min())
        return left, top, int(self.x.max()) - left + 1, int(self.y.max()) - top + 1

    @cached_property
    def _slots(self) -> np.ndarray:
        """Number of the pixel at each place of the window, P where it is not used; flat, one place more for outside."""
        left, top, width, height = self._window
        slots = np.full(width * height + 1, self.x.size, np.int32)
        slots[(self.y - top) * width + self.x - left] = np.arange(self.x.size)
        return slots

    @cached_property
    def _order(self) -> np.ndarray:
        """The pixels row by row, from left to right."""
        return np.lexsort((self.x, self.y))

    @cached_property
    def _below(self) -> np.ndarray:
        """Where in `_order` the next row begins, for each pixel of it."""
        rows = self.y[self._order]
        return np.searchsorted(rows, rows, side="right")

    @cached_property
    def _last(self) -> np.ndarray:
        """Which of `_order` is the row's last up to each place of the window, P for none; flat, as `_slots`."""
        left, top, width, height = self._window
        found = np.full(height * width + 1, -1, np.int32)
        rows = found[:-1].reshape(height, width)
        rows[(self.y - top)[self._order], (self.x - left)[self._order]] = np.arange(self.x.size)
        np.maximum.accumulate(rows, 1, out=rows)
        found[found < 0] = self.x.size
        return found

    def start(self, levels: np.ndarray | None = None) -> State:
        """The expected state; levels as the light gives them, 0 where it is not known."""
        arrangement = self.arrangement
        if levels is None:
            levels = np.concatenate([_first(region.count, float(region.known)) for region in arrangement.regions])
        return State(arrangement.vertices, levels, max(arrangement.blur_px, LEAST_BLUR))

    def moved(self, state: State, step: np.ndarray) -> State:
        """The state with all parameters changed by ``step`` (count,)."""
        vertices, f = state.vertices.copy(), 2 * self.free.size
        vertices[self.free] += step[:f].reshape(-1, 2)
        return State(vertices, state.levels + step[f:-1], max(state.blur + float(step[-1]), LEAST_BLUR / 2))

    def trace(self, state: State) -> Traced:
        """The nodes where the state puts them."""
        arrangement, nodes = self.arrangement, self.nodes
        start, stop = state.vertices[arrangement.pieces[nodes.piece]].swapaxes(0, 1)
        along, place = stop - start, start + nodes.t[:, None] * (stop - start)
        blur, tangent, area = np.full(nodes.t.size, state.blur), along, np.ones(nodes.t.size)
        if arrangement.camera is not None:
            bend = lens_jacobian(place, arrangement.camera)
            tangent = np.einsum("nij,nj->ni", bend, along)
            area = bend[:, 0, 0] * bend[:, 1, 1] - bend[:, 0, 1] * bend[:, 1, 0]
            place = arrangement.recorded(place)
            radii = arrangement.defocus[arrangement.pieces[nodes.piece]]
            radius = radii[:, 0] + nodes.t * (radii[:, 1] - radii[:, 0])
            blur = np.sqrt(np.maximum(state.blur**2 + self._beside_blur + radius**2 / 4, (LEAST_BLUR / 2) ** 2))
        return Traced(place, tangent, area, blur)

    def slots(self, kernels: Kernels) -> np.ndarray:
        """Number of the pixel at each place of each node's window, P where there is none, (n, w, w)."""
        column = kernels.column[:, None] - self._window[0] + np.arange(kernels.x.shape[1])
        return self._looked_up(self._slots, kernels, np.where(column < self._window[2], column, -1))

    def _looked_up(self, table: np.ndarray, kernels: Kernels, column: np.ndarray) -> np.ndarray:
        """What a table says of columns (n, c) of the window, outside if < 0, in the rows of kernels, (n, w, c)."""
        _, top, width, height = self._window
        row, outside = kernels.row[:, None] - top + np.arange(kernels.y.shape[1]), width * height
        row = np.where((row >= 0) & (row < height), row * np.int64(width), outside)
        column = np.where(column >= 0, column, outside)
        return table.take(row[:, :, None] + column[:, None, :], mode="clip")

    def image(self, state: State) -> np.ndarray:
        """Expected grey levels above darkness, shape (P,)."""
        return self.evaluate(state, derivatives=False)[0]

    def design(self, state: State) -> np.ndarray:
        """Derivative of the image by the level coefficients, (levels, P): the image is linear in them."""
        return self.drawn(state).design

    def evaluate(self, state: State, derivatives: bool = True) -> tuple[np.ndarray, np.ndarray | None]:
        """The image (P,) and its derivative by all parameters (P, count)."""
        drawn = self.drawn(state)
        image = state.levels @ drawn.design
        if not derivatives:
            return image, None
        geometry, blur = self._moves(state, drawn)
        return image, np.concatenate([geometry, drawn.design, blur[None]]).T

    def drawn(self, state: State) -> Drawn:
        """What does not depend on the levels; kept of the last state, for often levels alone change."""
        return _drawn(self, state.vertices.tobytes(), float(state.blur))

    def design_of(self, traced: Traced, kernels: Kernels, scatter: Scatter, product: np.ndarray) -> np.ndarray:
        """What `design` gives.

        A level that is linear across the kernel adds its slope times the kernel's variance times the coverage's slope.
        """
        covered = self._coverage(traced, kernels)
        if not any(slope.any() for slope in self.slopes):
            return np.concatenate([basis * part for basis, part in zip(self.basis, covered, strict=True)])
        wide = self.nodes.weight * (traced.blur**2 + 1 / 12)
        rise = scatter.by_piece(product, wide[:, None] * traced.tangent[:, ::-1] * [-1, 1])
        parts = zip(self.basis, covered, self.slopes, (self._signs @ rise).swapaxes(0, 1), strict=True)
        return np.concatenate(
            [basis * part + slope[:, 0] * to[0] + slope[:, 1] * to[1] for basis, part, slope, to in parts]
        )

    @cached_property
    def _signs(self) -> np.ndarray:
        """1 where a region lies on a piece's first side, -1 on its other, (R, N)."""
        regions, sides = np.arange(len(self.arrangement.regions))[:, None], self.arrangement.sides
        return (sides[:, 0] == regions).astype(float) - (sides[:, 1] == regions)

    def _coverage(self, traced: Traced, kernels: Kernels) -> np.ndarray:
        """Part of each pixel that each region covers, (R, P).

        K itself does not end to the left of a node, but K(u) - K(u - 1) does: its sum from the right is K. That holds
        of one blur for all nodes, for K reaches past them; what else blurs is added where it is.
        """
        if np.ptp(traced.blur) > 0:
            even = traced._replace(blur=np.full(traced.blur.size, np.sqrt(np.mean(traced.blur**2))))
            around = Kernels.around(even.place, even.blur, LEAST_BLUR)
            return self._coverage(even, around) + self._beside(traced, even.blur)
        left, _, width, _ = self._window
        s, steps = traced.blur[:, None], np.arange(kernels.x.shape[1] + 1) - 1
        edge = _ramp((kernels.place[:, :1] - kernels.column[:, None] + 1.5 - np.arange(len(steps) + 2)) / s) * s
        rise = edge[:, :-2] - 2 * edge[:, 1:-1] + edge[:, 2:]
        last = self._looked_up(self._last, kernels, np.minimum(kernels.column[:, None] - left + steps, width - 1))
        scatter = Scatter(last, self.nodes.piece, len(self._signs.T), self.x.size)
        value, weight = kernels.y[:, :, None] * rise[:, None], self.nodes.weight * traced.tangent[:, 1]
        found = self._signs @ scatter.by_piece(value, weight[:, None])[0]
        total = np.concatenate([found[:, ::-1].cumsum(1)[:, ::-1], np.zeros((len(found), 1))], 1)
        covered = np.empty_like(found)
        covered[:, self._order] = total[:, :-1] - total[:, self._below]
        covered[BACKGROUND] = 1 - np.delete(covered, BACKGROUND, 0).sum(0)
        return covered

    def _beside(self, traced: Traced, blur: np.ndarray) -> np.ndarray:
        """What the nodes' own blurs change of the coverage by another blur (n,), (R, P).

        Half the integral, over the variance from the one to the other, of the slope of k(x) k(y) across the boundary:
        a blurred image obeys the heat equation.
        """
        first, added = blur**2, traced.blur**2 - blur**2
        found = np.zeros((len(self._signs), self.x.size))
        for place, weight in zip(*_HALFWAY, strict=True):
            kernels = Kernels.around(traced.place, np.sqrt(first + place * added), LEAST_BLUR)
            scatter = Scatter(self.slots(kernels), self.nodes.piece, len(self._signs.T), self.x.size)
            across, down = (self.nodes.weight[:, None] * traced.tangent).T
            values = (kernels.derivative(0, 1) * down[:, None])[:, None] * kernels.y[:, :, None]
            values -= (kernels.derivative(1, 1) * across[:, None])[:, :, None] * kernels.x[:, None]
            found += self._signs @ scatter.by_piece(values, (weight * added / 2)[:, None])[0]
        found[BACKGROUND] = -np.delete(found, BACKGROUND, 0).sum(0)
        return found

    def contrasts(self, state: State, traced: Traced) -> np.ndarray:
        """First side minus other side at each node, grey levels, (n,)."""
        arrangement, nodes = self.arrangement, self.nodes
        found = np.zeros(nodes.t.size)
        for region, part in enumerate(arrangement.level_slices):
            for side, sign in ((0, 1.0), (1, -1.0)):
                here = arrangement.sides[nodes.piece, side] == region
                if here.any():
                    basis = arrangement.regions[region].basis(np.nan_to_num(traced.place[here]))
                    found[here] += sign * (state.levels[part] @ basis)
        return found

    def _moves(self, state: State, drawn: Drawn) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives by the free vertices' coordinates (2 F, P) and by the blur (P,)."""
        arrangement, nodes, (traced, _, scatter, product, _) = self.arrangement, self.nodes, drawn
        weight = nodes.weight * self.contrasts(state, traced)
        along = state.vertices[arrangement.pieces[:, 1]] - state.vertices[arrangement.pieces[:, 0]]
        place = np.full(len(arrangement.vertices), -1)
        place[self.free] = np.arange(self.free.size)
        rows = np.zeros((2 * self.free.size, self.x.size))
        shares = weight * traced.area * np.stack([1 - nodes.t, nodes.t])
        for end, images in enumerate(scatter.by_piece(product, shares.T)):
            for piece, vertex in enumerate(place[arrangement.pieces[:, end]]):
                if vertex >= 0:
                    rows[2 * vertex] += along[piece, 1] * images[piece]
                    rows[2 * vertex + 1] -= along[piece, 0] * images[piece]
        leaning = scatter.at_all(product, nodes.weight * self._leaning(state, traced))
        return rows, (self._spread(weight, drawn) - leaning) * state.blur

    def _spread(self, weight: np.ndarray, drawn: Drawn) -> np.ndarray:
        """Derivative by the blur over the blur: a blurred image obeys the heat equation, (P,)."""
        _, kernels, scatter, _, _ = drawn
        across, down = (weight[:, None] * drawn.traced.tangent).T
        values = (kernels.derivative(0, 1) * down[:, None])[:, None] * kernels.y[:, :, None]
        values -= (kernels.derivative(1, 1) * across[:, None])[:, :, None] * kernels.x[:, None]
        return scatter.at_all(values, np.ones(len(weight)))

    def _leaning(self, state: State, traced: Traced) -> np.ndarray:
        """Slope of the contrast across the piece, times its tangent's length, at each node, (n,)."""
        arrangement, nodes = self.arrangement, self.nodes
        across = np.stack([traced.tangent[:, 1], -traced.tangent[:, 0]])
        found = np.zeros(nodes.t.size)
        for region, part in enumerate(arrangement.level_slices):
            for side, sign in ((0, 1.0), (1, -1.0)):
                here = arrangement.sides[nodes.piece, side] == region
                if here.any():
                    slope = arrangement.regions[region].slope(np.nan_to_num(traced.place[here]))
                    found[here] += sign * np.einsum("b,bin,in->n", state.levels[part], slope, across[:, here])
        return found


def _first(count: int, value: float) -> np.ndarray:
    """The value, then zeros."""
    return np.concatenate([[value], np.zeros(count - 1)])


def _ramp(u: np.ndarray) -> np.ndarray:
    """Integral of the normal distribution function."""
    return u * ndtr(u) + np.exp(-u * u / 2) / np.sqrt(2 * np.pi)


class Drawn(NamedTuple):
    """What a state's levels do not change.

    The nodes where it puts them, their kernels, these at the pixels, k(x) k(y) (n, w, w), and `BlurredModel.design`.
    """

    traced: Traced
    kernels: Kernels
    scatter: Scatter
    product: np.ndarray
    design: np.ndarray


@lru_cache(maxsize=1)
def _drawn(model: BlurredModel, vertices: bytes, blur: float) -> Drawn:
    traced = model.trace(State(np.frombuffer(vertices).reshape(-1, 2), np.empty(0), blur))
    kernels = Kernels.around(traced.place, traced.blur, LEAST_BLUR)
    scatter = Scatter(model.slots(kernels), model.nodes.piece, len(model.arrangement.pieces), model.x.size)
    product = kernels.product()
    return Drawn(traced, kernels, scatter, product, model.design_of(traced, kernels, scatter, product))
