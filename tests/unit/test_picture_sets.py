"""Candidates of plans with several pictures: which pairs are kept, what is known of them, and how they are refined."""

from types import SimpleNamespace

import numpy as np
import pytest

from planner.search import pool, sets
from planner.search.local import Start, shifted
from planner.search.objective import Aim

SHARES = np.array([2.0, 0.5, 3.0])


def aim(over):
    return Aim("object", over, SHARES)


def around(a, b):
    """Angle between two poses, degrees, by the haversine."""
    (p, q), (r, s) = np.radians(a), np.radians(b)
    chord = np.sin((p - r) / 2) ** 2 + np.sin(p) * np.sin(r) * np.sin((q - s) / 2) ** 2
    return np.degrees(2 * np.arcsin(np.sqrt(chord)))


@pytest.fixture
def table(rng):
    """Of 5 sensors and 4 lights what they tell of three quantities, some nothing."""
    told = rng.uniform(1, 9, (5, 4, 3))
    told[2], told[0, 1], told[3, 2, 1] = 0, 0, 0
    return told


def test_information_adds_up_by_shares():
    """1 over share times variance; of what is not measured, 0."""
    variances = np.array([[4.0, np.inf, 0.25], [np.nan, 8.0, 2.0]])
    assert pool.information(variances, aim("sum")).tolist() == [[1 / 8, 0, 1 / 0.75], [0, 1 / 4, 1 / 6]]


def test_pairs_that_are_not_allowed_tell_nothing(rng):
    """Sensors come some at a time."""
    variances, allowed = rng.uniform(1, 5, (5, 4, 3)), rng.random((5, 4)) < 0.5

    def table(sensors, lights, report):
        for part in (slice(0, 2), slice(2, 5)):
            yield part, SimpleNamespace(variances_object=variances[part]), allowed[part]

    scene = SimpleNamespace(quantities=(1, 2, 3))
    problem = SimpleNamespace(table=table, scene=scene, objective=aim("minimax"))
    found = pool.fast_table(problem, np.zeros((5, 2)), np.zeros((4, 2)), None)
    assert found == pytest.approx(np.where(allowed[..., None], 1 / (variances * SHARES), 0))


@pytest.mark.parametrize(("over", "whole"), [("minimax", max), ("sum", sum)])
def test_what_one_pair_tells_alone(table, over, whole):
    found = sets.alone(table, aim(over))
    for s, k in np.ndindex(5, 4):
        parts = [1 / x if x else np.inf for x in table[s, k]]
        assert found[s, k] == pytest.approx(whole(parts))


@pytest.mark.parametrize("over", ["minimax", "sum"])
def test_pairs_are_kept_that_none_dominates_or_that_are_a_sensors_best(table, over):
    """By brute force: of each quantity, and of the objective; those that tell nothing never."""
    flat, wanted = table.reshape(-1, 3), set()
    for i, one in enumerate(flat):
        if not any((other >= one).all() and (other > one).any() for other in flat):
            wanted.add(i)
    value = {"minimax": max, "sum": sum}[over]
    for s in range(5):
        rows = range(4 * s, 4 * s + 4)
        wanted |= {max(rows, key=lambda i: flat[i, m]) for m in range(3)}
        wanted.add(min(rows, key=lambda i: value([1 / x if x else np.inf for x in flat[i]])))
    assert sets.undominated(table, aim(over)).tolist() == sorted(i for i in wanted if flat[i].any())


@pytest.mark.parametrize(("share", "axis"), [("sensor", 0), ("light", 1)])
def test_of_each_shared_place_its_own_pairs_are_compared(table, share, axis, monkeypatch):
    """The places with the best sets alone, where they are many; as flat indices of all pairs."""
    wanted = {}
    for place in range(table.shape[axis]):
        own = np.take(table, place, axis)
        kept = [i for i, one in enumerate(own)
                if one.any() and not any((other >= one).all() and (other > one).any() for other in own)]  # fmt: skip
        pairs = [(place, i) if axis == 0 else (i, place) for i in kept]
        together = [np.max([1 / x if x else np.inf for x in own[i] + own[j]]) for i in kept for j in kept]
        lost = [int((own[i] + own[j] == 0).sum()) for i in kept for j in kept]
        if pairs:
            wanted[place] = (min(zip(lost, together, strict=True)), {s * 4 + k for s, k in pairs})
    assert set(sets.undominated_shared(table, aim("minimax"), share, 2).tolist()) == set().union(
        *(rows for _, rows in wanted.values())
    )
    monkeypatch.setattr(sets, "_GROUPS", 2)
    best = sorted(wanted.values(), key=lambda each: each[0])[:2]
    found = sets.undominated_shared(table, aim("minimax"), share, 2).tolist()
    assert len(found) == len(set(found))
    assert set(found) == best[0][1] | best[1][1]


