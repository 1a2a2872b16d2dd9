"""The model that a budget linearises: its expansion, what is added to a value, and where a plan for it stands."""

from types import SimpleNamespace

import numpy as np
import pytest

from planner.budgeting import plans
from scenes import InvalidInput, Pose
from scenes.placement import Placement
from validation import chain

U = np.array([0.3, 0.05, 2.0])
LINEAR = np.array([[1.5, -2.0, 0.25], [0.5, 3.0, -0.75]])
BENT = np.array([[[0.7, 0.3, -0.2], [0.3, -1.1, 0.4], [-0.2, 0.4, 0.15]], [[0.0, 0.9, 0.0], [0.9, 0.6, 0.1],
                 [0.0, 0.1, -0.35]]])  # fmt: skip


def source(name, u, value=0.0, kind="geometry"):
    moved = lambda station, step: (*station, (name, step))  # noqa: E731
    return SimpleNamespace(name=name, value=value, told=SimpleNamespace(u=u), kind=kind, moved=moved)


SOURCES = (source("a", U[0], 7.0), source("b", U[1], -1.0, "brightness"), source("c", U[2]))


class Made(chain.Chain):
    """Two values that are a polynomial of three errors."""

    cubic = 0.0

    def exact(self, errors):
        bent = np.einsum("ci,mij,cj->cm", errors, BENT, errors) / 2
        return [10.0, 20.0] + errors @ LINEAR.T + bent + self.cubic * errors[:, :1] ** 3


def made(kind=Made, **parts):
    return kind(SimpleNamespace(sources=SOURCES, **parts))


def test_a_polynomial_of_second_degree_is_its_expansion(rng):
    """Value, slopes and curvatures for draws in standard uncertainties."""
    middle, slopes, curved = made().expansion
    assert middle == pytest.approx([10.0, 20.0])
    assert slopes == pytest.approx(LINEAR * U, rel=1e-9)
    assert curved == pytest.approx(BENT * np.outer(U, U), abs=1e-12)
    errors = rng.normal(size=(5, 3)) * U
    for m in (0, 1):
        assert made().expanded(errors, m) == pytest.approx(Made.exact(made(), errors)[:, m], rel=1e-9)


def test_what_the_expansion_misses_is_told_by_the_values_uncertainty(monkeypatch, rng):
    """Of a x^3 by differences over one u: a u^2 x too much of slope."""
    parts = {"measurands": (SimpleNamespace(u=0.5), SimpleNamespace(u=2.0))}
    errors = rng.normal(size=(50, 3)) * U
    one = made(**parts)
    object.__setattr__(one, "cubic", 1.7)
    monkeypatch.setattr(Made, "deviations", lambda self, rng, count: errors[:count])
    off = 1.7 * (errors[:, 0] ** 3 - U[0] ** 2 * errors[:, 0])
    assert one.missed(rng) == pytest.approx(np.sqrt(np.mean(off**2)) / [0.5, 2.0], rel=1e-9)


def test_deviations_are_in_the_sources_order(monkeypatch):
    drawn = {"c": np.array([0.5, 1.5]), "a": np.array([8.0, 5.0]), "b": np.array([-1.25, 0.0])}
    monkeypatch.setattr(chain, "draw", lambda shared, rng, count: drawn)
    found = made(shared=()).deviations(None, 2)
    assert found.tolist() == [[1.0, -0.25, 0.5], [-2.0, 1.0, 1.5]]
    assert made(kind=lambda budget: chain.Chain(SimpleNamespace(sources=(), shared=()))).deviations(None, 3).shape == (
        3, 0,
    )  # fmt: skip


def test_a_drawn_value_is_the_expansion_and_what_is_added(monkeypatch):
    monkeypatch.setattr(Made, "added", lambda self, m, drawn: 100.0 * (m + 1))
    drawn = {"a": np.array([7.1]), "b": np.array([-1.02]), "c": np.array([3.0])}
    exact = Made.exact(made(), np.array([[0.1, -0.02, 3.0]]))[0]
    for m in (0, 1):
        assert made().model(m)(drawn) == pytest.approx([exact[m] + 100.0 * (m + 1)])


def test_a_station_is_moved_by_each_error():
    """But for those that are zero."""
    one = made()
    one.__dict__["here"] = ("here",)
    assert one.station(np.array([0.5, 0.0, -2.0])) == ("here", ("a", 0.5), ("c", -2.0))


KNOWN = SimpleNamespace(scene=SimpleNamespace(placement=Placement()))


