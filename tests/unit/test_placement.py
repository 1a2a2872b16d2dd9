"""The part's place as an unknown: what it does to features, the adjustment, statuses, budget; where it is found."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import measure
import planner
import render
import scenes
from imaging.features.placing import Placing
from imaging.geometry.projection import project
from imaging.models import variance_model
from imaging.pictures import Pictures
from imaging.placed import combined, difference, placed
from measure.quantities import find
from planner.search.candidates import RayTraced
from planner.search.objective import SearchProblem, minimised
from scenes import InvalidInput, Picture
from scenes.placement import prior
from tests import placements as parts

_SMALL = {"width": 160, "height": 136, "focal_px": 600.0}  # 2 px a mm


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("placements")


@pytest.fixture(scope="module")
def block(folder):
    """The block at a station of few pixels."""
    return Picture.of(parts.scene(folder, "block", camera=_SMALL), parts.SENSOR, parts.LIGHT)


def _with(picture, **changes):
    return picture.with_scene(picture.scene.with_(**changes))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"placement": {"from": "found"}}, r"placement.from must be one of .*got 'found'"),
        ({"placement": {"from": "datums"}}, "placement.datums must be at least one edge or circle, got none"),
        ({"placement": {"datums": ["e4"]}}, "placement.datums must be left out unless placement.from is datums"),
        ({"placement": {"from": "datums", "datums": ["e4"]}}, "placement.datum_sd must be given with datums"),
        ({"placement": {"from": "datums", "datums": ["e99"], "datum_sd": 0.1}}, "must be edges or circles of the part"),
        ({"placement": {"from": "uncertain"}, "uncertainty": {"part_shift": None}}, "must be more than 0 with"),
        ({"placement": {"expected": [1, 0, 0, 0, 0, 0]}}, "placement.expected must be 0 where it is known"),
        ({"uncertainty": {"part_shift": [1, 2]}}, r"uncertainty.part_shift\[2\] must be given, got nothing"),
    ],
)
def test_what_cannot_be_is_told_in_a_line(changes, says):
    scene = scenes.load("bracket_station").with_(uncertainty={"part_tilt_deg": None})
    with pytest.raises(InvalidInput, match=says):
        scene.with_(**changes)


def test_a_task_a_floor_and_tilts_about_two_axes_are_refused(folder):
    with pytest.raises(InvalidInput, match="task must be left out"):
        scenes.load("task1").with_(placement={"from": "uncertain"}, uncertainty={"part_shift": 1.0})
    with pytest.raises(InvalidInput, match="floor and obstacles must be left out"):
        parts.scene(folder, "block", floor={"reflectance": 0.5})
    with pytest.raises(InvalidInput, match="part_tilt_deg must be limited to 15 degrees about two axes"):
        parts.scene(folder, "block", uncertainty={"part_tilt_deg": 90.0})


def test_a_displaced_part_is_the_same_part_before_a_displaced_camera(block):
    """Scipy's rotations of the part against the picture in its own frame; and places one after the other."""
    rng, camera, corners = np.random.default_rng(1), block.scene.camera, block.scene.solid.vertices
    pivot = np.array(camera.look_at)
    for _ in range(5):
        first, then = parts.drawn(rng), parts.drawn(rng, 5 * parts.MOST)
        moved = Rotation.from_rotvec(first[3:], degrees=True).apply(corners - pivot) + pivot + first[:3]
        there = placed(block, first)
        expected = project(moved, np.array(list(block.sensor)), camera)
        found = project(corners, np.array(list(there.sensor)), there.scene.camera)
        np.testing.assert_allclose(found, expected, atol=1e-9)  # margin: rounding, 4e-13 found
        twice, whole = placed(there, then), placed(block, combined(first, then))
        seen = [project(corners, np.array(list(p.sensor)), p.scene.camera) for p in (twice, whole)]
        np.testing.assert_allclose(*seen, atol=1e-9)  # margin: the same
        np.testing.assert_allclose(difference(combined(first, then), first), then, atol=1e-9)


