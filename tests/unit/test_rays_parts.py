"""Random numbers of the rays, and how many are traced at once, without a compiled variant."""

import sys
from types import ModuleType, SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import kstest

from render.rays import SURFACES, Rays


class Counted(Rays):
    """Whose parts say which fine pixels they were asked for."""

    def _part(self, scene, rows, columns, shape, samples):
        assert rows.size * samples <= max(self.at_once, samples)
        return 1000.0 * rows + columns


@pytest.mark.parametrize("at_once", [1, 16, 36, 64, 10**6])
@pytest.mark.parametrize("count", [0, 1, 4, 9, 10])
def test_parts(at_once, count):
    """Every fine pixel once, in its place, whatever there is room for at once."""
    rows, columns = np.arange(count), np.arange(count)[::-1]
    found = Counted(None, 2, 16, 0, 1, at_once).radiance(None, rows, columns, (50, 50), 16)
    assert found.tolist() == (1000.0 * rows + columns).tolist()


def test_table():
    """Two numbers for the ray and four for each surface, even on the unit interval and below 1 in single precision."""
    table = Rays(None, 2, 12, 3, 7)._table
    assert table.shape == (2 + 4 * SURFACES, 4 * 16)
    assert table.dtype == np.float32
    assert 0 <= table.min() <= table.max() < 1  # margin: random numbers of the unit interval
    assert (np.sort((table * 64).astype(int), 1) == np.arange(64)).all()  # each 64th once: Sobol points
    assert (table == Rays(None, 2, 12, 0, 7)._table).all()
    assert (table != Rays(None, 2, 12, 0, 8)._table).any()


def test_strata():
    """Each fine pixel's rays cross each of its strata once, in an order of its own, evenly mixed."""
    found = Rays(None, 8, 16, 0, 3)._strata(16).reshape(64, 16)
    assert (np.sort(found, 1) == np.arange(16)).all()
    assert len({tuple(row) for row in found.tolist()}) == 64
    assert kstest((found[:, 0] + 0.5) / 16, "uniform").pvalue > 1e-3


class Place(NamedTuple):
    """Two numbers of each ray."""

    x: np.ndarray
    y: np.ndarray


class Lens:
    """A sensor that keeps where its rays are asked for; each weighs 2 and brings what the next fine pixel does."""

    def sample_ray(self, time, wavelength, place, aperture):
        self.place, self.aperture = place, aperture
        return "ray", [2.0]


class Traced(Rays):
    """Whose rays bring their own number."""

    def _follow(self, scene, ray, point):
        return point.astype(float)


def looped(state, condition, body):
    """What Dr.Jit records once and repeats while any ray goes on."""
    while np.any(condition(*state)):
        state = body(*state)
    return state


@pytest.fixture
def numpy_for_drjit(monkeypatch):
    """NumPy in the place of a compiled variant's arrays."""
    module = ModuleType("drjit")
    module.arange = lambda kind, count: np.arange(count)
    module.gather = lambda kind, values, index: values[index]
    module.while_loop = looped
    module.block_sum = lambda values, size: values.reshape(-1, size).sum(1)
    monkeypatch.setitem(sys.modules, "drjit", module)

    def mixed(first, second):  # in the place of its cipher: two numbers of 32 bits
        first, second = (np.asarray(each, np.uint64) for each in np.broadcast_arrays(first, second))
        return tuple((factor * (3 * first + 7919 * second + 1)) % 2**32 for factor in (2654435761, 2246822519))

    module.opaque = lambda kind, value: kind(value)
    return SimpleNamespace(UInt32=np.asarray, Float=np.asarray, Point2f=Place, sample_tea_32=mixed)


