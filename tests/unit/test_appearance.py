"""Signals beside edges against N.L / r^2 and shadow rays through boxes, written out; contrast and noise from them."""

import numpy as np
import pytest

import planner
import render
import scenes
from imaging.geometry.projection import edge_points
from imaging.light.appearance import signal
from imaging.light.behind import _on_floor, behind, floor_signal
from imaging.light.edge_sides import edge_contrast, paper_contrast2, side_signals, sides_of_one
from imaging.pictures import Pictures
from scenes import Floor, Noise, Obstacle, Picture
from tests.oracle import axes

FRACTIONS = np.array([0.07, 0.23, 0.41, 0.58, 0.77, 0.93])
EDGES = ("e4", "e9", "e7", "e11", "e2", "e6")  # the top's sides, and two that stand on the floor
_THIN = 1e-7  # cm: how far inside a box a ray must pass to be stopped


class Boxes:
    """A block at the origin, obstacles beside it and a floor, all diffuse; nothing of the planner but the numbers."""

    def __init__(self, scene, sensor, light):
        places = [((0, 0, 0), scene.object.size), *((o.corner, o.size) for o in scene.obstacles)]
        self.boxes = [(np.array(c, float), np.array(c, float) + np.array(s)) for c, s in places]
        self.floor, self.white = scene.floor, scene.camera.exposure
        self.albedo = (1 - scene.material.specular_fraction) * scene.material.diffuse_reflectance
        self.eye, self.lamp = scene.camera.distance * axes(sensor)[0], scene.light.distance * axes(light)[0]
        self.distance = scene.light.distance

    def through(self, box, start, ray):
        """Where a ray is inside a box: (from, to, the axis of the face by which it enters)."""
        low, high = box
        with np.errstate(divide="ignore", invalid="ignore"):
            one, two = (low + _THIN - start) / ray, (high - _THIN - start) / ray
        enter, leave = np.fmin(one, two), np.fmax(one, two)
        return enter.max(), leave.min(), int(enter.argmax())

    def free(self, start, stop):
        """Whether no box stands between two points."""
        spans = (self.through(box, start, stop - start) for box in self.boxes)
        # margin: where a ray passes, no tolerance
        return not any(enter < leave and leave > 1e-9 and enter < 1 - 1e-9 for enter, leave, _ in spans)

    def level(self, point, normal, albedo):
        away = self.lamp - point
        if away @ normal <= 0 or not self.free(point + 1e-6 * normal, self.lamp):
            return 0.0
        far = np.linalg.norm(away)
        return self.white * albedo * (away @ normal) / far * (self.distance / far) ** 2

    def behind(self, point):
        """What the sensor sees past a point that nothing hides."""
        ray = point - self.eye
        hits = []
        for box in self.boxes:
            enter, leave, axis = self.through(box, self.eye, ray)
            if enter < leave and enter > 1 + 1e-9:
                normal = -np.sign(ray[axis]) * np.eye(3)[axis]
                hits.append((enter, normal, self.albedo))
        t = (self.floor.height - self.eye[2]) / ray[2] if self.floor and ray[2] < 0 else np.inf
        place = self.eye + (t if np.isfinite(t) else 0.0) * ray
        if np.isfinite(t) and np.abs(place[:2]).max() <= self.floor.half_side:
            hits.append((t, np.array([0, 0, 1.0]), self.floor.reflectance))
        if not hits:
            return 0.0
        t, normal, albedo = min(hits, key=lambda hit: hit[0])
        return self.level(self.eye + t * ray, normal, albedo)

    def sides(self, point, normals):
        """Signals on both sides of an edge of the block at a point."""
        facing = [normal @ (self.eye - point) > 0 for normal in normals]
        outside = point + 1e-5 * np.sum(normals, 0)  # off both faces
        if not any(facing) or not self.free(outside, self.eye):
            return np.zeros(2)
        return np.array(
            [
                self.level(point, n, self.albedo) if seen else self.behind(outside)
                for n, seen in zip(normals, facing, strict=True)
            ]
        )


def crowded(task1, **changes):
    """Task1 on a floor, between an upright and a cube."""
    obstacles = Obstacle(corner=(-3, 0, 0), size=(2, 7.5, 8)), Obstacle(corner=(14, 3, 0), size=(3, 3, 5))
    return task1.model_copy(update={"floor": Floor(reflectance=0.3), "obstacles": obstacles, **changes})


