"""Limits of a plan: what they accept and refuse, by plain geometry."""

from types import SimpleNamespace

import numpy as np
import pytest

import scenes
from imaging.features.projected_edges import projected_edges
from imaging.pictures import Pictures
from planner import Constraints
from planner.constraints import _clearance, _to_segment
from scenes import InvalidInput
from tests.oracle import axes, pinhole


@pytest.mark.parametrize("name", ["sensor_polar_deg", "light_polar_deg"])
def test_polar_angles(name):
    for good in ((0.0, 180.0), (90.0, 90.0), (0.0, 0.0), (180.0, 180.0)):
        Constraints(**{name: good})
    for bad in ((-1e-6, 90.0), (0.0, 180.0001), (50.0, 49.0), (float("nan"), 90.0)):
        with pytest.raises(InvalidInput, match=f"{name} must be two rising angles between 0 and 180"):
            Constraints(**{name: bad})


@pytest.mark.parametrize(
    ("name", "most"), [("min_edge_px", 1e9), ("min_clearance_px", 1e9), ("min_separation_deg", 180.0)]
)
def test_lengths_and_separation(name, most):
    for good in (0.0, 1e-9, most):
        Constraints(**{name: good})
    for bad, limit in ((-1e-9, "least 0"), (np.nextafter(most, np.inf), "most"), (float("nan"), "least 0")):
        with pytest.raises(InvalidInput, match=f"{name} must be at {limit}"):
            Constraints(**{name: bad})


@pytest.mark.parametrize("name", ["forbidden_sensor", "forbidden_light"])
def test_regions(name):
    for good in ((0, -700, 0), (180, 10, 180)):
        Constraints(**{name: (good,)})
    for bad in ((-0.1, 0, 1), (180.1, 0, 1), (0, float("inf"), 1), (0, 0, -0.1), (0, 0, 180.1)):
        with pytest.raises(InvalidInput, match=f"{name} must be polar, azimuth and radius"):
            Constraints(**{name: ((10, 10, 10), bad)})


def test_limits_belong_to_the_limited(task1):
    poses = np.array([[19.9, 0.0], [20.0, 0.0], [40.0, 0.0], [40.1, 0.0]])
    inside, everything = [False, True, True, False], [True] * 4
    for constraints, sensors, lights in (
        (Constraints(sensor_polar_deg=(20, 40)), inside, everything),
        (Constraints(light_polar_deg=(20, 40)), everything, inside),
    ):
        assert constraints.sensors(task1, poses).tolist() == sensors
        assert constraints.lights(poses).tolist() == lights


def _bodiless(**limits) -> Constraints:
    return Constraints(camera_body=0, light_body=0, **limits)


def test_pairs(task1, rng):
    """Angles by arc length between directions; the light's image by a pinhole of the oracle's own."""
    sensors, lights = (np.column_stack([rng.uniform(0, 180, 300), rng.uniform(0, 360, 300)]) for _ in range(2))
    lights[:50] = sensors[:50]
    lights[50:80] = sensors[50:80] + [1.5, 0]
    towards = [np.array([axes(pose)[0] for pose in some]) for some in (sensors, lights)]
    angle = np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(towards[0] - towards[1], axis=1) / 2, 0, 1)))
    assert (_bodiless(min_separation_deg=30).pairs(task1, sensors, lights) == (angle >= 30)).all()
    assert _bodiless().pairs(task1, sensors, lights).all()
    assert (_bodiless(same_mount=True).pairs(task1, sensors, lights) == (angle < 1e-5)).all()
    near = task1.model_copy(update={"light": scenes.Light(distance=40.0), "settings": ()})
    size = np.array([near.camera.width, near.camera.height])
    seen = [pinhole(40 * at[None], pose, near.camera)[0] for at, pose in zip(towards[1], sensors, strict=True)]
    inside = np.array([((image > -0.5) & (image < size - 0.5)).all() for image in seen])
    assert 30 < inside.sum() < 200
    assert (_bodiless(light_out_of_view=True).pairs(near, sensors, lights) == ~inside).all()
    assert not Constraints().pairs(task1, sensors[:50], lights[:50]).any()  # bodies of some size in one place
    assert Constraints(min_separation_deg=1).on_pairs
    assert not _bodiless(min_edge_px=1).on_pairs


def test_lengths_in_the_image(task1):
    """Required edges of 20 px or more, and 40 px between those that share no vertex: dense points of the oracle."""
    poses = np.array([[polar, azimuth] for polar in (5.0, 30.0, 60.0, 80.0) for azimuth in range(0, 360, 15)])
    solid = task1.solid
    names = list(dict.fromkeys(name for corner in (task1.task.start, task1.task.end) for name in corner.edges))
    pairs = [(a, b) for a in names for b in names if a < b and not set(solid.edge(a).ends) & set(solid.edge(b).ends)]
    assert pairs
    fractions = np.linspace(0, 1, 201)[:, None]
    least = []
    for pose in poses:
        lines = {}
        for name in names:
            start, stop = solid.vertices[list(solid.edge(name).ends)]
            lines[name] = pinhole(start + fractions * (stop - start), pose, task1.camera)
        least.append(min(np.linalg.norm(lines[a][:, None] - lines[b], axis=-1).min() for a, b in pairs))
    least = np.array(least)
    seen = Constraints(min_edge_px=1e-9).sensors(task1, poses)
    clear = Constraints(min_clearance_px=40.0).sensors(task1, poses)
    told = np.abs(least - 40) > 1.0  # the product looks at 17 points of an edge
    assert (clear == (seen & (least >= 40)))[told].all()
    assert 0 < (seen & ~clear).sum() < seen.sum()


