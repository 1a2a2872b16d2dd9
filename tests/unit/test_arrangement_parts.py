"""The likelihood of a whole arrangement: its pieces against residuals and derivatives written out."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from scipy.stats import chi2

from imaging.blurred.arrangement import near_vertices
from imaging.sensor import Levels, squared_errors
from measure.estimators.arrangement import ArrangementEstimator, _chi_square
from measure.estimators.ellipse import _Linear, _with_axes, free_parameters
from measure.estimators.expansion import ROWS, Pieces, _gram, _vertex_steps
from measure.estimators.registry import estimator
from measure.features.arranged import _seen
from measure.features.blurred_ellipse import from_symmetric, to_symmetric
from measure.features.layout import polygon_layout
from measure.features.optics import Optics
from scenes import Noise
from tests.oracle import polygon_image

SHAPE, BLUR = (44, 50), 0.7
CORNERS = np.array([[10.3, 9.6], [38.1, 12.2], [35.7, 33.4], [8.2, 30.9]])


@pytest.fixture(scope="module")
def tool():
    return estimator(polygon_layout(CORNERS, Optics(SHAPE, BLUR, 4.0, 1.0, 3.0)), "arrangement")


@pytest.fixture(scope="module")
def used(tool):
    """An image whose corners are elsewhere by a tenth of a pixel."""
    moved = CORNERS + [[0.1, -0.05], [-0.08, 0.1], [0.06, 0.1], [-0.1, 0.02]]
    image = polygon_image(moved, SHAPE, BLUR, 100.0, 20.0)
    return tool.taken(image[None])[0]


@pytest.fixture(scope="module")
def fit(tool, used):
    return tool.climb(used, tool.start(used))


def test_squares_of_the_expansion(tool, fit, used, rng):
    """Chi-squares near the pieces and far from them, as residuals of the columns that the steps multiply."""
    expansion = tool.centre(fit).expansion
    images = used[expansion.order] + 2 * rng.standard_normal((3, used.size))
    solved = expansion.solve(expansion.see(images.copy()))
    away, near = (images - expansion.expected) * expansion.root, expansion.near
    count = expansion.linear.shape[1]
    explained = solved.steps[:, -count:] @ expansion.linear.T
    coefficients = expansion.pieces.coefficients(expansion.pieces.displaced(solved.steps))
    for n, (pixels, rows) in enumerate(zip(expansion.pieces.pixels, expansion.rows, strict=True)):
        explained[:, pixels] += coefficients[:, n] @ rows.T
    squares = (away - explained) ** 2
    assert solved.squares[:, 0] == pytest.approx(squares[:, :near].sum(1), rel=1e-9)
    assert solved.squares[:, 1] == pytest.approx(squares[:, near:].sum(1), rel=1e-9)
    assert 0 < near < used.size


def test_second_derivative(tool):
    """Away from the maximum it is not the information alone: central differences of the score."""
    turned = CORNERS + 0.5 * np.array([[1, -1], [1, 1], [-1, 1], [-1, -1]])
    used = tool.taken(polygon_image(turned, SHAPE, BLUR, 100.0, 20.0)[None])[0]
    point = tool._point(used, tool.start(used), tool.before(used))
    matrix = tool._newton(point)
    first = 2 * tool.model.free.size
    numeric = []
    for step in 1e-4 * np.eye(tool.model.count)[:first]:
        scores = [tool._point(used, tool.model.moved(point.state, s * step), point.before).score for s in (1, -1)]
        numeric.append((scores[1] - scores[0]) / 2e-4)
    numeric, size = np.array(numeric)[:, :first], np.abs(point.fisher[:first, :first]).max()
    assert matrix[:first, :first] == pytest.approx(numeric, abs=1e-4 * size)
    assert np.abs(point.fisher[:first, :first] - numeric).max() > 1e-2 * size


def test_drawn_images_tell_as_much_as_the_columns_say(tool, fit, rng):
    """Columns that tell of one combination alone: linear answers along it, of its size, each draw with its opposite."""
    expansion = tool.centre(fit).expansion
    along = rng.normal(size=len(expansion.gram))
    thin = replace(expansion, gram=0.04 * np.outer(along, along))
    linear = thin.drawn(400).linear
    ahead, behind = (expansion._columns(sign * 1e-4 * np.eye(len(expansion.inverse))) @ along for sign in (1, -1))
    slopes = (ahead - behind) / 2e-4
    answer = 0.2 * slopes @ expansion.inverse
    draws = linear @ answer / (answer @ answer)
    # margin: columns in single precision
    assert linear == pytest.approx(draws[:, None] * answer, abs=1e-6 * np.abs(answer).max())
    assert draws[:200] == pytest.approx(-draws[200:])
    assert np.square(draws).mean() == pytest.approx(1, abs=0.4)  # margin: chance of 200: 4 sqrt(2 / 200)


@pytest.mark.parametrize(("before", "after"), [(0.0, 0.0), (5e-4, 0.0), (1e-3, 0.0), (0.2, 0.02)])
def test_damping_fades_where_steps_succeed(before, after):
    """Of the parabola (x - 1)^2; a step is damped so much that 1 + damping times it ends at 1."""
    made = SimpleNamespace(
        _point=lambda used, state, mean: SimpleNamespace(state=state, cost=float((state[0] - 1) ** 2)),
        _cost=lambda used, point, weight: point.cost,
        _held_back=lambda step: step,
        model=SimpleNamespace(moved=lambda state, step: state + step),
    )
    point = SimpleNamespace(state=np.zeros(1), cost=1.0, score=np.ones(1), before=None, weight=None)
    there, settled, damping = ArrangementEstimator._step(made, None, point, np.eye(1), before)
    assert there.state == pytest.approx(1 / (1 + before))
    assert damping == pytest.approx(after)
    assert not settled


def test_steps_end_where_the_score_does(tool):
    """And not where the cost is least, whose weights change with the levels: that is biased by the noise's slope."""
    noisy = replace(tool, noise=Noise(sigma=0.5, gain=3.0))
    used = noisy.taken(polygon_image(CORNERS, SHAPE, BLUR, 100.0, 20.0)[None])[0]
    used = np.abs(used * (1 + 0.2 * np.random.default_rng(3).standard_normal(used.size)))
    fit = noisy.climb(used, noisy.start(used))
    score = fit.point.score
    assert fit.settled
    assert float(score @ np.linalg.solve(fit.point.fisher, score)) < 1e-4


