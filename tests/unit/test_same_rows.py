"""Rows that are the same are told as NumPy tells them along an axis."""

import numpy as np
import pytest

from scenes.parts.rows import different


@pytest.mark.parametrize("dtype", [int, float])
@pytest.mark.parametrize("count", [0, 1, 3000])
def test_rows_are_those_that_numpy_tells(dtype, count):
    """Of 3000 rows of three numbers most occur several times; of 0 and of -0, too, which are the same."""
    rows = np.random.default_rng(1).integers(-4, 5, (count, 3)).astype(dtype)
    rows = np.where(rows == 0, -rows * np.array([1, -1, 1], dtype), rows)
    found, which = different(rows)
    expected, number = np.unique(rows, axis=0, return_inverse=True)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(which, number.ravel())
    assert (count < 2) == (len(found) == count)
    np.testing.assert_array_equal(found[which], rows)
