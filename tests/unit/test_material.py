"""Zones under the maximum material requirement: their law, what they grow with, what is decided, and by what."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import scenes
from planner.uncertainty.material import MaterialSize
from planner.uncertainty.zones import ZoneSize
from scenes import InvalidInput
from scenes.measurands.zone import MaximumMaterial
from tests import toleranced
from validation.zones import MeasuredZone

DRAWS = 400_000
SIGMAS = np.array([0.02, 0.03, 0.025])


def law(along: float = 0.0, off=(0.06, -0.03), sigmas=SIGMAS, departure: float = 0.08, factor: float = 2.0):
    """A place of which the departure is correlated with both components, each by half of ``along`` times."""
    count = len(off)
    together = np.eye(count + 1)
    together[-1, :-1] = together[:-1, -1] = along / np.sqrt(count) * np.array([1.0, -1.0])[:count]
    spread = np.asarray(sigmas)[-count - 1 :]
    return MaterialSize(np.array(off), together * np.outer(spread, spread), factor, departure)


def drawn(known: MaterialSize) -> np.ndarray:
    """What is needed less what is given, of draws of the true place and size about what was measured."""
    rng = np.random.default_rng(6)
    mean = np.append(known.off, known.departure)
    draws = rng.multivariate_normal(mean, known.covariance, DRAWS, method="eigh")
    return known.factor * np.sqrt((draws[:, :-1] ** 2).sum(1)) - draws[:, -1]


LAWS = [
    law(), law(0.8), law(-0.8), law(0.99), law(0.9, off=(0.0, 0.0)), law(0.5, off=(0.07,)), law(-0.9, off=(0.0,)),
    law(0.7, sigmas=(1e-6, 0.02, 0.03)), law(0.6, sigmas=(0.02, 0.03, 1e-7)), law(0.0, sigmas=(1e-7, 1e-7, 0.03)),
    law(0.4, departure=-0.1), law(0.9, off=(3.0, 2.0)),
]  # fmt: skip


@pytest.mark.parametrize("known", LAWS)
def test_the_law_is_that_of_draws(known):
    """Probabilities within 5 standard errors, mean and standard deviation, too; quantiles are where they say."""
    found = drawn(known)
    for size in np.quantile(found, [0.003, 0.1, 0.5, 0.9, 0.997]):
        p = known.below(size)
        assert (found <= size).mean() == pytest.approx(p, abs=5 * np.sqrt(p * (1 - p) / DRAWS))  # margin: chance
    assert known.mean == pytest.approx(found.mean(), abs=5 * found.std() / np.sqrt(DRAWS))  # margin: chance
    assert known.u == pytest.approx(found.std(), rel=5 * np.sqrt(1 / DRAWS))  # margin: chance
    for p in (0.025, 0.5, 0.975):
        assert known.below(known.quantile(p)) == pytest.approx(p, abs=1e-6)


@pytest.mark.parametrize("known", [law(0.8), law(-0.8), law(-0.9, off=(0.0,))])
def test_without_the_correlation_or_the_departure_it_is_another_law(known):
    """Ten standard errors and more off: what the first test holds is not held by chance."""
    found, cut = drawn(known), known.covariance.copy()
    cut[-1, :-1] = cut[:-1, -1] = 0.0
    for other in (replace(known, covariance=cut), replace(known, departure=0.0)):
        size = np.quantile(found, 0.95)
        assert abs(other.below(size) - 0.95) > 10 * np.sqrt(0.95 * 0.05 / DRAWS)


@pytest.mark.parametrize("along", [-0.95, 0.0, 0.6])
def test_between_two_lines_by_the_normal_law_of_two(along):
    """factor |v| - b <= s is two straight borders: f v - b <= s and - f v - b <= s (Genz's bivariate normal)."""
    known = law(along, off=(0.04,))
    borders = np.array([[known.factor, -1.0], [-known.factor, -1.0]])
    mean, spread = borders @ [known.off[0], known.departure], borders @ known.covariance @ borders.T
    for size in (-0.02, 0.03, 0.1):
        exact = stats.multivariate_normal(mean, spread, allow_singular=True).cdf([size, size])
        assert known.below(size) == pytest.approx(exact, abs=1e-6)


def test_a_departure_that_is_exactly_known_moves_the_zone():
    known = law()
    spread = known.covariance.copy()
    spread[-1] = spread[:, -1] = 0.0
    plain = ZoneSize(known.off, spread[:2, :2], 2.0)
    exact = replace(known, covariance=spread)
    for size in (0.0, 0.05, 0.1):
        assert exact.below(size) == pytest.approx(plain.below(size + 0.08), abs=1e-12)
    assert (exact.mean, exact.u) == pytest.approx((plain.mean - 0.08, plain.u))


@pytest.mark.parametrize(
    ("departure", "decision"), [(0.0, "fail"), (0.1, "undecided"), (0.3, "pass"), (-0.3, "fail"), (np.nan, "undecided")]
)
def test_decided_by_place_and_size(departure, decision):
    """2 |v| = 0.3 of 0.2 that are allowed at maximum material."""
    known = MaterialSize(np.array([0.15, 0.0]), 0.01**2 * np.eye(3), 2.0, departure)
    assert known.decide(0.2) == decision
    assert known.decide(0.2, status="clutter") == "undecided"


@pytest.mark.parametrize("covariance", [np.eye(2), np.eye(4)])
def test_shapes_are_checked(covariance):
    with pytest.raises(InvalidInput, match="must be of one or two components and of one more, got"):
        MaterialSize(np.zeros(2), covariance)


B, C, D, FRONT, LEFT = {"circle": "c2"}, {"circle": "c6"}, {"circle": "c4"}, {"edge": "e5"}, {"edge": "e4"}
SLOT, MIDDLE = [{"circle": "c8"}, {"circle": "c10"}], {"midpoint": [{"circle": "c8"}, {"circle": "c10"}]}
ROWS = [
    {"name": "bore", "kind": "diameter", "features": [D], "nominal": 8.0, "tolerance": {"plus": 0.1, "minus": 0.05}},
    {"name": "place", "kind": "true_position", "features": [D, B, C], "tolerance": 0.2, "maximum_material": "bore"},
    {"name": "slot", "kind": "slot", "features": SLOT, "tolerance": 0.1},
    {"name": "middle", "kind": "symmetry", "features": [MIDDLE, {"through": [B, C]}], "tolerance": 0.2,
     "maximum_material": "slot.width"},
]  # fmt: skip


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    return toleranced.scene(tmp_path_factory.mktemp("plate"), ("bolts",)).with_(measurands=ROWS)


def test_what_zones_grow_with(plate):
    """The least size of holes; what is decided with it is not decided alone."""
    place, middle = plate.zones
    assert place.material == MaximumMaterial("bore", 7.95, 1.0)
    assert middle.material == MaximumMaterial("slot.width", pytest.approx(5.9, abs=1e-6), 1.0)
    assert (place.numbers, middle.is_joint) == (("place.x", "place.y", "bore"), True)
    assert place.material.departure(8.05) == pytest.approx(0.1)
    assert MaximumMaterial("shaft", 8.1, -1.0).departure(8.05) == pytest.approx(0.05)


def test_a_plan_takes_a_feature_in_the_middle_of_its_limits(plate):
    """Half of the zone's 0.2 and of the 0.075, 0.1 that the middle of the size's limits is from the least; of a zone
    of 0 at maximum material the latter alone."""
    limits = {quantity.name: quantity.tolerance and quantity.tolerance.half for quantity in plate.quantities}
    assert (limits["place.x"], limits["place.y"], limits["middle"]) == pytest.approx((0.1375, 0.1375, 0.15))
    assert (limits["bore"], limits["slot.width"]) == pytest.approx((0.075, 0.1))
    none = plate.with_(measurands=[ROWS[0], ROWS[1] | {"tolerance": 0}])
    assert none.quantities[1].tolerance.half == pytest.approx(0.0375)
    assert none.zones[0].size == 0
    with pytest.raises(InvalidInput, match="tolerance must be greater than 0 above or below, got 0 for both"):
        plate.with_(measurands=[{**ROWS[0], "tolerance": 0}])


def test_a_shaft_has_most_material_where_it_is_largest():
    """The bundled shaft's rims look away from its axis."""
    shaft = scenes.load("shaft")
    rim = next(circle for circle in shaft.solid.circles if not circle.hole)
    other = next(c for c in shaft.solid.circles if c.name != rim.name and abs(c.radius - rim.radius) > 1e-3)
    rows = [
        {"name": "size", "kind": "diameter", "features": [{"circle": rim.name}], "tolerance": 0.1},
        {"name": "run", "kind": "coaxiality", "features": [{"circle": rim.name}, {"circle": other.name}],
         "tolerance": 0.1, "maximum_material": "size"},
    ]  # fmt: skip
    (zone,) = shaft.with_(measurands=rows).zones
    assert zone.material == MaximumMaterial("size", pytest.approx(2 * rim.radius + 0.1), -1.0)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"maximum_material": "hole"}, "must be the name of a diameter or of a slot's width, got 'hole'"),
        ({"maximum_material": "slot.length"}, "got a slot, 'slot.length'"),
        ({"maximum_material": "slot.width"}, "must be the size of c4, got that of c8"),
        ({"tolerance": None}, "must be left out without tolerance, got 'bore'"),
        ({"kind": "position", "features": [D, FRONT, LEFT]}, "must be left out for kind position, got 'bore'"),
    ],
)
def test_what_is_refused(plate, change, line):
    with pytest.raises(InvalidInput, match=line):
        plate.with_(measurands=[ROWS[0], ROWS[1] | change, ROWS[2]])