def glanced(scene, sensor, light):
    """One picture without light between surfaces."""
    return Pictures(scene, np.array(sensor), (np.array(light),))


def near_a_border(rest, point, normals):
    """Whether a shift by a hundredth of a millimetre changes what is seen or lit by more than shading does."""
    here = rest.sides(point, normals)
    steps = 1e-3 * np.concatenate([np.eye(3), -np.eye(3)]) * (1 - np.abs(np.sum(normals, 0)))
    return any(np.abs(rest.sides(point + step, normals) - here).max() > 0.05 for step in steps)


@pytest.mark.parametrize("floor", [True, False])
def test_side_signals_of_a_crowded_scene(task1, rng, floor):
    """40 random pairs of poses, six edges, six points: lit, in shadow, what is seen behind; to 1e-5 of the level."""
    scene = crowded(task1) if floor else crowded(task1, floor=None)
    normals = scene.solid.normals
    kinds, skipped = {"lit": 0, "shadow": 0, "behind": 0, "hidden": 0}, 0
    for _ in range(40):
        sensor, light = ((rng.uniform(5, 80), rng.uniform(0, 360)) for _ in range(2))
        points = edge_points(scene.solid, EDGES, FRACTIONS)
        ours = side_signals(glanced(scene, sensor, light), EDGES, points)
        rest = Boxes(scene, sensor, light)
        for e, name in enumerate(EDGES):
            pair = normals[list(scene.solid.edge(name).faces)]
            for i, point in enumerate(points[e]):
                if near_a_border(rest, point, pair):
                    skipped += 1
                    continue
                expected = rest.sides(point, pair)
                assert ours[e, :, i] == pytest.approx(expected, rel=2e-5, abs=1e-9), (sensor, light, name, i)
                facing = [n @ (rest.eye - point) > 0 for n in pair]
                for seen, level in zip(facing, expected, strict=True):
                    kinds[
                        "hidden" if not expected.any() else "lit" if seen and level else "shadow" if seen else "behind"
                    ] += 1
    assert skipped < 0.05 * 40 * 36
    assert min(kinds["lit"], kinds["shadow"], kinds["hidden"]) > 100
    assert kinds["behind"] > 300


@pytest.mark.parametrize(("sensor", "light"), [((40, 290), (30, 240)), ((55, 140), (60, 200))])
def test_sides_of_many_edges_of_one_picture_are_those_of_each(task1, sensor, light):
    """At one point of each edge and three of some; of a part with inner edges, with light between its faces."""
    for scene in (crowded(task1), scenes.load("bracket")):
        pictures = Pictures.of(scene, sensor, light)
        edges = scene.solid.sharp
        which = np.concatenate([np.arange(len(edges)), [0, 0, 3]])
        fractions = np.linspace(0.1, 0.9, which.size)
        ends = scene.solid.vertices[[edge.ends for edge in edges]][which]
        points = ends[:, 0] + fractions[:, None] * (ends[:, 1] - ends[:, 0])
        found = sides_of_one(pictures, edges, which, points)
        each = [
            side_signals(pictures, (edges[number].name,), point[None, None])[0, :, 0]
            for number, point in zip(which, points, strict=True)
        ]
        levels = np.array(each)
        assert pytest.approx(levels, rel=1e-9, abs=1e-9) == found.T
        lit = found > 0
        assert lit.any(0).mean() > 0.3  # margin: some are hidden
        assert not lit.any(0).all()
    assert sides_of_one(pictures, (), np.zeros(0, int), np.zeros((0, 3))).shape == (2, 0)


def test_the_plain_formula_notices_floor_shadow_and_obstacle(task1):
    """Negative control: each of them left out on one side only."""
    scene, sensor, light = crowded(task1), (40, 20), (35, 200)
    points = edge_points(scene.solid, EDGES, FRACTIONS)
    expected = side_signals(Pictures.of(scene, sensor, light), EDGES, points)
    for changes in ({"floor": None}, {"obstacles": ()}, {"floor": Floor(reflectance=0.31)}):
        other = side_signals(Pictures.of(crowded(task1, **changes), sensor, light), EDGES, points)
        assert np.abs(other - expected).max() > 1  # margin: one grey level, when the formula is right to 1e-9