def _lines(picture, names):
    """Normals and first ends of edges by their projected corners, and lengths."""
    solid = picture.scene.solid
    image = project(solid.vertices, np.array(list(picture.sensor)), picture.scene.camera)
    ends = np.array([image[list(solid.edge(name).ends)] for name in names])
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    return np.stack([-along[:, 1], along[:, 0]], 1) / length[:, None], ends, length


def test_slopes_of_lines_are_those_of_projected_corners(block):
    """Central differences of projections; also of many pictures at once."""
    known = Pictures.of(block.scene, np.array([list(block.sensor), [10.0, 120.0]]), np.array([[20.0, 30.0]] * 2))
    for k, sensor in enumerate(known.sensors):
        picture = Picture.of(block.scene, tuple(sensor), parts.LIGHT)
        placing = _placing(known)
        names = placing[1].names
        normal, _, length = _lines(picture, names)
        for i, u in enumerate(prior(block.scene.uncertainty)):
            step = np.eye(6)[i] * 1e-4
            there, back = (_lines(placed(picture, sign * step), names)[1] for sign in (1, -1))
            off = np.einsum("ei,eki->ek", normal, there - back) / 2e-4 * u
            expected = np.stack([off[:, 0], (off[:, 1] - off[:, 0]) / length], 1).ravel()
            np.testing.assert_allclose(placing[0].slopes[k, :, i], expected, rtol=1e-6, atol=1e-6)


def _placing(pictures):
    from imaging.features.measurand import measurands

    known = measurands(pictures)
    return Placing.of(pictures.scene, known.seen), known.seen


def test_slopes_of_circles_are_what_a_fit_through_the_moved_rim_gives():
    """Least squares through 64 projected points of a moved rim, of a plane circle by its three parameters."""
    scene = scenes.load("bracket_station").with_(
        placement={"from": "datums", "datums": ["c2", "c4"], "datum_sd": 0.002},
    )
    picture = Picture.of(scene, (20, 0), (20, 225))
    placing, seen = _placing(Pictures.of(picture))
    sensor = np.array(list(picture.sensor))
    for name in ("c2", "c4"):
        circle = scene.solid.circle(name)
        angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
        one, two = circle.axes

        def rim(parameters, circle=circle, angle=angle, one=one, two=two):
            radial = np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two
            centre = circle.centre + parameters[0] * one + parameters[1] * two
            return project(centre + (circle.radius + parameters[2]) * radial, sensor, scene.camera)

        here, along = rim(np.zeros(3)), np.roll(rim(np.zeros(3)), -1, 0) - np.roll(rim(np.zeros(3)), 1, 0)
        speed = np.linalg.norm(along, axis=1)
        normal = np.stack([-along[:, 1], along[:, 0]], 1) / speed[:, None]
        design = [((rim(e) - rim(-e)) / 2e-4 * normal).sum(1) for e in 1e-4 * np.eye(3)]
        weight = np.sqrt(speed)
        design = np.stack(design, 1) * weight[:, None]
        pivot = np.array(scene.camera.look_at)
        flat = np.concatenate(
            [circle.centre + circle.radius * (np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two)]
        )
        for i, u in enumerate(np.diag(placing.root)):
            step = np.eye(6)[i] * 1e-4
            turned = Rotation.from_rotvec(step[3:], degrees=True).apply(flat - pivot) + pivot + step[:3]
            off = ((project(turned, sensor, scene.camera) - here) * normal).sum(1) / 1e-4 * weight
            expected = np.linalg.lstsq(design, off, rcond=None)[0] * u
            number = seen.numbers(seen.circles.index(name))
            np.testing.assert_allclose(placing.slopes[number, i], expected, rtol=1e-3, atol=1e-6)  # 64 chords


