"""Nodes along pieces, and what they sum up to at pixels, against closed forms."""

import numpy as np
import pytest
from scipy.special import ndtr

from imaging.blurred.kernels import Kernels, Scatter
from imaging.blurred.quadrature import PieceNodes, rule


@pytest.mark.parametrize("length", [0.3, 1.0, 3.0, 10.0, 30.0, 60.0, 100.0, 400.0, 2000.0])
def test_a_gaussian_anywhere_on_a_piece(length):
    """A blur of 1 px, wherever its middle is; 30 % fewer nodes do not reach it."""
    t, weight = rule(length, 1.0)
    middle = np.random.default_rng(0).uniform(-3, length + 3, 2000)
    found = np.exp(-((length * t - middle[:, None]) ** 2) / 2) @ weight * length / np.sqrt(2 * np.pi)
    # margin: what the rule promises, a closed form's error; 30 % fewer nodes miss it
    assert np.abs(found - (ndtr(length - middle) - ndtr(-middle))).max() < 1.5e-7
    assert t.size < 1.02 * length + 8  # margin: a number of nodes


def test_fewer_nodes_are_too_few():
    t, weight = rule(400.0, 1.4)
    middle = np.linspace(180, 220, 500)
    found = np.exp(-((400.0 * t - middle[:, None]) ** 2) / 2) @ weight * 400.0 / np.sqrt(2 * np.pi)
    assert np.abs(found - 1).max() > 1e-5


def test_nodes_go_piece_after_piece():
    nodes = PieceNodes.on(np.array([3.0, 0.0, 200.0]), 0.8)
    assert (np.diff(nodes.piece) >= 0).all()
    np.testing.assert_allclose(np.bincount(nodes.piece, nodes.weight), 1, rtol=1e-12)


def kernels(blur=0.7):
    place = np.array([[10.2, 7.9], [11.6, 8.3], [30.0, 20.0]])
    return Kernels.around(place, np.full(3, blur), blur)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_kernels_derivatives(axis, order):
    one = kernels()
    step = 1e-4 * np.eye(2)[axis]
    ends = [Kernels.around(one.place + sign * step, one.blur, 0.7) for sign in (-1, 1)]
    values = [(part.y if axis else part.x) if order == 1 else part.derivative(axis, order - 1) for part in ends]
    np.testing.assert_allclose(one.derivative(axis, order), (values[1] - values[0]) / 2e-4, atol=1e-6)


def test_sums_at_pixels_against_a_loop():
    """Of all nodes, of each piece, and of the nodes of one piece alone."""
    rng, one = np.random.default_rng(1), kernels()
    slot = rng.integers(0, 41, (3, 4, 5)).astype(np.int32)
    values, weights = rng.normal(size=slot.shape), rng.normal(size=(3, 2))
    scatter = Scatter(slot, np.array([0, 0, 1]), 2, 40)
    expected = np.zeros((2, 2, 41))
    for node in range(3):
        for place in np.ndindex(4, 5):
            expected[:, scatter.piece[node], slot[node][place]] += values[node][place] * weights[node]
    np.testing.assert_allclose(scatter.by_piece(values, weights), expected[:, :, :-1], atol=1e-12)
    np.testing.assert_allclose(scatter.at_all(values, weights).T, expected.sum(1)[:, :-1], atol=1e-12)
    pixels, local = scatter.of_nodes(slice(0, 2))
    alone = np.zeros((2, 40))
    alone[:, pixels] = local.at_all(values[:2], weights[:2]).T
    np.testing.assert_allclose(alone, expected[:, 0, :-1], atol=1e-12)
    assert one.product().shape == (3, *np.repeat(one.x.shape[1], 2))
