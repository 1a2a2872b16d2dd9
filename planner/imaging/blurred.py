"""The image of an arrangement under a Gaussian blur and square pixels, and its derivatives, exact for any polygons.

With k(u) = Phi((u + 1/2) / s) - Phi((u - 1/2) / s) and its integral K, the part of a pixel that a region covers is the
integral of k(x) k(y) over the region, and by Green's theorem that of K(x) k(y) dy along its boundary. Moving the
boundary changes it by the integral of k(x) k(y) times the normal displacement: derivatives cost no more than the image.
Boundaries are taken where they are recorded, so a lens' distortion is exact; defocus changes s from node to node.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from planner.imaging.arrangement import BACKGROUND, Arrangement
from planner.imaging.lens import lens_jacobian

LEAST_BLUR = 0.3  # px; a sharper image is modelled as this sharp
_REACH = 5.0  # standard deviations of the blur at which a kernel ends: 3e-7 of a step is cut off
_SPACING = 1.1  # largest distance of nodes in standard deviations of the blur: 1e-6 of a step
_PANEL = 40  # nodes of one Gauss-Legendre rule at most


class State(NamedTuple):
    """What is free: vertices (V, 2), ideal px; all regions' coefficients; blur, px."""

    vertices: np.ndarray
    levels: np.ndarray
    blur: float


class Nodes(NamedTuple):
    """Quadrature nodes on all pieces, n of them: piece, fraction of its length, weight."""

    piece: np.ndarray
    t: np.ndarray
    weight: np.ndarray


class Traced(NamedTuple):
    """The nodes' recorded places (n, 2), tangents dx/dt (n, 2), area factors of the lens (n,), blurs (n,)."""

    place: np.ndarray
    tangent: np.ndarray
    area: np.ndarray
    blur: np.ndarray