def test_the_adjustment_is_the_most_likely_place_and_its_covariance_is_that_of_drawn_errors(block):
    """Against dense least squares over place and datums' errors at once; drawn errors scatter as told."""
    sd = 0.02
    picture = _with(block, placement={"datum_sd": sd})
    errors = variance_model("calibrated")(Pictures.of(picture))
    placing, adjustment = errors.measurands.placing, errors.adjustment
    noise = errors.of_features
    q, k = placing.slopes.shape
    told = np.flatnonzero(placing.datums & np.isfinite(np.diag(noise)))
    white = np.linalg.inv(np.linalg.cholesky(noise[np.ix_(told, told)]))
    scatter = np.linalg.cholesky(placing.scatter[np.ix_(told, told)] + 1e-18 * np.eye(told.size))
    dense = np.block([
        [white @ placing.slopes[told], white @ scatter], [np.eye(k), np.zeros((k, told.size))],
        [np.zeros((told.size, k)), np.eye(told.size)],
    ])  # fmt: skip
    rng = np.random.default_rng(2)
    place, off = rng.standard_normal((4000, k)), rng.standard_normal((4000, told.size)) @ scatter.T
    seen = np.zeros((4000, q))
    seen[:, told] = place @ placing.slopes[told].T + off
    seen[:, told] += rng.standard_normal((4000, told.size)) @ np.linalg.cholesky(noise[np.ix_(told, told)]).T
    target = np.concatenate([white @ seen[0, told], np.zeros(k + told.size)])
    np.testing.assert_allclose(
        adjustment.estimate(seen[:1])[0], np.linalg.lstsq(dense, target, rcond=None)[0][:k], rtol=1e-6
    )
    np.testing.assert_allclose(adjustment.posterior, np.linalg.inv(dense.T @ dense)[:k, :k], rtol=1e-6)
    gradient = errors.measurands.gradient_object
    values = seen @ adjustment.gradient(gradient).T
    truth = np.zeros((4000, q))
    truth[:, told] = off
    left = values - truth @ gradient.T
    variance = errors.variances_object + errors.placed
    ratio = left.var(0) / variance
    chance = 4 * np.sqrt(2 / 4000)
    assert (np.abs(ratio - 1) < chance).all(), ratio
    assert (left.var(0) / errors.variances_object > 1.3).all()  # negative control: without the datums' part
    assert (np.abs(ratio / 1.3 - 1) > chance).all()


def test_the_adjustments_information_is_that_of_exact_images(folder):
    """Fisher information by differences of whole images, pixel by pixel, of the same places; 1.2 % found."""
    scene = parts.scene(folder, "block", parts.EVERY["block"], camera=_SMALL)
    picture = Picture.of(scene, parts.SENSOR, parts.LIGHT)
    found = find(parts.seen(picture, np.zeros(6))[None], picture, "arrangement")
    told, exact = (
        np.diag(np.linalg.inv(each)) for each in (found.adjustment.information[0], parts.exact_information(picture))
    )
    np.testing.assert_allclose(told, exact, rtol=0.03)
    fewer = Placing.of(scene, found.known.seen)
    less = np.where(np.arange(len(fewer.datums)) < 4, fewer.datums, False)
    lost = replace(fewer, datums=less)
    assert (np.diag(lost.adjusted(found.of_datums).posterior[0]) > 1.5 * exact).all()  # negative control: two datums


def test_a_known_place_changes_nothing_and_an_uncertain_one_adds_what_the_budget_has(block):
    known = _with(block, placement={"from": "known", "datums": [], "datum_sd": None})
    unsure = _with(known, placement={"from": "uncertain"})
    errors = [variance_model("calibrated")(Pictures.of(each)) for each in (known, unsure)]
    np.testing.assert_array_equal(errors[0].variances_object, errors[1].variances_object)
    assert not errors[0].placed.any()
    rows = [{row.source: row.contribution for row in each.contributions} for each in planner.budget(unsure)]
    of_place = [sum(u**2 for name, u in row.items() if name.startswith("part_")) for row in rows]
    np.testing.assert_allclose(errors[1].placed, of_place, rtol=1e-5)
    assert (minimised(errors[1], "object") > 100 * minimised(errors[0], "object")).all()


def test_a_plan_minimises_what_the_place_leaves_open_too(block):
    """A setting's number is the worst of noise, datums and place together, over the tolerance, also at a glance."""
    scene = _with(block, placement={"datum_sd": 0.02}).scene
    problem = SearchProblem.of(scene, "calibrated", "object")
    sensor, light = np.array(parts.SENSOR), np.array(parts.LIGHT)
    errors = variance_model("calibrated")(Pictures.of(Picture.of(scene, parts.SENSOR, parts.LIGHT)))
    whole = (errors.variances_object + errors.placed) / 0.05**2
    assert RayTraced.of(problem, sensor, light).value == pytest.approx(whole.max(), rel=1e-9)
    assert problem.values(sensor[None], light[None])[0] == pytest.approx(whole.max(), rel=1e-3)
    assert (errors.variances_object / 0.05**2).max() < 0.8 * whole.max()  # negative control: noise alone


