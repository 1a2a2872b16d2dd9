"""What sensors of a cell make of the variance, edge by edge, where the light's part is a polynomial along the edge.

The calibrated model's variance of a line is a sum over its nodes of a number that the sensor alone decides times
sigma^2 r^6 / K^2 (and gain r^3 (K_1 + K_2) / 2 K^2), r the node's distance from the light and K the contrast's strength
(`planner.search.exhaustive`). r^2 is a polynomial of the place along the edge; so are r^6 and what r^3 is never less
than, of degree `DEGREE`. In Bernstein's basis the variance is then a sum of products (sensor) x (light).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from imaging.features.locator import MIN_USABLE
from imaging.features.projected_edges import straight
from imaging.models.calibrated import SHORT
from planner.certifying.enclosed import HUGE, Enclosed, variables
from planner.certifying.lines import Line
from planner.certifying.pulls import Pull, pulls_of
from planner.certifying.series import DEGREE, direction, dot, spread_over, stacked
from planner.certifying.view import View
from planner.ranks import MIN_SINE
from planner.search.objective import Aim
from scenes import Edge, Scene


@dataclass(frozen=True, eq=False)
class Terms:
    """Of n cells.

    Attributes
    ----------
    factors : Enclosed, shape (n, M, E, DEGREE + 3)
        Of the light's polynomial in Bernstein's basis; then of the square of the range along the edge of the square
        root of what it stands for, and of how far that may be above it: both take away.
    long, brief : ndarray, shape (n, M, E, DEGREE + 3)
        The least of them of poses that see the edge longer than `SHORT` scales, and of the others; `HUGE` where there
        are none.
    norms : ndarray, shape (n, M, E, 2, 2)
        Of both kinds, what makes a coarser bound. Of the latter the least norm of the nodes' weights by the locator's
        correlation, and the greatest of their sizes times half the share of the edge that is used: a light whose r^3
        changes by a share c along the edge makes no less of it than r^6 (norm - c times the other)^2. Of the former the
        least norm alone, where r^6 changes by no more than `UNEVEN`.
    spare : ndarray, shape (n, M, E, 2)
        In place of the last two factors, what they add at most to an upper bound.
    lost, sure : ndarray of bool, shape (n,)
        Whether no pose of the cell can measure all, and whether each can: all edges are seen, long enough, and meet at
        enough of an angle.
    """

    factors: Enclosed
    long: np.ndarray
    brief: np.ndarray
    norms: np.ndarray
    spare: np.ndarray
    lost: np.ndarray
    sure: np.ndarray


@dataclass(frozen=True, eq=False)
class SensorTerms:
    """Makes `Terms` of a scene's sensors.

    Attributes
    ----------
    scene : Scene
    aim : Aim
        Whose shares each quantity is multiplied with.
    """

    scene: Scene
    aim: Aim

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The edges that are needed."""
        return straight(self.scene)

    @cached_property
    def faces(self) -> np.ndarray:
        """Indices of the faces that decide what is seen: of the edges and of those that meet them."""
        solid = self.scene.solid
        edges = [solid.edge(name) for name in self.names]
        near = [other for edge in edges for end in edge.ends for other in solid.meeting[end]]
        return np.unique([face for edge in (*edges, *near) for face in edge.faces])

    @cached_property
    def pulls(self) -> list[list[Pull]]:
        """How each quantity moves with places on its plane."""
        return [pulls_of(self.scene, quantity) for quantity in self.scene.quantities]

    def heights(self, polar: np.ndarray, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest height of sensors of cells (n, 2), (n, 2), rad, over the `faces`, each (n, F)."""
        solid, camera = self.scene.solid, self.scene.camera
        axis = direction(*variables(polar, azimuth))
        normals, offsets = solid.normals[self.faces], solid.offsets[self.faces]
        level = camera.perspective * (normals @ np.array(camera.look_at) - offsets)
        found = dot([each.wide() for each in axis], camera.distance * normals) + level
        return found.low, found.high

    def of(self, polar: np.ndarray, azimuth: np.ndarray, seen: np.ndarray) -> Terms:
        """Of cells (n, 2), (n, 2), rad, the same `faces` (F,) being seen from all."""
        whole = np.zeros(len(self.scene.solid.faces), bool)
        whole[self.faces] = seen
        view = View.of(self.scene, polar, azimuth, whole)
        lost, sure, each = np.zeros(len(polar), bool), self._are_apart(view), []
        for name in self.names:
            edge = self.scene.solid.edge(name)
            line = Line.of(view, edge)
            lost |= line.lost | (not whole[list(edge.faces)].any())
            sure &= line.sure
            each.append(self._of_edge(view, edge, line.used))
        shares = self.aim.shares[:, None, None]
        factors, *others = ([edge[k] for edge in each] for k in range(5))
        parts = [stacked([edge[m] for edge in factors]) * float(share) for m, share in enumerate(self.aim.shares)]
        long, brief, norms, spare = (np.stack(part, 2) for part in others)
        norms, spare = norms * np.sqrt(shares[..., None]), spare * shares
        return Terms(stacked(parts), long * shares, brief * shares, norms, spare, lost, sure & ~lost)

    def _are_apart(self, view: View) -> np.ndarray:
        """Whether both edges of every corner meet at enough of an angle from all of a cell, bool (n,)."""
        solid, found = self.scene.solid, np.ones(len(view.axis[0].middle), bool)
        for pull in (pull for pulls in self.pulls for pull in pulls):
            edges = tuple(map(solid.edge, pull.edges))
            ends = [solid.vertices[list(edge.ends)] for edge in edges]
            ways = [(stop - start) / np.linalg.norm(stop - start) for start, stop in ends]
            over = view.over(pull.place, *ways, edges).absolute()
            heights = [view.height(*each).high for each in ends]
            found &= over.low * view.divisor(pull.place).low >= MIN_SINE * np.prod(heights, axis=0)
        return found

    def _of_edge(
        self, view: View, edge: Edge, used: Enclosed
    ) -> tuple[list[Enclosed], np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Factors of each quantity, and the others of `Terms`, (n, M, ...), of an edge of which so much is used, px."""
        border, count, many = SHORT * self.scene.locator.scale_px, len(used.low), len(self.pulls)
        ways = (border, HUGE), (MIN_USABLE, border)
        lows = np.full((2, count, many, DEGREE + 3), HUGE)
        norms, spare = np.full((2, count, many, 2), [HUGE, 0.0]), np.zeros((count, many, 2))
        factors: list[Enclosed | None] = [None] * many
        for way, (wanted, some) in enumerate(zip(ways, (used.high >= border, used.low < border), strict=True)):
            here = np.flatnonzero(some)
            if not len(here):
                continue
            line = Line.of(view if some.all() else view.of_boxes(here), edge, wanted)
            for m in range(many):
                made, norm, own = line.factors(*self._moved(line, m))
                lows[way, here, m] = made.low
                factors[m] = spread_over(made, here, used, factors[m])
                norms[way, here, m] = norm
                spare[here, m] = np.maximum(spare[here, m], own)
        return factors, *lows, np.moveaxis(norms, 0, -2), spare

    def _moved(self, line: Line, m: int) -> tuple[Enclosed, Enclosed]:
        """Derivatives of a quantity by the displacement of an edge's first and last end, over the edge's h."""
        none = line.length * 0.0
        found = [none, none]
        for pull in self.pulls[m]:
            if line.edge.name in pull.edges:
                slope = pull.by_line(line.view, line.edge)
                found = [one + slope * share for one, share in zip(found, pull.shares(line), strict=True)]
        return found[0], found[1]