def test_clearance_of_segments():
    """From 17 places on one segment to the whole of the other; edges that meet do not count."""
    ends = np.array([[[0.0, 0], [10, 0]], [[14.0, 3], [14, 9]], [[0.0, 0], [0, 5]], [[-3.0, -4], [-9, -4]]])
    pairs = {"a": (0, 1), "b": (2, 3), "c": (0, 4), "d": (5, 6)}
    edges = {name: SimpleNamespace(ends=pair) for name, pair in pairs.items()}
    scene = SimpleNamespace(solid=SimpleNamespace(edge=edges.get))

    def clearance(which):
        rows = ["abcd".index(name) for name in which]
        seen = SimpleNamespace(names=tuple(which), ends=ends[None, rows], visible=np.ones((1, len(rows))))
        return _clearance(scene, seen)

    assert clearance("ab") == pytest.approx([5.0])  # 3, 4, 5; beyond its end the first one would come nearer
    assert clearance("ad") == pytest.approx([5.0])
    assert clearance("abcd") == pytest.approx([5.0])
    assert clearance("ac") == [np.inf]
    assert clearance("bd") == pytest.approx([np.hypot(17, 7)])


@pytest.mark.parametrize(
    ("point", "away"), [((5, 3), 3.0), ((-3, -4), 5.0), ((13, 4), 5.0), ((0, 0), 0.0), ((10, -2), 2.0)]
)
def test_distance_from_a_segment(point, away):
    ends = np.array([[0.0, 0], [10, 0]])
    turned = np.array([[0.6, -0.8], [0.8, 0.6]])
    found = _to_segment(np.array([point], float) @ turned.T + 7, ends @ turned.T + 7)
    assert found == pytest.approx([away], abs=1e-12)
    assert _to_segment(np.array([[3.0, 4.0]]), np.zeros((2, 2))) == pytest.approx([5.0])  # a segment of no length


def test_a_table_of_pairs_is_that_of_each_pair(task1, rng):
    """Sensors in rows and lights in columns, also as many of the one as of the other, and one of each."""
    limits = Constraints(min_separation_deg=50, light_out_of_view=True)
    for rows, columns in ((7, 4), (5, 5), (1, 6), (6, 1), (1, 1)):
        sensors, lights = (rng.uniform((0, 0), (90, 360), (n, 2)) for n in (rows, columns))
        each = [[bool(limits.pairs(task1, s[None], k[None])[0]) for k in lights] for s in sensors]
        assert limits.pairs(task1, sensors[:, None], lights[None]).tolist() == each


@pytest.mark.parametrize(
    ("limits", "allowed"),
    [
        ((180, -180), [0, 90, 179, 180, 250, 359]), ((-180, 180), [0, 90, 179, 180, 250, 359]), ((90, 90), [90]),
        ((350, 100), [0, 90, 359]), ((100, 350), [179, 180, 250]), ((-110, -2), [250]), ((179, 540), [179, 180]),
    ],
)  # fmt: skip
def test_azimuths_grow_from_the_first_to_the_second_and_360_degrees_either_way_are_all(limits, allowed):
    """Past 360 degrees, too; both ends are among them, and at the pole any is."""
    azimuths = [0, 90, 179, 180, 250, 359]
    poses = np.array([(30.0, azimuth) for azimuth in azimuths] + [(0.0, 200.0)])
    if abs(limits[1] - limits[0]) > 360:
        with pytest.raises(InvalidInput, match="light_azimuth_deg must be two azimuths at most 360 degrees apart"):
            Constraints(light_azimuth_deg=limits)
        return
    found = Constraints(light_azimuth_deg=limits).lights(poses)
    assert found.tolist() == [azimuth in allowed for azimuth in azimuths] + [True]


def test_bodies_are_those_of_the_light_that_is_free():
    """The second of two: at the camera's distance its body of 1 touches the camera's of 1 up to 11.5 degrees."""
    lamp = SimpleNamespace
    scene = lamp(free=(1,), camera=lamp(distance=10.0), lights=(lamp(distance=3.0), lamp(distance=10.0)))
    limits = Constraints(camera_body=1.0, light_body=1.0)
    sensors, places = np.array([[30.0, 40.0]]), np.array([[30.0 + away, 40.0] for away in (0.0, 11.0, 12.0, 50.0)])
    assert limits.pairs(scene, sensors, places).tolist() == [False, False, True, True]
    scene.free = (0,)
    assert limits.pairs(scene, sensors, places).all()


def test_a_clearance_is_asked_where_all_required_edges_are_seen():
    """Of poses from which some are, some are not: such a pose is not allowed, however far apart those are that are."""
    task1 = scenes.load("task1")
    poses = np.array([(polar, azimuth) for polar in (20.0, 60.0, 100.0, 150.0) for azimuth in (15.0, 140.0, 260.0)])
    seen = projected_edges(Pictures.of(task1, poses)).visible
    assert (seen.any(1) & ~seen.all(1)).any()
    allowed = Constraints(sensor_polar_deg=(0, 180), min_clearance_px=1e-6).sensors(task1, poses)
    assert allowed.tolist() == seen.all(1).tolist()
    assert allowed.any()