def test_eq_1_has_no_fall_off(task1):
    """The paper's contrast on the crowded scene: the same sides, irradiance as at the reference point."""
    scene, sensor, light = crowded(task1), (40, 20), (35, 160)
    pictures = glanced(scene, sensor, light)
    points, lamp = edge_points(scene.solid, EDGES, FRACTIONS), 100 * axes(light)[0]
    sides = side_signals(pictures, EDGES, points)
    away = pictures.sensor_at - points[:, 0]
    facing = np.array([
        [scene.solid.normals[f] @ away[e] > 0 for f in scene.solid.edge(n).faces] for e, n in enumerate(EDGES)
    ])  # fmt: skip
    both = facing.all(1) & (sides > 0).all((1, 2))
    assert both.sum() >= 1
    away = np.linalg.norm(lamp - points, axis=-1)
    expected = ((sides[:, 0] - sides[:, 1]) * (away / 100) ** 2) ** 2
    assert paper_contrast2(pictures, EDGES, FRACTIONS)[both] == pytest.approx(expected[both], rel=1e-9)


def test_contrast_and_noise_of_both_sides(task1):
    """Difference of the levels; the mean of sigma^2 + gain x signal + 1/12 on both sides."""
    noise = Noise(sigma=1.5, gain=0.25, dark_level=20.0, bits=8)
    for scene in (task1, crowded(task1)):
        scene = scene.model_copy(update={"noise": noise})
        pictures = Pictures.of(scene, (40, 20), (35, 160))
        sides = side_signals(pictures, EDGES, edge_points(scene.solid, EDGES, FRACTIONS))
        found = edge_contrast(pictures, EDGES, FRACTIONS)
        assert sides.max() < 180  # margin: below the end of the scale at 235
        assert found.squared == pytest.approx((sides[:, 0] - sides[:, 1]) ** 2, rel=1e-9, abs=1e-9)
        assert sides.min() > -0.1  # margin: light between faces is interpolated, and a shadow's a little less than none
        assert found.noise_variance == pytest.approx(1.5**2 + 1 / 12 + 0.25 * sides.clip(0).mean(1), rel=1e-9)


def test_the_end_of_the_scale_takes_contrast_away(task1):
    """At 255 a bright side shows 255 - 20 and hardly any noise; with both sides there, nothing can be measured."""
    light, sensor = (40, 140), (40, 140)
    plain = Pictures.of(task1, sensor, light)
    sides = side_signals(plain, ("e7",), edge_points(task1.solid, ("e7",), FRACTIONS))
    assert (sides > 0).all()
    for factor, step in ((235 / sides[:, 0].min() + 0.3, None), (235 / sides.min() + 0.3, 0.0)):
        camera = task1.camera.model_copy(update={"exposure": factor * task1.camera.exposure})
        found = edge_contrast(
            Pictures.of(task1.model_copy(update={"camera": camera}), sensor, light), ("e7",), FRACTIONS
        )
        expected = 235 - factor * sides[:, 1] if step is None else np.zeros((1, 6))
        assert np.sqrt(found.squared) == pytest.approx(np.abs(expected), abs=0.01)
        # margin: of two sides one has hardly any noise: half is left, and rounding to levels
        assert (found.noise_variance < 0.6 * task1.noise.variance).all()
        # margin: the order is said
        assert np.abs(factor * (sides[:, 0] - sides[:, 1])).min() > np.sqrt(found.squared).max()  # without the end
    over = task1.model_copy(update={"camera": camera})
    assert planner.predict(over, sensor, light).status == "low_contrast"


@pytest.fixture
def two_lights(task1):
    """A second light, at 150 cm."""
    both = task1.light, scenes.Light(distance=150.0)
    noise = Noise(sigma=2.4, dark_level=20.0)
    return task1.model_copy(update={"name": "two lights", "light": None, "several_lights": both, "noise": noise})