def test_levels_count_to_first_order(monkeypatch):
    """Places by the station of the geometric errors, the bias by brightness linearly beside it."""
    asked = []
    monkeypatch.setattr(chain, "believed", lambda picture, errors: np.stack([errors, 10 * errors], -1))
    budget = SimpleNamespace(sources=SOURCES, picture=KNOWN, sensitivities=LINEAR)
    budget.features = SimpleNamespace(
        errors=lambda stations: asked.extend(stations) or np.array([len(each) / 4 for each in stations])
    )
    one = chain.Chain(budget)
    one.__dict__["here"] = ("here",)
    found = one.exact(np.array([[0.5, 0.1, -2.0], [0.0, 0.3, 1.0]]))
    assert asked == [("here", ("a", 0.5), ("c", -2.0)), ("here", ("c", 1.0))]
    assert found == pytest.approx(np.array([[0.75 - 0.2, 7.5 + 0.3], [0.5 - 0.6, 5.0 + 0.9]]))


def terms(**extra):
    told = {chain.NOISE: (0.0, 1.0), chain.ROUNDING: (0.0, 1.0), "own": (2.0, -3.0), **extra}
    return [[SimpleNamespace(name=name, value=v, sensitivity=c) for name, (v, c) in told.items()]]


DRAWN = {chain.NOISE: np.array([0.1, -0.2]), chain.ROUNDING: np.array([0.01, 0.02]), "own": np.array([2.5, 1.0]),
         chain.TEMPERATURE: np.array([1.5, 4.0]), chain.EXPANSION: np.array([0.002, 0.001])}  # fmt: skip


def test_what_is_added_to_a_value():
    """Sensitivity times deviation; a picture has noise and rounding in itself."""
    one = made(terms=terms(), measurands=())
    assert one.added(0, DRAWN) == pytest.approx([0.11 - 1.5, -0.18 + 3.0])
    assert one.added(0, DRAWN, pictured=True) == pytest.approx([-1.5, 3.0])


def test_expansion_counts_as_the_product_that_it_is():
    """Less L (T a - T0 a0): not as two linear terms."""
    warm = terms(**{chain.TEMPERATURE: (3.0, 99.0), chain.EXPANSION: (0.0015, 77.0)})
    one = made(terms=warm, measurands=(SimpleNamespace(value=40.0),))
    expected = np.array([-1.5, 3.0]) - 40.0 * (np.array([0.003, 0.004]) - 0.0045)
    assert one.added(0, DRAWN, pictured=True) == pytest.approx(expected)


def test_values_are_rounded_by_their_unit():
    said = SimpleNamespace(rounding=0.02, rounding_deg=0.5)
    picture = SimpleNamespace(scene=SimpleNamespace(uncertainty=said))
    kinds = (SimpleNamespace(unit="mm"), SimpleNamespace(unit="degrees"))
    values = np.array([[1.029, 30.2], [1.031, 30.3]])
    one = made(picture=picture, measurands=kinds)
    assert one._rounded(values.copy()) == pytest.approx(np.array([[1.02, 30.0], [1.04, 30.5]]))
    said.rounding = 0.0
    assert one._rounded(values.copy()) == pytest.approx(np.array([[1.029, 30.0], [1.031, 30.5]]))


def test_variance_by_inputs_that_move_places(monkeypatch):
    """(c u) R (c u)' of the geometric ones, of which the second and the first are correlated by a calibration."""
    given = (source("fx", 0.3), source("light", 9.0, kind="brightness"), source("cx", 0.5), source("roll", 2.0))
    slopes = np.array([[1.0, -2.0, 0.25], [0.5, 3.0, -0.75]])
    told = SimpleNamespace(names=("cx", "fx"), correlation=np.array([[1.0, -0.6], [-0.6, 1.0]]))
    scene = SimpleNamespace(quantities=(1, 2), uncertainty=SimpleNamespace(covariance=told), free=(0,))
    monkeypatch.setattr(plans.Pictures, "of", lambda *_: None)
    known = SimpleNamespace(known=SimpleNamespace(quantities=scene.quantities))
    monkeypatch.setattr(plans, "Features", lambda pictures, of_rims: known)
    monkeypatch.setattr(plans, "sensitivities", lambda features, still, biased: slopes[:, : len(still)])
    a, b, c = (slopes * [0.3, 0.5, 2.0]).T
    expected = a**2 + b**2 + c**2 - 1.2 * a * b
    assert plans.systematic(scene, np.zeros(2), given) == pytest.approx(expected, rel=1e-9)
    scene.uncertainty.covariance = None
    assert plans.systematic(scene, np.zeros(2), given) == pytest.approx(a**2 + b**2 + c**2, rel=1e-9)
    assert plans.systematic(scene, np.zeros(2), given[1:2]).tolist() == [0.0, 0.0]