@dataclass(frozen=True, eq=False)
class Kernels:
    """Kernels of each node on its window of w x w pixels, and where they lie.

    Attributes
    ----------
    x, y : ndarray, shape (n, w)
        k at the columns and rows of the window.
    column, row : ndarray of int, shape (n,)
        The window's first pixel.
    reach : int
        The window is 2 reach + 1 wide.
    place : ndarray, shape (n, 2)
    blur : ndarray, shape (n,)
    """

    x: np.ndarray
    y: np.ndarray
    column: np.ndarray
    row: np.ndarray
    place: np.ndarray
    blur: np.ndarray

    def derivative(self, axis: int, order: int) -> np.ndarray:
        """Derivative of k by the node's x (axis 0) or y (axis 1), order 1 to 3, shape (n, w)."""
        upper, lower = self._bounds(axis)
        s = self.blur[:, None]

        def density(u):
            hermite = (1, -u, u * u - 1)[order - 1]
            return hermite * np.exp(-u * u / 2) / np.sqrt(2 * np.pi)

        return (density(upper) - density(lower)) / s**order

    def _bounds(self, axis: int) -> tuple[np.ndarray, np.ndarray]:
        first = self.row if axis else self.column
        u = self.place[:, axis, None] - first[:, None] - np.arange(self.x.shape[1])
        return (u + 0.5) / self.blur[:, None], (u - 0.5) / self.blur[:, None]


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
    def nodes(self) -> Nodes:
        """Fixed by the expected place, so that the model is a smooth function of its parameters."""
        arrangement = self.arrangement
        ends = arrangement.recorded(arrangement.vertices[arrangement.pieces])
        lengths = np.nan_to_num(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1))
        parts = [_rule(float(length), max(arrangement.blur_px, LEAST_BLUR)) for length in lengths]
        piece = np.repeat(np.arange(len(parts)), [t.size for t, _ in parts])
        t, weight = (np.concatenate(part) if parts else np.empty(0) for part in zip(*parts, strict=True))
        return Nodes(piece, t, weight)

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
            blur = np.sqrt(state.blur**2 + radius**2 / 4)
        return Traced(place, tangent, area, blur)

    def kernels(self, traced: Traced) -> Kernels:
        """Pixel kernels around each node."""
        reach = int(np.ceil(_REACH * float(traced.blur.max(initial=LEAST_BLUR)) + 1))
        place = np.nan_to_num(traced.place, nan=-1e6, posinf=1e6, neginf=-1e6)
        first = np.rint(np.clip(place, -1e6, 1e6)).astype(int) - reach
        kernels = []
        for axis in (0, 1):
            u = place[:, axis, None] - first[:, axis, None] - np.arange(2 * reach + 2) + 0.5
            edges = ndtr(u / traced.blur[:, None])
            kernels.append(edges[:, :-1] - edges[:, 1:])
        return Kernels(kernels[0], kernels[1], first[:, 0], first[:, 1], place, traced.blur)

    def slots(self, kernels: Kernels) -> np.ndarray:
        """Number of the pixel at each place of each node's window, P where there is none, (n, w, w)."""
        left, top, width, height = self._window
        steps = np.arange(kernels.x.shape[1])
        row, column = kernels.row[:, None] - top + steps, kernels.column[:, None] - left + steps
        row = np.where((row >= 0) & (row < height), row * width, width * height)
        inside = (column >= 0) & (column < width)
        place = np.where(inside[:, None, :], row[:, :, None] + column[:, None, :], width * height)
        return self._slots[np.minimum(place, width * height)]

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
        geometry, blur = self._moves(state, drawn.traced, drawn.kernels, drawn.scatter)
        return image, np.concatenate([geometry, drawn.design, blur[None]]).T

    def drawn(self, state: State) -> Drawn:
        """What does not depend on the levels; kept of the last state, for often levels alone change."""
        return _drawn(self, state.vertices.tobytes(), float(state.blur))

    def design_of(self, traced: Traced, kernels: Kernels, scatter: Scatter) -> np.ndarray:
        """What `design` gives.

        A level that is linear across the kernel adds its slope times the kernel's variance times the coverage's slope.
        """
        arrangement = self.arrangement
        covered = self._coverage(traced, kernels)
        variance = float(np.mean(traced.blur**2)) + 1 / 12 if traced.blur.size else 0.0
        density = scatter.by_piece(self.nodes.weight, len(arrangement.pieces))
        normal = np.zeros((len(arrangement.pieces), 2))
        total = np.zeros(len(arrangement.pieces))
        np.add.at(normal, self.nodes.piece, self.nodes.weight[:, None] * traced.tangent[:, ::-1] * [-1, 1])
        np.add.at(total, self.nodes.piece, self.nodes.weight)
        normal = normal / np.maximum(total, 1e-300)[:, None]
        rows = []
        for region, (basis, slope) in enumerate(zip(self.basis, self.slopes, strict=True)):
            sign = (arrangement.sides[:, 0] == region).astype(float) - (arrangement.sides[:, 1] == region)
            rise = (sign[:, None] * normal).T @ density
            rows.append(basis * covered[region] + variance * np.einsum("bip,ip->bp", slope, rise))
        return np.concatenate(rows)

    def _coverage(self, traced: Traced, kernels: Kernels) -> np.ndarray:
        """Part of each pixel that each region covers, (R, P).

        K itself does not end to the left of a node, but K(u) - K(u - 1) does: its sum from the right is K.
        """
        arrangement, (left, top, width, height) = self.arrangement, self._window
        reach, size = (kernels.x.shape[1] - 1) // 2, self.x.size
        s = traced.blur[:, None]
        u = kernels.place[:, :1] - kernels.column[:, None] + 1.5 - np.arange(2 * reach + 4)
        edge = _ramp(u / s) * s
        rise = edge[:, :-2] - 2 * edge[:, 1:-1] + edge[:, 2:]
        column = np.minimum(kernels.column[:, None] - left + np.arange(-1, 2 * reach + 1), width - 1)
        row = kernels.row[:, None] - top + np.arange(2 * reach + 1)
        value = (kernels.y * (self.nodes.weight * traced.tangent[:, 1])[:, None])[:, :, None] * rise[:, None]
        inside = ((row >= 0) & (row < height))[:, :, None] & (column >= 0)[:, None, :]
        place = self._last[np.where(inside, row[:, :, None] * width + column[:, None, :], height * width)]
        covered = np.empty((len(arrangement.regions), size))
        sides = arrangement.sides[self.nodes.piece]
        for region in range(1, len(arrangement.regions)):
            beside = (sides == region).any(1)
            sign = np.where(sides[beside, :1] == region, 1.0, -1.0)[:, :, None]
            found = np.bincount(place[beside].ravel(), (sign * value[beside]).ravel(), size + 1)
            found[size] = 0.0
            total = found[::-1].cumsum()[::-1]  # of this row and all below
            covered[region, self._order] = total[:-1] - total[self._below]
        covered[BACKGROUND] = 1 - covered[1:].sum(0)
        return covered

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

    def _moves(self, state, traced, kernels, scatter) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives by the free vertices' coordinates (2 F, P) and by the blur (P,)."""
        arrangement, nodes = self.arrangement, self.nodes
        weight = nodes.weight * self.contrasts(state, traced)
        along = state.vertices[arrangement.pieces[:, 1]] - state.vertices[arrangement.pieces[:, 0]]
        place = np.full(len(arrangement.vertices), -1)
        place[self.free] = np.arange(self.free.size)
        rows = np.zeros((2 * self.free.size, self.x.size))
        for end, share in enumerate((1 - nodes.t, nodes.t)):
            images = scatter.by_piece(weight * traced.area * share, len(arrangement.pieces))
            for piece, vertex in enumerate(place[arrangement.pieces[:, end]]):
                if vertex >= 0:
                    rows[2 * vertex] += along[piece, 1] * images[piece]
                    rows[2 * vertex + 1] -= along[piece, 0] * images[piece]
        leaning = nodes.weight * self._leaning(state, traced)
        blur = scatter.blur(weight, traced, kernels) - scatter.at_all(leaning)
        return rows, blur * state.blur

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


