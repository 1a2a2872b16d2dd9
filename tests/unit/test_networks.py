"""Sets of pictures adjusted together: stereo in closed form, search with exchange against all sets, the bound."""

from itertools import combinations_with_replacement

import numpy as np
import pytest

from imaging.bundles.bundle import Bundle
from imaging.bundles.unknowns import Freedom
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.bundles import states_of
from planner.constraints import Constraints
from planner.search.grid import Grid
from planner.search.network_pool import NetworkPool
from planner.search.networks import Network, best_of_all, best_sets
from planner.search.objective import Aim, SearchProblem
from planner.search.sets import filled
from tests import placements as parts
from tests.bundles import UNSURE

PLAIN = {"from": "known", "datums": [], "datum_sd": None}
NOBODY = lambda *_: None  # noqa: E731


def network(told, gradient, over="minimax", before=None):
    """Of pictures that show the same features, none of which is a datum."""
    told, count = np.stack([told, told]), len(gradient)
    before = np.zeros(told.shape[2:]) if before is None else before
    aim = Aim("object", over, np.ones(count))
    return Network(told, before, gradient, np.ones((2, told.shape[1], 1), bool), np.zeros((count, 1), bool), aim,
                   float(told.max()))  # fmt: skip


def orbit(polar_deg, sigma, visible_deg=90.0):
    """Information (n, 3, 3) about a point by cameras around it, which tell it across their rays to sigma."""
    polar = np.radians(polar_deg)
    rays = np.stack([np.sin(polar), np.zeros(len(polar)), np.cos(polar)], -1)
    told = (np.eye(3) - rays[:, :, None] * rays[:, None, :]) / sigma**2
    return told * (np.abs(polar_deg) <= visible_deg)[:, None, None]


def test_depth_of_two_pictures_falls_with_their_base_until_visibility_ends():
    """Cameras at a distance D, t off the vertical to both sides: base 2 D sin(t), sigma_z = sigma / (sqrt(2) sin(t)).

    One camera tells no depth, however often; two take the widest base from which the point is seen.
    """
    polar, sigma, depth = np.arange(-60.0, 61.0, 5.0), 0.01, np.array([[0.0, 0.0, 1.0]])
    for seen in (60.0, 35.0, 20.0):
        cameras = network(orbit(polar, sigma, seen), depth)
        assert best_of_all(cameras, 1) == (1, 0.0)
        (one,), two = best_sets(cameras, 2)
        assert np.isinf(cameras.variances(np.array([[one], [two[0]]]))).all()
        assert np.isinf(cameras.variances(np.array([two[0], two[0]]))).all()
        assert [float(polar[k]) for k in two] == [-seen, seen]
        narrower = [int(np.flatnonzero(polar == side * (seen - 5))[0]) for side in (-1, 1)]
        told = cameras.variances(np.array([two, narrower]))[:, 0]
        expected = sigma**2 / (2 * np.sin(np.radians([seen, seen - 5])) ** 2)
        np.testing.assert_allclose(told, expected, rtol=1e-9)
        assert cameras.relaxed(2)[0] <= told[0] * (1 + 1e-9)


def dense(rows, before, gradient, members):
    """What a set leaves open and the largest variance of the rest, by all rows at once: no elimination, no damping."""
    whole = np.concatenate([*(rows[k] for k in members), before])
    sizes, axes = np.linalg.svd(whole)[1:]
    rank = int((sizes > 1e-9 * sizes.max()).sum())
    told = np.linalg.norm(gradient @ axes[rank:].T, axis=1) < 1e-6 * np.linalg.norm(gradient, axis=1)
    variances = ((gradient @ np.linalg.pinv(whole, rcond=1e-9)) ** 2).sum(1)
    return int((~told).sum()), float(np.where(told, variances, 0.0).max())