def test_lights_add_up(two_lights, task1):
    """With one light below the horizon the other is alone; together their signals are the sum."""
    poses, below = [(35, 160), (50, 60)], (180, 0)
    sensor, points = (40, 20), edge_points(task1.solid, EDGES, FRACTIONS)
    both, *each = (
        side_signals(Pictures.of(Picture.of(two_lights, sensor, lights)), EDGES, points)
        for lights in (poses, [poses[0], below], [below, poses[1]])
    )
    assert both == pytest.approx(sum(each), rel=1e-12)
    assert all(part.max() > 10 for part in each)
    alone = planner.predict(two_lights, sensor, poses).variance_px2
    assert np.isfinite(alone)
    assert alone != pytest.approx(planner.predict(two_lights, sensor, [poses[0], below]).variance_px2, rel=0.01)


@pytest.mark.render
def test_the_rendered_image_of_two_lights_is_what_the_planner_says(two_lights):
    """Middle of the top face, to 3e-3 (0.5e-3 in single precision); each light alone is not enough."""
    poses, sensor, middle = [(35, 160), (50, 60)], (0, 0), np.array([[6.25, 3.75, 2.5]])
    pictures = Pictures.of(Picture.of(two_lights, sensor, poses))
    expected = signal(pictures, middle, np.array([0, 0, 1.0]), 1)[0]
    image = render.image(two_lights, sensor, poses, effects=("attached_shadow", "fall_off", "lens_blur")) - 20.0
    out, right, down = axes(sensor)
    x, y = (n + 800 * (middle[0] @ axis) / (100 - middle[0] @ out) for n, axis in ((127.5, right), (119.5, down)))
    assert image[round(y), round(x)] == pytest.approx(expected, rel=3e-3)
    one = render.image(two_lights, sensor, [poses[0], (180, 0)], effects=("attached_shadow", "fall_off")) - 20.0
    assert one[round(y), round(x)] < 0.9 * expected  # margin: one light alone gives 58 %


@pytest.mark.parametrize("height", [-20.0, -1.0])
@pytest.mark.parametrize(("place", "met"), [((0, 0), True), ((2.9, -2.9), True), ((3.1, 0), False), ((0, -3.1), False)])
def test_rays_that_meet_the_floor(height, place, met):
    """Within its half side in x and y, however deep it lies; not behind what they meet before, nor looking up."""
    floor, eye = Floor(reflectance=0.5, height=height, half_side=3.0), np.array([40.0, 30.0, 60.0])
    target = np.array([*place, height])
    point = eye + 0.7 * (target - eye)
    vectors = np.stack([target - eye, target - eye, eye - target])
    there, ahead = _on_floor(floor, np.tile(point, (3, 1)), vectors, np.array([np.inf, 0.2, np.inf]))
    assert ahead.tolist() == [met, False, False]
    assert there[0] == pytest.approx(target if met else point)
    assert there[1:] == pytest.approx(np.tile(point, (2, 1)))


def test_only_what_is_wanted_is_looked_for_behind(task1):
    """Beside the block there is the floor; where it is not asked for, 0."""
    scene = task1.model_copy(update={"floor": Floor(reflectance=0.4)})
    pictures = Pictures.of(scene, (30.0, 135.0), (15.0, 315.0))
    points = edge_points(scene.solid, EDGES[:1], FRACTIONS)[0] + [0.0, 0.0, 3.0]
    every = behind(pictures, points, np.ones(6, bool), ())
    some = np.array([True, False, True, True, False, False])
    assert (every > 0).any()
    assert (behind(pictures, points, some, ()) == np.where(some, every, 0.0)).all()


def test_floor_signal(task1):
    """Albedo times the cosine at a horizontal plane over the squared distance; 0 where not wanted."""
    scene = task1.model_copy(update={"floor": Floor(reflectance=0.4, height=-2.0)})
    pictures = Pictures.of(scene, (30.0, 135.0), (40.0, 200.0))
    places = np.array([[30.0, -20.0, -2.0], [-25.0, 30.0, -2.0], [40.0, 5.0, -2.0]])
    lamp = scene.light.distance * axes((40.0, 200.0))[0]
    away = lamp - places
    size = np.linalg.norm(away, axis=1)
    expected = scene.camera.exposure * 0.4 * away[:, 2] / size * (scene.light.distance / size) ** 2
    assert floor_signal(pictures, places, np.ones(3, bool)) == pytest.approx(expected)
    some = np.array([True, False, True])
    assert floor_signal(pictures, places, some) == pytest.approx(np.where(some, expected, 0.0))