def test_a_step_that_leads_nowhere_is_damped_or_given_up():
    costs = iter([4.0, 3.0, 2.0, 0.5])
    made = SimpleNamespace(
        _point=lambda used, state, mean: SimpleNamespace(state=state, cost=next(costs)),
        _cost=lambda used, point, weight: point.cost,
        _held_back=lambda step: step,
        model=SimpleNamespace(moved=lambda state, step: state + step),
    )
    point = SimpleNamespace(state=np.zeros(1), cost=1.0, score=np.ones(1), before=None, weight=None)
    there, settled, damping = ArrangementEstimator._step(made, None, point, np.eye(1), 0.0)
    assert there.state == pytest.approx(1 / (1 + 0.1))  # undamped, then by 0.001, 0.01 and 0.1
    assert (settled, damping) == (False, pytest.approx(0.01))
    tiny = SimpleNamespace(state=np.zeros(1), cost=1.0, score=np.full(1, 0.9e-3), before=None, weight=None)
    costs = iter([4.0])
    assert ArrangementEstimator._step(made, None, tiny, np.eye(1), 0.0) == (tiny, True, 0.0)


@pytest.mark.parametrize("gain", [1.0, 0.5])
def test_squares_where_the_scale_ends(gain):
    """There the signal is what the model says without the end of the scale; elsewhere what is recorded."""
    noise, signal = Noise(sigma=2.0, bits=8, dark_level=3.0), np.array([252.5, 254.0])
    point = SimpleNamespace(
        expected=np.array([250.0, 252.0]), weight=np.array([0.3, 0.4]), gain=np.array([1.0, gain]), state="there"
    )
    model = SimpleNamespace(evaluate=lambda state, derivatives: (signal, None))
    found = ArrangementEstimator._squares(SimpleNamespace(model=model, noise=noise), point)
    level = signal + 3.0 if gain < 1 else point.expected
    expected = squared_errors(noise, level, Levels(point.expected, 1 / point.weight))
    assert np.array(found) == pytest.approx(np.array(expected))


