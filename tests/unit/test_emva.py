"""A simulated EMVA 1288 bench gives back what went into the sensor: by the standard's formulas, by its package."""

import numpy as np
import pytest

from tests.proofs.emva import SENSOR, agrees, bench, by_formulas, by_package, returned


@pytest.fixture(scope="module")
def benches():
    rng = np.random.default_rng(4)
    return [bench(SENSOR, rng, (96, 96), 16, 8) for _ in range(8)]


def test_the_formulas_give_back_what_went_in(benches):
    assert agrees(returned(by_formulas, benches, SENSOR))


@pytest.mark.parametrize("wrong", [{"gain": 0.33}, {"sigma": 2.2}, {"prnu": 0.0092}, {"dsnu": 1.4}])
def test_other_numbers_are_not_those_that_went_in(benches, wrong):
    """Negative control: each a tenth or so off."""
    assert not agrees(returned(by_formulas, benches, SENSOR.model_copy(update=wrong)))


def test_the_reference_implementation_gives_back_what_went_in(benches):
    pytest.importorskip("emva1288", reason="the package emva1288 (GPL) is not installed")
    found = returned(by_package, benches, SENSOR)
    assert agrees(found)
    for name, row in returned(by_formulas, benches, SENSOR).items():
        assert found[name]["out"] == pytest.approx(row["out"], rel=0.02), name
