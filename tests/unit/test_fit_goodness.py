"""What a fit leaves, and what it tells: each against the same written out, on small arrays of unequal numbers."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from measure.fitting.goodness import Part, p_value, parts
from measure.fitting.information import are_alone, are_told, covariance_of


@pytest.mark.parametrize("freedom", [np.inf, 37.0])
def test_the_least_likely_part_tells_for_all_of_them(freedom):
    """Two-sided F-tests, with Sidak's correction; parts of less than half a degree of freedom do not count."""
    some = [Part(61.0, 40.0), Part(2.1, 9.5), Part(0.9, 0.5), Part(99.0, 0.49)]
    known = 1e9 if np.isinf(freedom) else freedom
    each = []
    for squares, own in some[:3]:
        ratio = stats.f(own, known)
        each.append(2 * min(ratio.cdf(squares / own), ratio.sf(squares / own)))
    assert p_value(some, freedom) == pytest.approx(1 - (1 - min(each)) ** 3, rel=1e-6)
    # margin: an inequality: one part is unlikely
    assert min(each) < 0.05
    # margin: a p-value is at most 1, by its kind
    assert p_value([Part(9.34, 10.0)], np.inf) <= 1
    assert p_value([Part(1e4, 10.0)], np.inf) == pytest.approx(0, abs=1e-12)
    assert np.isnan(p_value(some[3:], freedom))


def test_parts_of_residuals_are_edges_blocks_and_directions(rng):
    """Two rectangles of 9 x 13 px: pixels and blocks one by one, directions by their projection."""
    shape, count, size = (2, 9, 13), 3, 2 * 9 * 13
    model = np.where(np.arange(size) % 50 == 7, -3.0, 40 + 1.2 * rng.normal(size=size))
    white, level = rng.normal(size=size), 2.5 * model
    jacobian, beside = rng.normal(size=(size, count)), rng.normal(size=(size, 2))
    beside = np.concatenate([beside, jacobian[:, :1] + beside[:, :1]], 1)  # the third adds nothing
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    pixels = (SimpleNamespace(x=np.zeros(size), shape=shape),)
    found = parts(white, model, level, pixels, jacobian, covariance, (beside,))

    image, at_edge = model.reshape(shape), np.zeros(shape, bool)
    for t, y, x in np.ndindex(*shape):
        near = [(y + 1, x), (y - 1, x), (y, x + 1), (y, x - 1)]
        at_edge[t, y, x] = any(
            abs(image[t, y, x] - image[t, b, a]) > 2 for b, a in near if 0 <= b < shape[1] and 0 <= a < shape[2]
        )
    part, hat = at_edge.ravel(), jacobian @ covariance @ jacobian.T
    assert 0 < part.sum() < size
    blocks = []
    for t, y, x in np.ndindex(2, 2, 3):
        inside = np.zeros(shape, bool)
        inside[t, 4 * y : 4 * y + 4, 4 * x : 4 * x + 4] = True
        blocks.append(inside.ravel() / 4)
    blocks = np.array(blocks)
    curved = np.where(model > 0, model * np.log(np.where(model > 0, model, 1.0) / model.max()), 0.0)
    wanted = [
        (white[part] @ white[part], part.sum() - np.trace(hat[np.ix_(part, part)])),
        (((blocks @ white) ** 2).sum(), 12 - np.trace(blocks @ hat @ blocks.T)),
        (projected(curved[:, None], jacobian, white), 1),
        (projected(beside[:, :2], jacobian, white), 2),
    ]
    assert np.array(found) == pytest.approx(np.array(wanted), rel=1e-9)


def projected(along, jacobian, white):
    """Squares of a residual along directions, what the parameters have of them left out."""
    across = along - jacobian @ np.linalg.lstsq(jacobian, along)[0]
    return ((across @ np.linalg.lstsq(across, white)[0]) ** 2).sum()


def test_a_covariance_is_the_inverse_of_the_information_and_large_where_there_is_none(rng):
    """Of columns of any size; two alike count as known to 1e-10 of the best, one of zeros as not at all."""
    white = rng.normal(size=(20, 3)) * [1.0, 1e6, 1e-5]
    assert covariance_of(white) == pytest.approx(np.linalg.inv(white.T @ white), rel=1e-6)
    alike = np.ones((4, 2)) / 2
    assert covariance_of(alike) == pytest.approx(np.array([[1, -1], [-1, 1]]) / 4e-10 + 0.25, rel=1e-6)
    assert covariance_of(np.array([[2.0, 0.0], [1.0, 0.0]])).tolist() == [[1.0, 0.0], [0.0, np.inf]]


@pytest.mark.parametrize(
    ("known", "told"),
    [((0.51, 0.26, 9), (1, 1, 1)), ((0.49, 0.26, 9), (0, 1, 1)), ((0.49, 0.24, 9), (0, 0, 1)), ((1, 1, 1), (1, 1, 1))],
)
def test_what_is_less_sure_than_a_linear_model_bears_is_held(known, told):
    """Standard errors of 0.5, 0.25 and 1."""
    free = SimpleNamespace(free=[None, *(SimpleNamespace(known=each) for each in known)])
    assert are_told(free, np.array([1, 2, 3]), np.diag([2.0, 4.0, 1.0])).tolist() == list(map(bool, told))


def test_of_two_that_are_told_together_alone_the_worse_is_held():
    """Both are too unsure; without one of them the other is as sure as can be."""
    free = SimpleNamespace(free=[SimpleNamespace(known=1.0), SimpleNamespace(known=2.0)])
    white = np.array([[1.0, 1.0], [1.0, 1.0], [0.0, 0.1], [1.5, 1.5]])
    assert are_told(free, np.arange(2), white).tolist() == [False, True]
    assert are_told(free, np.arange(2), white[:, ::-1]).tolist() == [False, True]


def test_what_moves_with_something_held_by_less_than_0_3_standard_errors_is_alone():
    """Standard errors 1 and 0.5 of the free ones; two are held, that may be 2 and 10 off."""
    free = [SimpleNamespace(known=known) for known in (7.0, 2.0, 7.0, 10.0)]
    white, variance = np.diag([1.0, 2.0]), np.array([4.0, 9.0])

    def alone(first, second):
        def jacobian(at, noise, held):
            assert held.tolist() == [1, 3]
            return np.array([first, second]) * np.sqrt(variance)[:, None]

        problem = SimpleNamespace(parameters=SimpleNamespace(free=free), jacobian=jacobian)
        return are_alone(problem, np.zeros(4), None, np.array([0, 2]), white, variance).tolist()

    assert alone([0.149, -0.0299], [0.149, 0.0299]) == [True, True]
    assert alone([0.151, 0.0], [0.149, 0.0]) == [False, True]
    assert alone([0.0, 0.0], [0.0, -0.0301]) == [True, False]
