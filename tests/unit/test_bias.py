"""The closed form of a classic locator's bias: its parts against brute force and central differences."""

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.optimize import brentq

import planner
import scenes
from imaging.blurred.segment import Segments, second_and_third
from imaging.features.sampling import sampled_line
from imaging.models import bias as bias_model
from imaging.models.bias import bias, cluttered
from imaging.pictures import Pictures
from tests.oracle import polygon_image


def segments_of(corners, level, gradient):
    """The triangle's sides, seen from (0, 0) with derivatives along y; its own level is on the left of its normal."""
    ends = np.roll(corners, -1, 0)
    unit = (ends - corners) / np.linalg.norm(ends - corners, axis=1)[:, None]
    normal = np.stack([-unit[:, 1], unit[:, 0]], 1)
    apart, start, stop = (corners * normal).sum(1), (corners * unit).sum(1), (ends * unit).sum(1)
    return Segments(
        start, stop, apart, normal[:, 1], unit[:, 1],
        level + apart * (normal @ gradient), unit @ gradient, np.full(3, gradient[1]),
    )  # fmt: skip


@pytest.mark.parametrize("moved", [-0.4, 0.0, 0.7])
def test_blurred_segments_add_up_to_a_blurred_triangle(moved):
    """A triangle of linear level, 50 + 3 x - 7 y: its second and third derivative by quadrature over its area."""
    corners, width, level, gradient = (
        np.array([[-1.0, -0.5], [2.0, -1.0], [1.0, 2.5]]),
        1.2,
        50.0,
        np.array([3.0, -7.0]),
    )

    def integral(order):
        def blurred(y, x):
            u = (moved - y) / width
            hermite = {2: u**2 - 1, 3: 3 * u - u**3}[order] / width**order
            gauss = np.exp(-(x**2) / (2 * width**2) - u**2 / 2) / (2 * np.pi * width**2)
            return (level + gradient @ [x, y]) * gauss * hermite

        def side(a, b):
            return lambda x: (
                corners[a, 1] + (corners[b, 1] - corners[a, 1]) * (x - corners[a, 0]) / (corners[b, 0] - corners[a, 0])
            )

        left = dblquad(blurred, -1, 1, side(0, 1), side(0, 2), epsabs=1e-11)[0]
        return left + dblquad(blurred, 1, 2, side(0, 1), side(2, 1), epsabs=1e-11)[0]

    second, third = second_and_third(segments_of(corners, level, gradient), np.full(3, moved), np.full(3, width))
    assert second.sum() == pytest.approx(integral(2), abs=1e-8)
    assert third.sum() == pytest.approx(integral(3), abs=1e-8)