@pytest.mark.parametrize(("is_lit", "free"), [(True, [0, 1, 2, 7]), (False, [0, 1, 2])])
def test_images_are_not_asked_what_is_known(is_lit, free):
    """Where the light is known, or no vertex but those of the required edges is free, all images are one group."""
    known = SimpleNamespace(
        is_lit=is_lit,
        model=SimpleNamespace(free=np.array(free)),
        arrangement=SimpleNamespace(required=np.array([[0, 1], [1, 2]])),
    )
    images = np.zeros((4, 3, 3))
    ((which, some, tool),) = _seen(images, None, known)
    assert which.tolist() == [0, 1, 2, 3]
    assert some is images
    assert tool is known


def test_chi_square_has_the_moments_asked_for():
    """Mean and variance of scale times a chi-square of so many degrees of freedom, fitted parameters taken away."""
    freedom, scale = _chi_square(50.0, 120.0, 4.0)
    assert freedom * scale == pytest.approx(46.0)
    assert 2 * freedom * scale**2 == pytest.approx(112.0)
    assert _chi_square(3.0, 120.0, 4.0) == (0.0, 1.0)
    assert _chi_square(50.0, 8.0, 4.0) == (0.0, 1.0)


def test_a_circle_has_three_parameters(rng):
    """Centre and radius move the ellipse as they say; its covariance is that of (x, y, r, r)."""
    start, step = np.array([14.0, 11.0, 6.0, 6.0, 0.0]), np.array([0.3, -0.2, 0.5])
    moved = from_symmetric(to_symmetric(start) + free_parameters(True) @ step)[0]
    assert moved[:4] == pytest.approx(start[:4] + [0.3, -0.2, 0.5, 0.5])
    assert (free_parameters(False) == np.eye(5)).all()
    root = rng.normal(size=(3, 3))
    whole = free_parameters(True) @ root @ root.T @ free_parameters(True).T
    parameters, covariance = _with_axes(to_symmetric(start), whole, True)
    pick = [0, 1, 2, 2]
    assert parameters == pytest.approx([14, 11, 6, 6, 0])
    assert covariance[:4, :4] == pytest.approx((root @ root.T)[np.ix_(pick, pick)])
    assert not covariance[4].any()


def test_gradient_by_the_displacements(tool, fit, rng):
    """Of the rows times their coefficients, by the parameters: central differences, at steps that bend the image."""
    pieces = Pieces.of(tool.model, fit.state)
    rows = rng.standard_normal((1, len(pieces.rows), ROWS))
    steps = 0.1 * rng.standard_normal((1, tool.model.count))

    def value(steps):
        return float((pieces.coefficients(pieces.displaced(steps)) * rows).sum())

    found = pieces.gradient(pieces.displaced(steps), rows)[0]
    for i in range(tool.model.count):
        step = 1e-5 * (np.arange(tool.model.count) == i)
        numeric = (value(steps + step) - value(steps - step)) / 2e-5
        assert found[i] == pytest.approx(numeric, rel=1e-6, abs=1e-5)


@pytest.mark.parametrize("noise", [None, Noise(sigma=1.0, gain=0.5)])
def test_what_noise_leaves_of_an_ellipse(noise):
    """The residual's chi-square over 1.1, with a freedom of pixels less parameters, at a chance of 1e-6."""
    pixels, parameters, level = 30, 8, 40.0
    variance = 4.0 if noise is None else 1.0 + 0.5 * level
    optics = Optics(SHAPE, BLUR, 4.0, 1.0, 3.0, noise)
    most = 1.1 * chi2.isf(1e-6, pixels - parameters) * variance
    for share, fits in ((0.999, True), (1.001, False)):
        residual = np.full(pixels, np.sqrt(share * most / pixels))
        made = _Linear(np.arange(pixels), np.zeros((pixels, parameters)), np.eye(parameters), None, residual)
        assert made.fits(optics, np.full(SHAPE, level)) is fits


