"""All quantities of a scene in a stack of images, from the lines and circles found in them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtrc

from imaging.features.kinds import Evaluated, in_image, on_plane
from imaging.features.measurand import Measurands, dense, measurands
from imaging.features.placing import Adjustment
from imaging.features.seen import Seen
from imaging.geometry.lens import image_centre
from imaging.models.extremes import extremes_of, with_extremes
from imaging.pictures import Pictures
from measure.covariances import spread
from measure.features.board import FoundBoard, find_board
from measure.features.corners import intersect
from measure.features.forms import Forms, find_form
from measure.features.found import MIN_SINE, Shape
from measure.features.layout import Layout, layout_of
from measure.features.rims import Circles, find_circle
from measure.features.shape import find_shape
from measure.goodness import WORST
from scenes import Corner, Picture, Quantity, status
from scenes.measurands.between import Crossing
from scenes.measurands.kinds import MEASURANDS


@dataclass(frozen=True, eq=False)
class Values:
    """Values (n, M), derivatives (n, M, q) by lines and circles (`Seen`), and joint covariance (n, M, M)."""

    value: np.ndarray
    gradient: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True, eq=False)
class MeasuredFeatures:
    """What is found in n images.

    Attributes
    ----------
    known : Measurands
        What is expected.
    shape : Shape
        The lines.
    circles : tuple of Circles
    forms : dict
        What is found of each `Quantity` that is a form.
    seen : Seen
    errors : ndarray, shape (n, q, q)
        Joint covariance of lines and circles; those of different circles, and of circles and lines, count as
        independent, for they are found from different pixels.
    status : ndarray of str, shape (n, M)
    board : FoundBoard, optional
        What stands beside the part and tells where it lies.
    """

    known: Measurands
    shape: Shape
    circles: tuple[Circles, ...]
    forms: dict[Quantity, Forms]
    seen: Seen
    errors: np.ndarray
    status: np.ndarray
    board: FoundBoard | None = None

    @cached_property
    def image(self) -> Values:
        """In the image: px, degrees."""
        return values(self.seen, self.known.quantities, in_image, self.errors)

    @cached_property
    def plane(self) -> Values:
        """On the planes of the features: the scene's unit, degrees; the part's place adjusted where it is not known."""
        found = self.at_known
        if self.adjustment is None:
            return found
        moved = np.einsum("nmk,nk->nm", self.adjustment.pulls(found.gradient), self.placement)
        gradient = self.adjustment.gradient(found.gradient)
        return Values(found.value - moved, gradient, spread(gradient, self.errors))

    @cached_property
    def at_known(self) -> Values:
        """The same of a part whose place is known."""
        return values(self.seen, self.known.quantities, on_plane, self.errors)

    @cached_property
    def adjustment(self) -> Adjustment | None:
        """Of the part's place in each image; None where it is known."""
        placing = self.known.placing
        return None if placing is None else placing.adjusted(self.of_datums)

    @cached_property
    def of_datums(self) -> np.ndarray:
        """Covariance (n, q, q) of lines and circles, infinite on the diagonal of those that are not measured."""
        states = np.concatenate([self.shape.counted, *(c.state[:, None] for c in self.circles)], 1)
        lost = np.zeros((len(self.status), self.seen.count), bool)
        good, edges = np.isin(states.astype(str), status.MEASURED), len(self.names)
        lost[:, : 2 * edges] = np.repeat(~good[:, :edges], 2, 1)
        for c in range(len(self.circles)):
            lost[:, self.seen.numbers(c)] = ~good[:, edges + c, None]
        if self.board is not None:
            lost[:, self.seen.of_board] = ~np.isin(self.board.state, status.MEASURED)[:, None]
        return np.where(lost[:, :, None] & np.eye(self.seen.count, dtype=bool), np.inf, self.errors)

    @cached_property
    def placement(self) -> np.ndarray:
        """The most likely place of the part beside the expected one, (n, k), in units of what is known before."""
        return self.adjustment.estimate(self.offsets)

    @cached_property
    def placed(self) -> np.ndarray:
        """Covariance (n, M, M) of the values on the plane by what is not known of the part's place; 0 where it is."""
        count = len(self.known.quantities)
        if self.adjustment is None:
            return np.zeros((len(self.status), count, count))
        return self.adjustment.placed(self.at_known.gradient)

    @cached_property
    def offsets(self) -> np.ndarray:
        """How far off the expected ones lines, circles and a board are found, (n, q), numbered as in `Seen`; 0 of
        forms."""
        expected, found = self.known.seen, np.zeros((len(self.status), self.seen.count))
        found[:, : 2 * len(self.names)] = expected.line_errors(self.seen.start, self.seen.along)
        for c, circle in enumerate(self.circles):
            found[:, expected.numbers(c)] = circle.errors
        if self.board is not None:
            found[:, expected.of_board] = self.board.offsets
        return found

    @property
    def names(self) -> tuple[str, ...]:
        """Of the straight edges."""
        return self.known.view.names

    @property
    def on_forms(self) -> np.ndarray:
        """Which quantities, bool (M,), depend on the size of a form."""
        return (self.plane.gradient[..., self.seen.of_forms] != 0).any((0, 2))

    def states(self, i: int) -> np.ndarray:
        """Status of each edge and circle in the i-th image, (E + C,)."""
        edges = [status.worst(str(one), str(self.shape.whole[i])) for one in self.shape.counted[i]]
        return np.array([*edges, *(str(circle.state[i]) for circle in self.circles)])

    def with_errors(self, errors: np.ndarray) -> MeasuredFeatures:
        """The same of one image with another covariance (q, q) of its lines and circles."""
        return replace(self, errors=errors[None])

    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """The first quantity's two corners or centres (n, 2, 2), px, and their joint covariance (n, 4, 4)."""
        points = [self.seen.point(feature, None) for feature in self.known.quantities[0].features]
        rows = np.zeros((len(self.status), 4, self.seen.count))
        for i, point in enumerate(points):
            for k, move in point.moves.items():
                rows[:, 2 * i : 2 * i + 2, k] = move
        corners = np.stack([point.at for point in points], 1) + image_centre(self.seen.camera)
        return corners, spread(rows, self.errors)