def prediction(*told):
    """Of a picture: variance and status of each measurand."""
    return SimpleNamespace(measurands=[SimpleNamespace(variance_object=v, status=s) for v, s in told])


def candidates():
    """Of five pictures two were ray-traced; only the third is beside the first, by sensor and by light."""
    poses = np.array([[30.0, 10, 40, 200], [60, 10, 40, 200], [36, 15, 45, 205], [33, 10, 40, 230], [50, 10, 41, 200]])
    told = np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, 9], [10, 11, 12], [13, 14, 15]])
    problem = SimpleNamespace(objective=aim("sum"))
    ways = SimpleNamespace(problem=problem, to_digits=lambda *pair: pair)
    found = pool.Pool(pool.World(None, ways), poses, told)
    found.steady = {0: np.array([True] * 3), 1: np.array([True] * 3)}
    found.traced[1] = prediction((2.0, "ok"), (np.inf, "short"), (0.5, "clutter"))
    found.traced[0] = prediction((5.0, "clutter"), (4.0, "ok"), (np.inf, "clutter"))
    return found


def test_what_is_known_of_pictures_that_were_ray_traced():
    """In their order; ok and clutter apart."""
    found = candidates()
    assert found.seen.tolist() == [0, 1]
    known = found.known()
    assert known.ok.tolist() == [[0, 1 / 2, 0], [1 / 4, 0, 0]]
    assert known.clutter.tolist() == [[1 / 10, 0, 0], [0, 0, 1 / 1.5]]
    assert known.over == "sum"


def test_what_is_lost_a_little_off_counts_only_where_nothing_else_does():
    """The first quantity of the second picture is not steady, and the first one tells it; nothing steady tells the
    second."""
    found = candidates()
    found.steady = {0: np.array([True, False, True]), 1: np.array([False, False, True])}
    known = found.known()
    assert known.ok.tolist() == [[0, 1 / 2, 0], [0, 0, 0]]
    assert known.clutter.tolist() == [[1 / 10, 0, 0], [0, 0, 1 / 1.5]]


def test_clutter_is_expected_beside_clutter():
    """Within 15 degrees of both sensor and light, of what tells something there; the rest is as a glance tells."""
    found = candidates()
    # margin: the order is said
    assert around(found.poses[0, :2], found.poses[2, :2]) < 15 < around(found.poses[0, 2:], found.poses[3, 2:])
    # margin: the order is said
    assert around(found.poses[1, :2], found.poses[4, :2]) < 15 < around(found.poses[0, :2], found.poses[4, :2])
    told = found.expected()
    assert told.ok.tolist() == [[0, 1 / 2, 0], [1 / 4, 0, 0], [0, 8, 9], [10, 11, 12], [13, 14, 0]]
    assert told.clutter.tolist() == [[1 / 10, 0, 0], [0, 0, 1 / 1.5], [7, 0, 0], [0, 0, 0], [0, 0, 15]]
    found.traced.clear()
    assert found.expected().ok.tolist() == found.told.tolist()
    assert not found.expected().clutter.any()


def test_pictures_with_another_choice_are_the_last():
    """Clutter beside a picture tells nothing of one from the same place with other polarisers."""
    found = candidates()
    ways = SimpleNamespace(problem=found.worlds[0].problem, to_digits=lambda *pair: pair)
    found.join(pool.World("other", ways), found.poses[:1] + 0.1, np.array([[7.0, 0.0, 1.0]]))
    assert found.poses[-1].tolist() == [30.1, 10.1, 40.1, 200.1]
    assert found.told[-1].tolist() == found.expected().ok[-1].tolist() == [7, 0, 1]
    assert found.of_world.tolist() == [0, 0, 0, 0, 0, 1]
    assert found.world(5).choice == "other"