@dataclass(frozen=True, eq=False)
class Scatter:
    """Adds the nodes' kernels up at the pixels.

    Attributes
    ----------
    slot : ndarray of int, shape (n, w, w)
        Pixel of each place of each node's window; ``size`` for none.
    product : ndarray, shape (n, w, w)
        k(x) k(y).
    piece : ndarray of int, shape (n,)
    size : int
        Number of pixels.
    """

    slot: np.ndarray
    product: np.ndarray
    piece: np.ndarray
    size: int

    @classmethod
    def of(cls, model: BlurredModel, kernels: Kernels) -> Scatter:
        slot = model.slots(kernels)
        return cls(slot, kernels.y[:, :, None] * kernels.x[:, None, :], model.nodes.piece, model.x.size)

    def by_piece(self, weight: np.ndarray, count: int) -> np.ndarray:
        """Sum of weight (n,) times kernel for each piece, (count, P)."""
        return self.add(self.product * weight[:, None, None], count)

    def at_all(self, weight: np.ndarray) -> np.ndarray:
        """Sum of weight (n,) times kernel, (P,)."""
        values = self.product * weight[:, None, None]
        return np.bincount(self.slot.ravel(), values.ravel(), self.size + 1)[:-1]

    def add(self, values: np.ndarray, count: int) -> np.ndarray:
        """Sum of values (n, w, w) for each piece at each pixel, (count, P)."""
        found = np.bincount(self._index.ravel(), values.ravel(), count * (self.size + 1))
        return found.reshape(count, self.size + 1)[:, :-1]

    @cached_property
    def _index(self) -> np.ndarray:
        return self.piece[:, None, None] * (self.size + 1) + self.slot

    def blur(self, weight: np.ndarray, traced: Traced, kernels: Kernels) -> np.ndarray:
        """Derivative by the blur over the blur: a blurred image obeys the heat equation, (P,)."""
        across = kernels.y[:, :, None] * (kernels.derivative(0, 1) * (weight * traced.tangent[:, 1])[:, None])[:, None]
        across -= (kernels.derivative(1, 1) * (weight * traced.tangent[:, 0])[:, None])[:, :, None] * kernels.x[:, None]
        return np.bincount(self.slot.ravel(), across.ravel(), self.size + 1)[:-1]


class Drawn(NamedTuple):
    """The nodes where a state puts them, their kernels, these at the pixels, and what `BlurredModel.design` gives."""

    traced: Traced
    kernels: Kernels
    scatter: Scatter
    design: np.ndarray


@lru_cache(maxsize=1)
def _drawn(model: BlurredModel, vertices: bytes, blur: float) -> Drawn:
    traced = model.trace(State(np.frombuffer(vertices).reshape(-1, 2), np.empty(0), blur))
    kernels = model.kernels(traced)
    scatter = Scatter.of(model, kernels)
    return Drawn(traced, kernels, scatter, model.design_of(traced, kernels, scatter))


@lru_cache(maxsize=4096)
def _rule(length: float, blur: float) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and weights on (0, 1) for a piece so many px long: panels of at most `_PANEL` nodes."""
    wanted = np.pi / 2 * min(length, 1e5) / (_SPACING * blur) + 4
    panels = int(np.ceil(wanted / _PANEL))
    nodes, weights = _legendre(int(np.ceil(wanted / panels)))
    t = (np.arange(panels)[:, None] + (1 + nodes) / 2).ravel() / panels
    return t, np.tile(weights / 2, panels) / panels


@lru_cache(maxsize=128)
def _legendre(count: int) -> tuple[np.ndarray, np.ndarray]:
    return np.polynomial.legendre.leggauss(count)
