"""Parts of a rim's image: where lines cross its outline, cells beside it, hidden points, and others that come near."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

import scenes
from imaging.features import limb_look, rim_look, rim_sides
from imaging.features.rim_look import RimLook
from imaging.features.rim_outline import _crossed, zero_of_steps
from imaging.pictures import Pictures
from measure.features.points import EachPoint
from measure.features.rim_fit import RimFit, _median
from scenes import Circle
from scenes.viewpoint import Viewpoint


@pytest.fixture(scope="module")
def plate():
    return scenes.load("plate")


def test_second_derivative_of_steps_between_cells(rng):
    """Of steps beside outlines, blurred by a Gaussian of one standard deviation: as each step alone says."""
    levels, where = rng.uniform(20, 200, (4, 11, 48)), rng.uniform(-1, 1, (4, 11))
    at = rng.uniform(-3, 3, (4, 5))
    value, slope = rim_look._second(rim_look._steps(levels, where), where, at)
    steps = np.diff(levels) * rim_look._SHARES[:, None]
    for row, k in np.ndindex(at.shape):
        away = where[row, :, None] + rim_look._ENDS - at[row, k]
        bell = steps[row] * np.exp(-(away**2) / 2)
        assert value[row, k] == pytest.approx((bell * away).sum(), rel=1e-10)
        assert slope[row, k] == pytest.approx((bell * (away**2 - 1)).sum(), rel=1e-10)
    alone = rim_look._second_alone(rim_look._steps(levels, where), where, at)
    assert alone == pytest.approx(value, rel=1e-10, abs=1e-8)


def test_lines_beside_each_other_round_a_rim_and_at_an_arc_s_ends(rng):
    """Those of numbers below the first and beyond the last go on round a closed rim, and stay at an arc's ends."""
    lines, numbers = rng.uniform(0, 1, (5, 3)), rng.integers(-4, 8, (6, 2, 3))
    for closed, kept in ((True, numbers % 5), (False, np.clip(numbers, 0, 4))):
        onward = (numbers + 1) % 5 if closed else np.clip(numbers + 1, 0, 4)
        found = rim_look._on_lines(lines, numbers, closed)
        np.testing.assert_array_equal(found[0], lines[kept, np.arange(3)])
        np.testing.assert_array_equal(found[1], lines[onward, np.arange(3)])


@pytest.mark.parametrize("count", [1, 2, 7, 30])
def test_the_middle_of_some_numbers_is_their_median(rng, count):
    values = rng.normal(size=count)
    assert _median(values) == np.median(values)
    assert np.isnan(_median(values[:0]))


def test_zero_of_steps(rng):
    """Of 30 sets of five weighted steps up to a third of a standard deviation off: where their bells balance."""
    where, weight = rng.uniform(-0.35, 0.3, (30, 5)), rng.uniform(0.2, 1.5, 5)
    found = zero_of_steps(where, weight)
    for places, at in zip(where, found, strict=True):

        def balance(z, places=places):
            return float((weight * (places - z) * np.exp(-((places - z) ** 2) / 2)).sum())

        assert at == pytest.approx(brentq(balance, -0.4, 0.4, xtol=1e-14), abs=1e-10)


def test_where_lines_first_cross_an_outline():
    """Lines along a slanted normal beside two places, through a zigzag of three pieces, each line by itself."""
    zigzag = np.array([[-3.0, 1.0], [-0.5, 2.0], [1.0, -1.5], [4.0, 2.5]])
    ends = np.stack([zigzag[:-1], zigzag[1:]], 1)
    places, beside = np.array([[0.0, 0.2], [0.5, -0.3]]), np.array([-2.0, -0.7, 0.1, 1.9, 9.0])
    normals = np.array([[0.28, 0.96], [-0.6, 0.8]])
    found = _crossed(ends, places, normals, beside[None] * [[1.0], [0.9]])
    for m in range(2):
        for j, aside in enumerate(beside * (1.0, 0.9)[m]):
            start = places[m] + aside * np.array([-normals[m, 1], normals[m, 0]])
            met = []
            for one, two in ends:
                away, share = np.linalg.solve(np.column_stack([normals[m], one - two]), one - start)
                met += [away] if 0 <= share < 1 else []
            expected = min(met, key=abs) if met else np.nan
            assert found[m, j] == pytest.approx(expected, abs=1e-12, nan_ok=True)
    assert np.isnan(found[:, -1]).all()
    assert np.isfinite(found[:, :4]).sum() >= 5