def test_the_budget_of_a_place_from_datums_has_them_in_place_of_the_fixture(block):
    sd = 0.002
    picture = _with(block, placement={"datum_sd": sd}, uncertainty={"sensor_distance": 0.5})
    rows = {row.source: row for row in planner.budget(picture)["length"].contributions}
    assert rows["datums"].share > 0.7
    assert rows["datums"].contribution == pytest.approx(sd, rel=0.5)  # of two sides, each known so well at both ends
    assert max(row.contribution for name, row in rows.items() if name.startswith("part_")) < 0.05 * sd
    fixed = _with(picture, placement={"from": "uncertain", "datums": [], "datum_sd": None})
    beside = {row.source: row for row in planner.budget(fixed)["length"].contributions}
    assert rows["sensor_distance"].contribution < 0.05 * beside["sensor_distance"].contribution  # scale comes from them


def test_what_datums_do_not_tell_has_a_status_and_a_reason(block):
    """One edge tells nothing along itself, nor of the height: it matters to a width, less to nothing of the part."""
    one = planner.predict(_with(block, placement={"datums": ["e4"]})).measurands
    assert {each.status for each in one} == {"unplaced"}
    assert "tell less of part_" in one[0].reason
    assert planner.predict(block).status == "ok"
    sure = _with(block, placement={"datums": ["e4"]}, uncertainty={"part_shift": 1e-4, "part_tilt_deg": 1e-3})
    assert "unplaced" not in {each.status for each in planner.predict(sure).measurands}  # known before well enough


@pytest.fixture(scope="module")
def found(folder):
    """A block somewhere, its picture, its true place."""
    camera = {"width": 208, "height": 176, "focal_px": 780.0}
    picture = Picture.of(parts.scene(folder, "block", camera=camera), parts.SENSOR, parts.LIGHT)
    there = np.array([4.0, -3.0, 1.5, 2.0, -2.0, 2.5])
    (image,) = render.expose(parts.seen(picture, there), picture.scene.noise, np.random.default_rng(3), 1)
    return picture, image, there


def test_a_part_is_found_and_measured_where_it_lies(found):
    picture, image, there = found
    where = measure.locate(image, picture)
    assert where.status == "ok", where.reason
    pull = difference(there, where.placement) / np.sqrt(np.diag(where.covariance))
    assert np.abs(pull).max() < 5
    told = measure.measure(image, where.picture)
    assert (told.status == "ok").all()
    assert (np.abs(told.value - told.nominal) < 5 * told.sigma).all()
    as_said = measure.measure(image, picture.unlit(), estimator="gradient")  # negative control: there is none
    assert not (as_said.status == "ok").any()


def test_a_part_that_may_lie_the_other_way_round_is_refused_by_name(found):
    """A block looks the same after half a turn."""
    picture, image, _ = found
    any_way = _with(picture, uncertainty={"part_tilt_deg": [{"half_width": w} for w in (3, 3, 180)]})
    where = measure.locate(image, any_way)
    assert where.status == "ambiguous"
    assert where.reason.startswith("two places explain the picture equally well: shift (")
    assert where.reason.count("turn (") == 2
    assert not np.isfinite(where.placement).any()
    told = measure.bundle([(image, any_way)], "unknown", estimator="gradient")
    assert set(told.status) == {"ambiguous"}
    assert all(reason.startswith("picture 1: two places explain the picture") for reason in told.reason)
    nothing = measure.locate(np.full_like(image, 16.0), picture)
    assert (nothing.status, nothing.explained) == ("not_visible", 0.0)
    with pytest.raises(InvalidInput, match=r"placement\.from must be datums or board to find the part, got 'known'"):
        measure.locate(image, _with(picture, placement={"from": "known", "datums": [], "datum_sd": None}))