def find(
    images: np.ndarray, picture: Picture, estimator: str, threshold: float | None = None, *, noiseless: bool = False
) -> MeasuredFeatures:
    """All quantities in images, shape (n, height, width).

    Straight edges by the estimator; circles by edge points around their rims, and forms by points, whatever the
    estimator. Of ``noiseless`` images a form's size is what noisy ones give on average.
    """
    known, layout = measurands(Pictures.of(picture)), layout_of(picture)
    first = picture.scene.locator.thresholds[0]
    shape = find_shape(images, layout, estimator, first if threshold is None else threshold)
    circles = tuple(find_circle(images, picture, name) for name in known.circles)
    by_name = dict(zip(known.circles, circles, strict=True))
    forms = {
        quantity: find_form(images, picture, quantity, shape, by_name, noiseless=noiseless)
        for quantity in known.seen.forms
    }
    board = find_board(images, picture, known.board) if known.board else None
    sizes = {quantity: form.size for quantity, form in forms.items()}
    seen = found_in_images(known, layout, shape.normals, shape.points, tuple(c.errors for c in circles), sizes)
    found = MeasuredFeatures(
        known=known,
        shape=shape,
        circles=circles,
        forms=forms,
        seen=seen,
        errors=_errors(shape, circles, forms, board, known.seen),
        status=_states(known, shape, circles, forms),
        board=board,
    )
    return found if found.adjustment is None else replace(found, status=_placed_states(found))


def _placed_states(found: MeasuredFeatures) -> np.ndarray:
    """The statuses (n, M), with what the adjustment of the part's place says of its datums."""
    placing, quantities = found.known.placing, found.known.quantities
    squares, freedom = placing.squares(found.of_datums, found.offsets)
    fits = chdtrc(np.maximum(freedom, 1), squares) >= WORST  # less than expected is a datum_sd on the safe side
    variances = np.einsum("nmm->nm", found.plane.covariance)
    untold = (
        found.adjustment.matters(found.at_known.gradient, variances, quantities) if placing.features else ~fits[:, None]
    )
    if found.board is not None:
        fits = fits & (found.board.state != status.MISFIT)
    said = np.where(untold, status.UNPLACED, np.where(fits[:, None], status.OK, status.MISFIT))
    pairs = zip(found.status.ravel(), np.broadcast_to(said, found.status.shape).ravel(), strict=True)
    return np.array([status.worst(*pair) for pair in pairs]).reshape(found.status.shape)