def test_third_derivative_is_the_second_one_s(rng):
    parts = Segments(*rng.normal(size=(8, 40)))
    parts = parts._replace(across=np.cos(parts.across), along=np.sin(parts.across))
    h = 1e-5
    ahead, back = (second_and_third(parts, np.full(40, 0.3 + step), np.full(40, 1.2))[0] for step in (h, -h))
    third = second_and_third(parts, np.full(40, 0.3), np.full(40, 1.2))[1]
    assert (ahead - back) / (2 * h) == pytest.approx(third, rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("phase", [0.0, 0.125, 0.3, 0.8])
@pytest.mark.parametrize(("scale", "second_order"), [(1.0, 5e-4), (1.2, 6e-5), (0.8, 1e-2)])
def test_sampling_moves_an_edge_along_a_column(phase, scale, second_order):
    """The crossing of the sum over pixels of an exactly averaged step, found by bisection: at a scale of 1 px 0.0075 px
    sin(phase).

    1e-4 px: its second order, which grows and falls with its square.
    """
    image = polygon_image(np.array([[20.0 + phase, -30], [90, -30], [90, 90], [20.0 + phase, 90]]), (1, 41), 0.6)[0]

    def second(x):
        away = np.arange(41) - x
        return image @ ((away**2 - scale**2) * np.exp(-(away**2) / scale**2 / 2))

    shift = brentq(second, 19.6 + phase, 20.4 + phase) - 20 - phase
    middle = np.array([20 + phase, 3.7])
    down, slope = sampled_line(middle, np.array([0.0, 1.0]), np.array(30.0), 0.6, scale)  # its normal points to -x
    assert -down == pytest.approx(shift, abs=second_order)
    assert slope == pytest.approx(0.0, abs=1e-12)


def test_pictures_together_as_one_by_one(task1, rng):
    sensors = np.stack([rng.uniform(10, 70, 5), rng.uniform(0, 360, 5)], -1)
    lights = np.stack([rng.uniform(10, 70, 3), rng.uniform(0, 360, 3)], -1)
    together = Pictures.of(task1, sensors[:, None], lights)
    found, marked = bias(together), cluttered(together)
    assert found.value.shape == (5, 3)
    assert found.lines.shape == (5, 3, 4, 2)
    assert found.corners.shape == (5, 3, 2, 2)
    for i in range(5):
        for j in range(3):
            alone = planner.predict(task1, sensors[i], lights[j])
            assert alone.bias_px == pytest.approx(found.value[i, j], rel=1e-9, abs=1e-12, nan_ok=True)
            reported = [edge.status == "clutter" for edge in alone.edges]
            assert all(marked[i, j][k] for k in np.flatnonzero(reported))


def test_the_bound_has_no_bias(task1):
    narrow = (9.0, 23.6), (52.3, 54.2)  # a lit face thinner than 2 px beside a required edge
    assert planner.predict(task1, *narrow).status == "clutter"
    assert planner.predict(task1, *narrow, "bound").bias_px == 0.0
    assert planner.predict(task1, *narrow, "bound").status == "ok"


def test_circles_count_as_unbiased():
    """What is left is what the corner's two lines add along the distance."""
    found = planner.predict(scenes.load("plate"), (35, 40), (20, 80))
    start, end = found.corners
    pull = (end - start) / np.linalg.norm(end - start)
    shift = bias(Pictures.of(scenes.load("plate"), (35, 40), (20, 80))).corners
    assert np.isnan(shift[0]).all()
    assert found.bias_px == pytest.approx(shift[1] @ pull, rel=1e-9)


def test_nothing_surrounds_a_plain_edge(task1):
    """Far light and sensor, no neighbour near: what is left is the shading, some 1e-3 px."""
    found = planner.predict(task1, (30, 135), (15, 315))
    assert found.status == "ok"
    assert 1e-4 < abs(found.bias_px) < 2e-3  # margin: small, but not nothing
    assert all(0 < abs(end) < 3e-3 for edge in found.edges for end in edge.bias_px)  # margin: small, but not nothing


@pytest.mark.parametrize(
    ("lent", "direct", "rough"),
    [
        ([[0, 0, 0], [0, 0, 0]], [[10, 10, 10], [110, 110, 110]], False),
        ([[0, 0, 0], [0, 8, 0]], [[10, 10, 10], [110, 110, 110]], False),
        ([[0, 0, 0], [0, 12, 0]], [[10, 10, 10], [110, 110, 110]], True),
        ([[12, 0, 0], [0, 0, 0]], [[10, 22, 22], [110, 110, 110]], True),
        ([[20, 20, 20], [0, 0, 0]], [[15, 15, 15], [110, 110, 110]], True),
        ([[20, 20, 20], [0, 0, 0]], [[25, 25, 25], [110, 110, 110]], False),
        ([[3, 3, 3], [0, 0, 0]], [[1, 1, 1], [110, 110, 110]], False),
        ([[0, 0, 0], [90, 90, 90]], [[1, 1, 1], [80, 80, 80]], True),
    ],
    ids=["none", "a little", "changing", "one end", "most of a side", "less", "what is not felt", "the other side"],
)
def test_light_from_other_faces_is_too_rough_where_it_prevails_or_changes(lent, direct, rough, task1, monkeypatch):
    """More than half of a side's and felt by the contrast, or more than a tenth of the contrast along the edge."""
    lent, direct = (np.array([[each]], float) for each in (lent, direct))
    given = iter((lent + direct, direct))
    monkeypatch.setattr(bias_model, "side_signals", lambda *_: next(given))
    pictures = Pictures.of(task1, (30, 90), (15, 270))
    assert bias_model._by_other_faces(pictures, ("e1",)).tolist() == [[rough]]
