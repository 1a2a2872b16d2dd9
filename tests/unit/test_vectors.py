"""Many vectors at once: a component at a time, and chosen by their numbers."""

import numpy as np

from scenes.materials.vectors import chosen, length, product


def test_products_and_lengths_are_those_of_numpy(rng):
    one, other = rng.normal(size=(7, 1, 3)), rng.normal(size=(5, 3))
    assert np.allclose(product(one, other), np.einsum("...i,...i->...", one, other), rtol=1e-14, atol=1e-15)
    assert np.allclose(length(one), np.linalg.norm(one, axis=-1), rtol=1e-15)


def test_those_are_chosen_that_a_mask_picks(rng):
    vectors, which = rng.normal(size=(4, 6, 3)), rng.uniform(size=(4, 6)) < 0.5
    assert np.array_equal(chosen(vectors, which), vectors[which])
    spread = np.broadcast_to(vectors[:1], vectors.shape)
    assert np.array_equal(chosen(spread, which), spread[which])
    assert chosen(vectors, np.zeros((4, 6), bool)).shape == (0, 3)