def test_sets_and_one_more_picture(rng):
    """Of what is ok the sum; of what is not, a quarter of the clutter's; first how much is lost."""
    ok, clutter = rng.uniform(1, 9, (4, 3)), rng.uniform(1, 9, (4, 3))
    ok[:, 1], ok[1, 2], clutter[:3, 1] = 0, 0, 0
    for over, whole in (("minimax", max), ("sum", sum)):
        table = sets.PictureInformation(ok, clutter, over)
        both = table.together([0, 2])
        assert len(both) == 1
        assert both.ok[0] == pytest.approx(ok[0] + ok[2])
        assert both.clutter[0] == pytest.approx(clutter[0] + clutter[2])
        for row in range(4):
            told = [o or c / 4 for o, c in zip(ok[[0, 2, row]].sum(0), clutter[[0, 2, row]].sum(0), strict=True)]
            parts = [1 / x for x in told if x]
            wanted = (sum(x == 0 for x in told), whole(parts), sum(parts))
            assert both.plus(ok[row], clutter[row]) == pytest.approx(wanted)
            assert table.with_each((0, 2)).at(row) == pytest.approx(wanted)
            assert table.of_sets(np.array([[1, 1, 1], [0, 2, row]])).at(1) == pytest.approx(wanted)


@pytest.mark.parametrize("pose", [(35.0, 250.0), (0.0, 0.0), (90.0, 10.0), (179.0, 300.0)])
def test_a_pose_is_moved_by_two_angles_at_right_angles(pose):
    """By one of them alone along a great circle; by both, tangents add; the other way is opposite."""
    pose = np.array(pose)
    for by in ((7.0, 0.0), (0.0, 7.0), (-4.0, 0.0), (0.0, -0.5), (6.0, -8.0)):
        end = shifted(pose, np.array(by))
        away = np.degrees(np.arctan(np.hypot(*np.tan(np.radians(by)))))
        assert around(pose, end) == pytest.approx(away)
        assert around(end, shifted(pose, -np.array(by))) == pytest.approx(2 * away)
        # margin: a range that holds by its kind
        assert 0 <= end[0] <= 180
        # margin: a range that holds by its kind
        assert 0 <= end[1] < 360
    one, two = (shifted(pose, np.array(by)) for by in ((8.0, 0.0), (0.0, 8.0)))
    assert np.cos(np.radians(around(one, two))) == pytest.approx(np.cos(np.radians(8)) ** 2)


def test_unknowns_move_sensor_lights_and_angles_in_this_order():
    """In units; what is held, and lights on the sensor's mount, take none."""
    sensor, lights, angles = np.array([30.0, 20.0]), np.array([50.0, 60.0, 70.0, 80.0]), np.array([5.0, 9.0, 11.0])
    x = np.array([1.0, -2.0, 3.0, -4.0, 5.0, -6.0, 7.0, -8.0, 9.0])
    free = Start(sensor, lights, angles, unit_deg=0.5)
    assert free.count == 9
    found = free.at(x)
    assert found[0] == pytest.approx(shifted(sensor, [0.5, -1.0]))
    assert found[1] == pytest.approx([*shifted(lights[:2], [1.5, -2.0]), *shifted(lights[2:], [2.5, -3.0])])
    assert found[2] == pytest.approx([8.5, 5.0, 15.5])
    assert all(a is b for a, b in zip(free.at(np.zeros(9)), (sensor, lights, angles), strict=True))
    still = Start(sensor, lights, angles, held=(True, False), unit_deg=0.5)
    assert still.count == 7
    found = still.at(x[:7])
    assert found[0] is sensor
    assert found[1] == pytest.approx([*shifted(lights[:2], [0.5, -1.0]), *shifted(lights[2:], [1.5, -2.0])])
    assert found[2] == pytest.approx([7.5, 6.0, 14.5])
    dark = Start(sensor, lights, angles, held=(False, True), unit_deg=0.5)
    assert dark.count == 5
    found = dark.at(x[:5])
    assert found[0] == pytest.approx(shifted(sensor, [0.5, -1.0]))
    assert found[1] is lights
    assert found[2] == pytest.approx([6.5, 7.0, 13.5])
    mount = Start(sensor, lights, angles[:0], same_mount=True, unit_deg=0.5)
    assert mount.count == 2
    assert mount.at(x[:2])[1] == pytest.approx(np.tile(shifted(sensor, [0.5, -1.0]), 2))