def test_a_size_without_limits_is_refused(plate):
    bare = {key: value for key, value in ROWS[0].items() if key != "tolerance"}
    with pytest.raises(InvalidInput, match="must be a size that has a tolerance, got 'bore'"):
        plate.with_(measurands=[bare, ROWS[1]])


def test_a_measured_zone_says_what_it_grew_by():
    """The size that is needed, the size that is allowed, and what is below with 95 %, beside each other."""
    zone = scenes.measurands.zone.Zone(
        "place", "true_position", ("place.x", "place.y"), 2.0, 0.2, MaximumMaterial("b", 7.9, 1.0)
    )
    told = MeasuredZone(zone, law(0.5), "mm", "ok").facts
    assert (told["value"], told["size"]) == pytest.approx((2 * np.hypot(0.06, 0.03), 0.28))
    assert told["maximum_material"] == {"of": "b", "limit": 7.9, "bonus": 0.08, "drawn": 0.2}
    assert told["at_most"] - told["size"] == pytest.approx(law(0.5).quantile(0.95) - 0.2)
    lost = MeasuredZone(zone, replace(law(), departure=np.nan), "mm", "low_contrast").facts
    assert (lost["value"], lost["size"], lost["maximum_material"]["bonus"]) == (None, 0.2, None)
    assert MeasuredZone(replace(zone, material=None), ZoneSize(np.zeros(2), np.eye(2), 2.0), "mm", "ok").facts[
        "maximum_material"
    ] is None  # fmt: skip