@pytest.mark.parametrize("polar", [25.0, 50.0])
def test_what_is_hidden_of_a_bores_far_rim_has_no_level(plate, polar):
    """From above: the line of sight to a point of it leaves the bore through the near rim, or does not."""
    near, far = sorted(plate.solid.circles, key=lambda circle: -circle.centre[2])
    pictures = Pictures.of(plate, np.array([polar, 20.0]), np.array([35.0, 30.0]))
    angle = far.angles(rim_sides.RIM_POINTS)
    points = far.at(angle)
    toward = pictures.sensor_at - points
    above = points + toward * ((near.centre[2] - points[:, 2]) / toward[:, 2])[:, None]
    aside = np.linalg.norm(above - near.centre, axis=1) / near.radius
    plain, wall = rim_sides._sides_at(pictures, far, angle, False)
    assert (plain[aside > 1.01] == 0).all()
    assert (wall[aside > 1.01] == 0).all()
    assert (wall[aside < 0.99] > 0).any()
    assert 0.1 < (aside > 1.01).mean() < 0.9


def test_a_far_rim_that_is_an_arc_comes_as_near_as_a_whole_one(plate):
    """Within a step of its places, where there is one, and nowhere else: of a far rim cut to either half."""
    near, far = sorted(plate.solid.circles, key=lambda circle: -circle.centre[2])
    pictures = Pictures.of(plate, np.array([25.0, 0.0]), np.array([35.0, 30.0]))
    angle = near.angles(rim_sides.RIM_POINTS)

    def told(*others: Circle) -> np.ndarray:
        solid = replace(plate.solid, circles=(near, *(c for c in others if c.ends is None)),
                        arcs=tuple(c for c in others if c.ends is not None))  # fmt: skip
        scene = SimpleNamespace(solid=solid, camera=plate.camera)
        seen = SimpleNamespace(scene=scene, sensors=pictures.sensors, viewpoint=pictures.viewpoint)
        return rim_sides.clearance(seen, near, angle)

    halves = [replace(far, ends=far.centre + far.radius * side * np.array([[0.0, 1, 0], [0.0, -1, 0]]))
              for side in (1, -1)]  # fmt: skip
    whole, none, (one, other) = told(far), told(), (told(half) for half in halves)
    assert (whole < none).any()
    np.testing.assert_allclose(np.minimum(one, other), whole, atol=1.2)
    assert (none - whole > 5).any()
    assert max((half - whole > 3).mean() for half in (one, other)) > 0.2


def test_places_of_a_rim_are_less_than_a_smoothing_scale_apart(plate):
    """0.7 of one, in whole times the usual number, up to twelve; the perimeter is an ellipse's, seen from afar."""
    circle = max(plate.solid.circles, key=lambda each: each.centre[2])
    for focal, times in ((400.0, 2), (800.0, 3), (1600.0, 5), (6000.0, 12)):
        camera = plate.camera.model_copy(update={"focal_px": focal, "width": 2000, "height": 1900})
        pictures = Pictures.of(
            plate.model_copy(update={"camera": camera}), np.array([20.0, 70.0]), np.array([15.0, 200.0])
        )
        axes = focal / 50 * np.array([1.0, np.cos(np.radians(20))])
        perimeter = np.pi * (3 * axes.sum() - np.sqrt((3 * axes[0] + axes[1]) * (axes[0] + 3 * axes[1])))
        assert times == min(np.ceil(perimeter / (0.7 * plate.locator.scale_px * 64)), 12)
        assert rim_look.look(pictures, circle).shift.size == 64 * times


def test_cells_that_are_looked_at_closely():
    """Both beside the outline, and either of two on one side that differ by more than 2 % of the brightest level."""
    levels = np.full((1, 2, 48), 100.0)
    levels[0, 0, 24:] = 30.0  # over the outline nothing is told by a difference
    levels[0, 1, 5] = 97.9
    levels[0, 1, 40:] = 101.9
    expected = np.zeros((1, 2, 48), bool)
    expected[..., [23, 24]] = True
    expected[0, 1, [4, 5, 6]] = True
    assert np.array_equal(rim_look._uneven(levels), expected)
    levels[0, 1, 40:] = 102.2
    expected[0, 1, [39, 40]] = True
    assert np.array_equal(rim_look._uneven(levels), expected)


def test_between_places_of_a_rim(rng):
    """Linear, round the end too; a share where both neighbours have one, at a place itself as there."""
    count = 7
    circle = Circle("c1", np.zeros(3), np.array([0.0, 0.0, 1.0]), 1.0, 0, (), True)
    known = RimLook(
        *rng.uniform(1, 5, (3, count)),
        np.arange(count) > 2,
        np.array([1.0, 0.8, 0.0, 0.6, 1.0, 0.4, 0.0]),
        circle,
    )
    angles = (np.arange(count) + 0.5) * 2 * np.pi / count
    here = known.at(angles)
    assert here.share == pytest.approx(known.share)
    for name in ("shift", "squared", "noise_variance"):
        assert getattr(here, name) == pytest.approx(getattr(known, name))
    between = known.at(angles + 0.3 * 2 * np.pi / count)
    assert between.share == pytest.approx([0.94, 0, 0, 0.72, 0.82, 0, 0])
    for name in ("shift", "squared", "noise_variance"):
        value = getattr(known, name)
        assert getattr(between, name) == pytest.approx(0.7 * value + 0.3 * np.roll(value, -1))