def test_a_light_is_anywhere():
    one = plans._anywhere(SimpleNamespace(free=(0,)))
    assert one.tolist() == [20.0, 0.0]
    assert [each.tolist() for each in plans._anywhere(SimpleNamespace(free=(0, 2)))] == [[20.0, 0.0]] * 2
    assert plans._anywhere(SimpleNamespace(free=())) == ()


class Table:
    """A problem of 3 sensors and 2 lights in two pieces, one measurand."""

    noise = np.array([[4.0, 1.0], [2.0, 3.0], [5.0, 2.5]])[..., None]
    allowed = np.ones((3, 2), bool)

    def objective(self, variances):
        return variances[..., 0]

    def table(self, sensors, lights, report):
        for part in (slice(0, 2), slice(2, 3)):
            report("pairs", part.stop, 3)
            yield part, SimpleNamespace(variances_object=self.noise[part]), self.allowed[part]


def test_the_best_pair_with_everything_and_by_noise_alone():
    """What moves places is of the sensor: (3, 1, 0.25); not known counts as infinite."""
    said, problem = [], Table()
    grid = SimpleNamespace(sensors=np.zeros((3, 2)), lights=np.zeros((2, 2)))
    found = plans._searched(problem, grid, np.array([[3.0], [1.0], [0.25]]), lambda *told: said.append(told))
    assert found == ((2, 1), (0, 1))
    assert said == [("pairs", 5, 6), ("pairs", 6, 6)]
    assert plans._searched(problem, grid, np.array([[3.0], [1.0], [np.nan]]), lambda *_: None)[0] == (1, 0)
    problem.allowed = np.array([[True, False], [True, True], [True, False]])
    assert plans._searched(problem, grid, np.array([[3.0], [1.0], [0.25]]), lambda *_: None) == ((1, 0), (1, 0))
    problem.allowed = np.zeros((3, 2), bool)
    with pytest.raises(InvalidInput, match="constraints must leave a setting that can measure, got none"):
        plans._searched(problem, grid, np.zeros((3, 1)), lambda *_: None)


def test_what_a_plan_descends_by(monkeypatch):
    """Noise of the picture and what moves places at its sensor; what is not known is infinite."""
    monkeypatch.setattr(plans, "Picture", SimpleNamespace(of=lambda scene, sensor, light: (scene, sensor, light)))
    monkeypatch.setattr(plans.Pictures, "of", lambda picture: picture)
    noise = lambda picture: SimpleNamespace(variances_object=np.array([picture[1][0], 2.0]))  # noqa: E731
    monkeypatch.setattr(plans, "variance_model", lambda model: noise)
    monkeypatch.setattr(plans, "systematic", lambda scene, sensor, given: np.array([sensor[1], 0.25]))
    problem = SimpleNamespace(scene="scene", model="calibrated", objective=np.sum)
    value = plans._value(problem, ())
    assert value(np.array([5.0, 0.5]), np.array([30.0, 40.0])) == 5.0 + 2.0 + 0.5 + 0.25
    assert value(np.array([5.0, np.nan]), np.array([30.0, 40.0])) == np.inf


def test_ratios_are_of_measurands_with_a_tolerance():
    told = [SimpleNamespace(tolerance=None), SimpleNamespace(tolerance=SimpleNamespace(half=0.25))]
    found = SimpleNamespace(
        measurands=(SimpleNamespace(U=3.0), SimpleNamespace(U=0.5)), prediction=SimpleNamespace(measurands=told)
    )
    assert plans.Placed(Pose(1, 2), Pose(3, 4), found).ratios == (2.0,)


def test_places_that_datums_tell_count_to_first_order(monkeypatch):
    """What the adjustment leaves of them, not the station that they make; all else as ever."""
    asked = []
    monkeypatch.setattr(chain, "believed", lambda picture, errors: np.stack([errors, errors], -1))
    sources = (SimpleNamespace(name="part_shift.z", kind="geometry", value=0.0, moved=None), *SOURCES[:1])
    placement = Placement(source="datums", datums=("e1",), datum_sd=0.0)
    budget = SimpleNamespace(sources=sources, sensitivities=np.array([[3.0, 0.0], [0.5, 0.0]]))
    budget.picture = SimpleNamespace(scene=SimpleNamespace(placement=placement))
    budget.features = SimpleNamespace(errors=lambda stations: asked.extend(stations) or np.zeros(len(stations)))
    one = chain.Chain(budget)
    one.__dict__["here"] = ("here",)
    assert one.exact(np.array([[2.0, 0.5]])) == pytest.approx(np.array([[6.0, 1.0]]))
    assert asked == [("here", ("a", 0.5))]