def test_each_fine_pixel_is_crossed_in_all_its_strata(numpy_for_drjit):
    """Of a crop of 5 rows and 8 columns; a pixel has 2 x 2 fine ones, each with a block of 16 points of the table."""
    rays, lens = Traced(numpy_for_drjit, 2, 9, 0, 11), Lens()
    rows, columns = np.array([0, 3, 4]), np.array([7, 2, 5])
    scene = SimpleNamespace(sensors=lambda: [lens])
    found = rays._part(scene, rows, columns, (5, 8), 4)
    cells = np.array([1, 2, 1])  # of their pixels: row and column are even or odd
    points = (16 * cells[:, None] + np.arange(4)).ravel()
    assert found == pytest.approx(2 * (16 * cells + 1.5))
    strata = rays._strata(4).reshape(4, 4)[cells]
    across = 2 * (8 * lens.place.x.reshape(3, 4) - columns[:, None]) - strata % 2
    down = 2 * (5 * lens.place.y.reshape(3, 4) - rows[:, None]) - strata // 2
    within = np.stack([across, down])
    assert within.min() >= 0
    assert within.max() < 1
    assert len(np.unique(within.round(9))) == within.size
    assert (np.array(lens.aperture) == rays._table[:2, points]).all()
    assert (np.array(rays._pair(points, 6)) == rays._table[6:8, points]).all()
    columns = np.arange(len(points)) % 5  # each ray's own
    assert (np.array(rays._pair(points, columns))[1] == rays._table[columns + 1, points]).all()


def test_a_fine_pixel_has_the_same_rays_whichever_others_are_traced(numpy_for_drjit):
    """So that two renders differ by what differs between them; another seed's are others."""
    lens, shape = Lens(), (5, 8)
    scene, rows, columns = SimpleNamespace(sensors=lambda: [lens]), np.array([0, 3, 4]), np.array([7, 2, 5])

    def places(seed, *which):
        Traced(numpy_for_drjit, 2, 9, 0, seed)._part(scene, rows[list(which)], columns[list(which)], shape, 4)
        return np.stack(lens.place).reshape(2, len(which), 4)

    assert (places(11, 0, 1, 2)[:, 1:] == places(11, 1, 2)).all()
    assert (places(11, 0, 1, 2) != places(12, 0, 1, 2)).all()


class Met:
    """What rays meet at one surface after another, with the numbers that are drawn there; `weights` by surface."""

    def __init__(self, weights, at, drawn):
        self.weights, self.at, self.drawn = weights, at, drawn

    def ray_intersect(self, ray, active=True):
        return Met(self.weights, sum(kind == "onward" for kind, *_ in self.drawn), self.drawn)

    def is_valid(self):
        return np.array([True, True])

    def bsdf(self, ray):
        return self

    def to_local(self, way):
        return way

    to_world = spawn_ray = to_local

    def sample_emitter_direction(self, hit, pair, _, active):
        self.drawn.append(("light", hit.at, pair))
        return SimpleNamespace(pdf=np.array([0.5, 0.5]), d=hit.at), np.array([[3.0, 5.0]])

    def eval(self, context, hit, way, lit):
        return self.weights[hit.at][0] * np.where(lit, 1.0, np.nan)

    def sample(self, context, hit, one, pair, active):
        self.drawn.append(("onward", hit.at, pair))
        return SimpleNamespace(wo=None), [np.full(2, self.weights[hit.at][1])]


@pytest.mark.parametrize("bounces", [0, 1, 2])
def test_light_by_way_of_each_surface_and_numbers_of_their_own(bounces, numpy_for_drjit):
    """What is reflected at each, weakened by all before it; no two numbers of a ray are of one column of the table."""
    module = sys.modules["drjit"]
    module.zeros, module.width = lambda kind, count: np.zeros(count), len
    mitsuba = numpy_for_drjit
    mitsuba.BSDFContext = lambda: None
    mitsuba.Float = lambda values: np.float64(values) if np.isscalar(values) else np.asarray(values)
    rays, scene = Rays(mitsuba, 2, 9, bounces, 11), Met([(0.7, 0.5), (0.2, 0.3), (0.11, 0.9)], 0, [])
    point = np.array([6, 41])
    found = rays._follow(scene, None, point)
    expected = sum(part for part, _ in zip((0.7, 0.5 * 0.2, 0.5 * 0.3 * 0.11), range(bounces + 1), strict=False))
    assert found == pytest.approx(expected * np.array([3.0, 5.0]))
    assert [each[:2] for each in scene.drawn] == [("light", 0), ("onward", 0), ("light", 1), ("onward", 1),
                                                 ("light", 2)][: 2 * bounces + 1]  # fmt: skip
    numbers = np.concatenate([np.array(pair) for *_, pair in scene.drawn])
    assert (numbers == rays._table[2 : 2 + len(numbers)][:, point]).all()