def test_the_expansion_is_the_model(tool, fit, rng):
    """A step of 0.02 px, 0.1 % of the levels and 0.01 % of the blur: the image to 6e-5 of its change."""
    model, state = tool.model, fit.state
    pieces, free = Pieces.of(model, state), 2 * model.free.size
    step = np.concatenate([0.02 * rng.standard_normal(free), 1e-3 * state.levels, [1e-4 * state.blur]])
    image, jacobian = model.evaluate(state, True)
    change = model.evaluate(model.moved(state, step), False)[0] - image
    found = jacobian[:, free:] @ step[free:]
    coefficients = pieces.coefficients(pieces.displaced(step[None]))[0]
    for pixels, rows, part in zip(pieces.pixels, pieces.rows, coefficients, strict=True):
        found[pixels] += part @ rows
    first = jacobian @ step
    assert np.abs(found - change).max() < 5e-4 * np.abs(change).max()
    # margin: ten times what the second order leaves
    assert np.abs(first - change).max() > 5e-3 * np.abs(change).max()  # negative control: the first order alone


@pytest.mark.parametrize("seed", [1, 2])
def test_the_expansion_of_edges_goes_beyond_the_second_order(tool, fit, seed):
    """Vertices a quarter of a pixel away: to 0.1 % of the change, 6 px and more from corners, where edges meet."""
    model, state = tool.model, fit.state
    pieces, free = Pieces.of(model, state), 2 * model.free.size
    way = np.zeros(model.count)
    way[:free] = np.random.default_rng(seed).uniform(-0.25, 0.25, free)
    amid = cdist(model.points, state.vertices).min(1) > 6
    change = model.evaluate(model.moved(state, way), False)[0] - model.evaluate(state, False)[0]
    found = np.zeros_like(change)
    coefficients = pieces.coefficients(pieces.displaced(way[None]))[0]
    for pixels, rows, part in zip(pieces.pixels, pieces.rows, coefficients, strict=True):
        found[pixels] += part @ rows
    missed = np.abs(found - change)[amid].max() / np.abs(change[amid]).max()
    assert missed < 1e-3  # margin: 5e-4 and 8e-4, arithmetic alone; a power wrong in the third order misses 0.2 %


def test_only_free_vertices_move_pieces():
    """The displacement of a piece's first end, and what the other's is more; vertices that are not free stay."""
    pieces = np.array([[0, 1], [1, 3], [3, 0], [2, 3]])
    model = SimpleNamespace(
        free=np.array([1, 3]), count=6, arrangement=SimpleNamespace(vertices=np.zeros((4, 2)), pieces=pieces)
    )
    steps, moving = np.array([0.3, -0.2, 0.7, 0.5, 9.0, 9.0]), np.array([0, 1, 3, 2])
    places = np.zeros((4, 2))
    places[[1, 3]] = steps[:4].reshape(2, 2)
    found = _vertex_steps(model, moving) @ steps
    assert found[:, 0] == pytest.approx(places[pieces[moving, 0]])
    assert found[:, 1] == pytest.approx(places[pieces[moving, 1]] - places[pieces[moving, 0]])


def test_products_of_columns_are_those_of_the_whole_matrix(rng):
    """Columns everywhere, and of three pieces at pixels of their own: two share some, the third none."""
    linear = rng.normal(size=(40, 3))
    pixels = np.arange(2, 20), np.arange(15, 31), np.array([35, 33, 38])
    rows = tuple(rng.normal(size=(each.size, ROWS)) for each in pixels)
    whole = np.zeros((40, 3 + 3 * ROWS))
    whole[:, :3] = linear
    for n, (here, own) in enumerate(zip(pixels, rows, strict=True)):
        whole[here, 3 + n * ROWS : 3 + (n + 1) * ROWS] = own
    assert _gram(linear, pixels, rows) == pytest.approx(whole.T @ whole, abs=1e-12)


def test_pieces_near_a_required_edge_are_those_between_their_own_ends():
    """Within 2 px of (0, 0) to (10, 0): itself and what crosses it, not what only would if it went on."""
    crossing, before, beside = ((5, -9), (5, 9)), ((5, 3), (5, 20)), ((30, 0), (13, 0))
    vertices = np.array([(0, 0), (10, 0), *crossing, *before, *beside], float)
    pieces = np.arange(8).reshape(-1, 2)
    made = SimpleNamespace(vertices=vertices, pieces=pieces, required=np.array([[0, 1], [-1, -1]]))
    assert near_vertices(made, 2.0).tolist() == [0, 1, 2, 3]
    assert near_vertices(made, 3.01).tolist() == list(range(8))