def found_in_images(
    known: Measurands, layout: Layout, normals: np.ndarray, points: np.ndarray, circle_errors: tuple[np.ndarray, ...],
    forms: dict[Quantity, np.ndarray],
) -> Seen:  # fmt: skip
    """What is seen in n images: lines of unit normals and points (n, E, 2), errors (n, p) of each circle, and sizes
    (n,) of forms."""
    expected, count = known.seen, len(normals)
    names = known.view.names
    corners = {}
    for corner in expected.corners:
        pair = [names.index(name) for name in corner.edges]
        corners[corner] = intersect(normals[:, pair], points[:, pair])[0] - image_centre(expected.camera)
    lengths = np.linalg.norm(expected.along, axis=-1)[:, None]
    sideways = [np.array(expected.sideways(expected.solid.round(name))) for name in known.circles]
    moved = [errors[:, :2] @ axes for errors, axes in zip(circle_errors, sideways, strict=True)]
    return Seen(
        solid=expected.solid,
        camera=expected.camera,
        sensors=expected.sensors,
        names=names,
        start=points - image_centre(expected.camera),
        along=lengths * np.stack([normals[..., 1], -normals[..., 0]], -1),
        corners=corners,
        circles=known.circles,
        centres=_added(expected.centres, moved, count),
        radii=_added(expected.radii, [errors[:, 2] for errors in circle_errors], count),
        half_angles=_added(expected.half_angles, [errors[:, 3:].sum(1) for errors in circle_errors], count),
        expected=False,
        forms=forms,
        board=expected.board,
    )


def _added(expected: np.ndarray, moved: list[np.ndarray], count: int) -> np.ndarray:
    """Expected numbers (C, ...) of circles with what each is moved by in n images, (n, ...)."""
    if not moved:
        return np.broadcast_to(expected, (count, *expected.shape))
    return expected + np.stack(moved, 1)


def values(seen: Seen, quantities: tuple[Quantity, ...], kind, errors: np.ndarray) -> Values:
    """Values in the image or on the plane, with their joint covariance; NaN where something is not found."""
    count = len(errors)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        found: list[Evaluated] = [kind(seen, quantity) for quantity in quantities]
        gradient = dense(found, (count,), seen.count)
        value = np.stack([np.broadcast_to(each.value, count) for each in found], -1)
        covariance = spread(gradient, errors)
        if any(True for _ in extremes_of(quantities)):
            each = [with_extremes(quantities, *one) for one in zip(value, gradient, covariance, strict=True)]
            gradient, covariance = (np.array(part) for part in zip(*each, strict=True))
        return Values(value, gradient, covariance)


def _errors(
    shape: Shape, circles: tuple[Circles, ...], forms: dict[Quantity, Forms], board: FoundBoard | None, seen: Seen
) -> np.ndarray:
    count, edges = len(shape.lines), shape.lines.shape[-1]
    whole = np.zeros((count, seen.count, seen.count))
    whole[:, :edges, :edges] = shape.lines
    for c, circle in enumerate(circles):
        part = seen.numbers(c)
        whole[:, part, part] = circle.covariance
    for k, form in enumerate(forms.values(), seen.of_forms.start):
        whole[:, k, k] = form.variance
    if board is not None:
        whole[:, seen.of_board, seen.of_board] = board.covariance
    return whole


def _states(known: Measurands, shape: Shape, circles: tuple[Circles, ...], forms: dict[Quantity, Forms]) -> np.ndarray:
    """Status of each quantity in each image, (n, M): the worst of what it needs."""
    names = known.view.names
    found = np.empty((len(shape.status), len(known.quantities)), object)
    for m, quantity in enumerate(known.quantities):
        columns = [shape.counted[:, names.index(name)] for name in quantity.edges if name in names]
        columns += [circles[known.circles.index(name)].state for name in quantity.edges if name in known.circles]
        columns += [_crossing(shape, names, each) for each in quantity.crossings]
        if any(name in names for name in quantity.edges):
            columns.append(shape.whole)
        if MEASURANDS[quantity.kind].pictures > 1:
            columns.append(np.full(len(found), status.AMBIGUOUS))
        if quantity in forms:  # an edge that is not straight does not fit a line: that is what is measured
            columns = [np.where(each == status.MISFIT, status.OK, each) for each in columns]
            columns.append(forms[quantity].state)
        found[:, m] = [status.worst(*row) for row in zip(*columns, strict=True)]
    return found.astype(str)


def _crossing(shape: Shape, names: tuple[str, ...], corner: Corner | Crossing) -> np.ndarray:
    first, second = (shape.normals[:, names.index(name)] for name in corner.edges)
    sine = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    return np.where(sine < MIN_SINE, status.ILL_CONDITIONED, status.OK)
