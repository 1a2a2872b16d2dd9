"""For how many independent values the correlated ones of a setting count."""

import numpy as np
import pytest

from validation.batch.measurands import independent


def test_correlated_values_count_for_fewer():
    """Two that are one count as one half each, opposite ones too; two of correlation 0.6 as 1 / (1 + 0.36)."""
    one = np.array([1.0, -1, 1, -1, 0, 0])
    other = np.array([1.0, 1, -1, -1, 0, 0])  # not correlated with it
    assert independent([one, other]) == pytest.approx(1)
    assert independent([one, one]) == independent([one, -2 * one]) == pytest.approx(1 / 2)
    assert independent([one, 0.6 * one + 0.8 * other]) == pytest.approx(1 / 1.36)
    assert independent([one, one, other]) == pytest.approx(3 / 5)


def test_lost_values_and_lone_ones_do_not_count():
    one, other = np.array([1.0, -1, 1, -1, np.nan]), np.array([1.0, 1, -1, -1, 50.0])
    assert independent([one, other]) == pytest.approx(1)
    assert independent([one]) == 1
    assert independent([one, np.zeros(5)]) == 1
    assert independent([one[:2], -one[:2]]) == 1
