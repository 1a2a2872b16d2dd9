"""How noisy values are by the renderer, told by two renders' pixels, against the scatter of many."""

import numpy as np
import pytest
from scipy import sparse
from scipy.ndimage import gaussian_filter

from measure.render_noise import by_pixels

SIZE, PAIRS = (48, 64), 400


@pytest.fixture
def responses(rng):
    """Of three values: of one straight edge down the image, of another, and of their difference."""
    rows = np.zeros((3, *SIZE))
    x = np.arange(SIZE[1])
    rows[0] = (x - 20) * np.exp(-((x - 20) ** 2) / 4)
    rows[1, 10:40] = np.exp(-((x - 44) ** 2) / 6)
    rows[2] = rows[0] - rows[1]
    return sparse.csr_array(rows.reshape(3, -1))


@pytest.fixture(scope="module")
def renders():
    """Random pixels, noisier in one part of the image, as a lens blurs them."""
    noise = np.random.default_rng(8).normal(size=(2 * PAIRS, *SIZE)) * np.where(np.arange(SIZE[1]) < 32, 1.0, 3.0)
    return 100 + np.stack([gaussian_filter(each, 0.8) for each in noise])


def told(renders, responses):
    """Root mean square over pairs, and the scatter of all the values, (3,)."""
    values = renders.reshape(len(renders), -1) @ responses.T.toarray()
    pairs = np.stack([by_pixels(renders[i : i + 2], responses, 0.8) for i in range(0, len(renders), 2)])
    return np.sqrt((pairs**2).mean(0)), values.std(0, ddof=1), pairs


@pytest.mark.parametrize(("factor", "agrees"), [(1.0, True), (0.5, False), (1.3, False)])
def test_pairs_tell_what_many_renders_scatter_by(renders, responses, factor, agrees):
    """Within 8 %: 800 values tell it to 2.5 %, and parts farther apart than neighbours have a little in common."""
    found, scatter, _ = told(renders, responses)
    assert (np.abs(factor * found / scatter - 1) < 0.08).all() == agrees


def test_one_pair_tells_it_well(renders, responses):
    """Two values alone tell their scatter with a standard deviation of 0.60 of it."""
    _, scatter, pairs = told(renders, responses)
    values = renders.reshape(len(renders), -1) @ responses.T.toarray()
    alone = np.abs(values[::2] - values[1::2]) / np.sqrt(2)
    assert (pairs.std(0) / scatter < 0.5).all()  # margin: 0.36 to 0.43 of so small images
    assert (alone.std(0) / scatter > 0.55).all()


def test_values_of_no_pixel_and_equal_renders_have_no_noise(renders):
    none = sparse.csr_array((2, SIZE[0] * SIZE[1]))
    assert by_pixels(renders[:3], none, 0.8).tolist() == [0.0, 0.0]
    assert by_pixels(np.stack([renders[0]] * 2), sparse.csr_array(np.ones((1, renders[0].size))), 0.8).tolist() == [0.0]