def drawn(seed):
    """Ten pictures of two rows each that tell six unknowns, of which two are known before; three quantities."""
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((10, 2, 6)) * np.exp(rng.normal(0, 0.5, (10, 1, 1)))
    before, gradient = 0.3 * np.eye(6)[:2], rng.standard_normal((3, 6))
    made = network(np.swapaxes(rows, 1, 2) @ rows, gradient, before=before.T @ before)
    return made, lambda members: dense(rows, before, gradient, members)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_exchange_finds_the_best_of_all_sets(count):
    """Of 20 drawn networks every set is tried by dense algebra: 79 of 80 bests are found, one is missed by 5.8 %."""
    ratios, bounds = [], []
    for seed in range(20):
        made, told = drawn(seed)
        best = min(told(members) for members in combinations_with_replacement(range(10), count))
        found = told(best_sets(made, count)[-1])
        assert found[0] == best[0] == (3 if count == 1 else 0)
        if count > 1:
            assert best_of_all(made, count)[1] == pytest.approx(best[1], rel=1e-6)
            ratios.append(found[1] / best[1])
            bounds.append(made.relaxed(count)[0] / best[1])
    if count > 1:
        assert np.sum(np.array(ratios) < 1 + 1e-6) >= 18
        assert max(ratios) < 1.12
        assert max(bounds) <= 1 + 1e-9
    if count == 4:
        assert min(bounds) > 0.28  # margin: twice what is found, 0.57: a bound of nothing would be none


def test_greedy_alone_is_not_enough():
    """Control: of those 20 networks of three pictures most need an exchange."""
    worse = 0
    for seed in range(20):
        made, _ = drawn(seed)
        both = np.array([filled(made, (), 3), best_sets(made, 3)[-1]])
        score = made.of_sets(both)
        worse += bool(score.value[0] > 1.001 * score.value[1])
    assert worse > 5


def looked_at(scene, sensors, step, **more):
    """All candidates of a grid with the light held, looked at closely."""
    problem = SearchProblem(scene, "calibrated", Aim.of(scene.quantities, "object"), Constraints().on_side_of(scene))
    pool = NetworkPool(problem, Freedom(sensors), Grid.of(scene, problem.constraints, step, light=parts.LIGHT), NOBODY)
    for row in range(len(pool.poses)):
        pool.look(row)
    return pool


@pytest.mark.parametrize(
    ("name", "sensors"), [("roof", "known"), ("roof", "uncertain"), ("wedge", "known"), ("block", "uncertain")]
)
def test_of_a_grid_the_best_set_is_found(tmp_path, name, sensors):
    """Real parts: every set of two and three pictures by all rows and all unknowns at once, sensors with them."""
    scene = parts.scene(tmp_path, name, placement=PLAIN, uncertainty=UNSURE)
    pool = looked_at(scene, sensors, 30)
    rows, known, _ = pool.known()
    some = np.arange(0, len(rows), 4 if sensors == "known" else 5)
    known = known.with_pictures(np.stack([known.told[0, some]] * 2), np.stack([known.shown[0, some]] * 2))
    pictures = [pool.looked[int(row)] for row in rows[some]]
    whole = Bundle.of(pictures * 3, Freedom(sensors))
    each = [variance_model("calibrated")(Pictures.of(picture)) for picture in pictures]
    ok = [states_of(one, picture, close=True) == "ok" for one, picture in zip(each, pictures, strict=True)]
    counts = [seen.of_features(one) for seen, one in zip(whole.seen, ok * 3, strict=True)]
    adjusted = whole.adjusted([one.of_features for one in each] * 3, counts)
    told = [
        white @ np.where(np.isfinite(design), design, 0.0) * whole.unknowns.units
        for white, design in zip(adjusted.whites, whole.designs, strict=True)
    ]
    before, gradient = whole.unknowns.priors()[0] * whole.unknowns.units, whole.nominal[1] * whole.unknowns.units
    gradient = gradient * np.sqrt(known.aim.shares)[:, None]
    for count in (2, 3):
        scores = [
            dense(told, before, gradient, [k + len(pictures) * members[:i].count(k) for i, k in enumerate(members)])
            for members in combinations_with_replacement(range(len(pictures)), count)
        ]
        found = best_sets(known, count)[-1]
        score = known.of_sets(np.array([found])).at(0)
        assert score[0] == min(scores)[0]
        assert score[1] == pytest.approx(min(scores)[1], rel=1e-3)
    assert score[1] < 0.5 * max(value for lost, value in scores if lost == score[0])  # control: sets are not all alike
