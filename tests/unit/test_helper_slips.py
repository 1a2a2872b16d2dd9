"""Slips of one word in the helpers of users' tests and in correlations."""

from types import SimpleNamespace

import numpy as np
import pytest

from render.testing import assert_measures
from validation.statistics import correlation


def test_one_image_of_many_that_could_not_be_measured_fails_a_users_test():
    found = SimpleNamespace(
        value_px=np.array([10.0, np.nan, 10.0]), variance_px2=np.full(3, 0.01), status=np.array(["ok", "short", "ok"])
    )
    with pytest.raises(AssertionError, match="must be measured, got status"):
        assert_measures(found, 10.0)


def test_equal_columns_correlate_and_a_constant_one_does_not():
    rows = [1.0, 2.0, 4.0]
    assert correlation(rows, rows)["pearson"] == pytest.approx(1)
    assert correlation(rows, [3.0, 3.0, 3.0]) is None
    assert correlation([3.0, 3.0, 3.0], rows) is None
    assert correlation(rows, [1.0, np.nan, 2.0]) is None