def test_a_limbs_places_near_an_edge_that_is_seen(monkeypatch):
    """In two pictures: of an edge along x, seen in part or not at all, and of a rim of which single pieces are seen.

    A rim's pieces count each by itself, an edge as a whole where anything of it is seen.
    """
    at = np.array([[[0.0, 1.0], [5.0, 2.9], [9.0, 3.1], [12.0, -2.9]]] * 2)
    steady = []
    seen_edge = np.array([[0.5] * 16 + [1.0], [0.998] * 17])  # at one end in the first picture, nowhere in the second

    def first_face(bodies, eye, way, own):
        assert eye.shape == way.shape
        return None, seen_edge

    def image(places, sensors, camera):
        return np.broadcast_to(places[:, :2], (len(sensors), len(places), 2))

    for name, stand_in in {
        "clear_of_ends": lambda outline, scene: np.array([[True, True, True, True], [True, False, True, True]]),
        "unlent": lambda pictures, outline: np.ones((2, 4), bool),
        "unlent_by_faces": lambda pictures, curved, outline: np.ones((2, 4), bool),
        "reach": lambda *_: 3.0, "first_face": first_face,
        "from_axis": image, "steady": lambda *given: steady.append(given) or np.ones((2, 4), bool),
    }.items():  # fmt: skip
        monkeypatch.setattr(limb_look, name, stand_in)
    solid = SimpleNamespace(
        rims=(), lines=(SimpleNamespace(ends=(1, 0)),), vertices=np.array([[-1.0, 0, 7], [6.0, 0, 7]])
    )
    camera, locator = SimpleNamespace(most_blur_px=1.0), SimpleNamespace(scale_px=1.0)
    scene = SimpleNamespace(solid=solid, bodies=SimpleNamespace(is_convex=False), camera=camera, locator=locator)
    eyes = Viewpoint(np.array([[0, 0, 90.0], [0, 0, 80.0]]))
    pictures = SimpleNamespace(scene=scene, viewpoint=eyes, sensors=np.zeros((2, 2)))
    outline = SimpleNamespace(at=at, arc=np.array([1.0, 2.0, np.nan, 3.0]))
    look = SimpleNamespace(good=np.array([[True, False, True, True]] * 2), squared=np.full((2, 4), 9.0))
    found = limb_look.clear_of_others(pictures, None, outline, look)
    assert found.tolist() == [[False, False, True, True], [True, False, True, True]]
    lit, still, arc, far = steady[0]
    assert lit.tolist() == [[9, 0, 9, 9]] * 2
    assert (still == 0).all()
    assert (arc.tolist(), far) == ([1, 2, 0, 3], 3.0)


def test_places_that_show_less_than_half_their_contrast_are_left_out_whatever_the_light():
    """Beside the middle of those that are valid and weigh; of a light a tenth as bright the same."""
    told, weights = np.array([40.0, 40, 40, 40, 20, 20, 20]), np.array([1.0, 1, 1, 1, 1, 1, 0])
    tool = RimFit(np.ones((7, 3)), weights, np.zeros(7), "ok", None, contrast=told)
    bright = np.array([40.0, 40, 40, 19, 20, -2, 0])
    shown = np.stack([bright, bright / 10, told / 40])
    valid = np.array([[1] * 7, [0] + [1] * 6, [1] * 7], bool)
    clear = np.array([1, 1, 1, 0, 1, 0, 1], bool)
    assert tool.as_expected(valid, shown).tolist() == (valid & np.stack([clear, clear, valid[2]])).tolist()
    assert tool.as_expected(np.zeros((1, 7), bool), shown[:1]).tolist() == [[False] * 7]
    assert replace(tool, contrast=None).as_expected(valid, shown).tolist() == valid.tolist()


def test_crossings_far_from_the_circle_through_all_are_left_out_where_the_light_is_known():
    """Of the border of a shadow, where the rim's own is gone; of a light that is not known all count."""
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    design = 10 * np.stack([np.cos(angle), np.sin(angle), np.ones(60)], 1)
    tool = RimFit(design, np.ones(60), np.zeros(60), "ok", None, contrast=np.full(60, 40.0))
    offset = np.stack([design @ [0.01, -0.02, 0.03], np.zeros(60)])
    offset[0, 7] += 2.5
    points = EachPoint(offset, np.ones((2, 60), bool), np.full((2, 60), 40.0))
    fit, errors, used = tool.fitted(points)
    assert used.tolist() == [[k != 7 for k in range(60)], [True] * 60]
    assert errors == pytest.approx(np.array([[0.01, -0.02, 0.03], [0.0, 0.0, 0.0]]), abs=1e-12)
    assert not fit[0, :, 7].any()
    pulled = replace(tool, contrast=None).fitted(points)
    assert pulled[2].all()
    assert abs(pulled[1][0, 2] - 0.03) > 1e-3
