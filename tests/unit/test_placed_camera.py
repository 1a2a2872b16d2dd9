"""Focal length and distortion as unknowns beside the part's place: derivatives, priors, statuses, budget."""

import cv2
import numpy as np
import pytest
from scipy.special import chdtri

import measure
import planner
import render
import scenes
from imaging.features.displaced import points_by_deviations
from imaging.features.measurand import measurands
from imaging.geometry.projection import camera_frame, project, sensor_position
from imaging.models import variance_model
from imaging.pictures import Pictures
from imaging.placed import combined, difference, placed
from measure.placement import adjusted
from measure.quantities import find
from scenes import InvalidInput, Picture
from scenes.cameras import Splined, estimated
from scenes.numbers import with_number
from scenes.placement import components, root
from tests import placements as parts
from tests import printed
from validation.cli import placement as words
from validation.coverage import drawn

_SMALL = {"width": 208, "height": 176, "focal_px": 780.0}


def back(seen, focal, middle, k1=-0.1):
    """Ideal px of recorded ones, by bisection of r (1 + k1 r^2) along the radius."""
    away = (seen - middle) / focal
    far, low, high = np.linalg.norm(away, axis=-1), np.zeros(len(seen)), np.ones(len(seen))
    for _ in range(60):
        half = (low + high) / 2
        beyond = half * (1 + k1 * half**2) > far
        low, high = np.where(beyond, low, half), np.where(beyond, half, high)
    return middle + focal * away * (half / far)[:, None]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("cameras")


@pytest.fixture(scope="module")
def roof(folder):
    """A part of several heights, all that is seen of it datums, by a camera whose focal length is known to 1 %."""
    scene = parts.scene(folder, "roof", parts.EVERY["roof"], camera=_SMALL)
    return Picture.of(printed.estimated(scene, "focal"), parts.SENSOR, parts.LIGHT)


@pytest.fixture(scope="module")
def beside(folder):
    """The block with a chessboard behind it; k1 is not known, either."""
    scene = printed.scene(folder, "block", camera=printed.CAMERA | {"lens": {"distortion": [-0.1]}})
    return Picture.of(printed.estimated(scene, "focal", "k1"), parts.SENSOR, parts.LIGHT)


def _with(picture, **changes):
    return picture.with_scene(picture.scene.with_(**changes))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"placement": {"camera": ["fx"]}}, r"placement.camera\[0\] must be one of 'focal' or 'k1', got 'fx'"),
        ({"placement": {"camera": ["k1"]}}, "placement.camera must be without k1 unless placement.from is board"),
        ({"placement": {"camera": ["focal", "focal"]}}, "placement.camera must have each once"),
        ({"placement": {"from": "uncertain", "datums": [], "datum_sd": None}}, "placement.camera must be left out unl"),
        ({"placement": {"expected": [0] * 5}}, "placement.expected must be 6 numbers, and one of each of camera, got"),
    ],
)
def test_what_cannot_be_is_told_in_a_line(roof, changes, says):
    with pytest.raises(InvalidInput, match=says):
        _with(roof, **changes)


def test_other_lenses_are_refused_and_several_pictures_share_what_is_estimated(beside, roof):
    none = ((0.0,) * 5,) * 5
    splined = Splined(kind="splined", extent=(-0.3, -0.3, 0.3, 0.3), right=none, down=none)
    with pytest.raises(InvalidInput, match=r"placement\.camera must be without k1 of a splined lens"):
        _with(beside, camera={"lens": splined.model_dump()})
    pair = [roof, Picture.of(roof.scene, (25.0, 200.0), tuple(roof.lights[0]))]
    told = planner.predict_bundle(pair, close=False)
    assert "estimated" in told.known_before
    assert {"estimated 1", "estimated 2"} <= set(planner.predict_bundle(pair, cameras="each", close=False).known_before)


def test_points_move_as_opencv_says(beside):
    """Central differences of cv2.projectPoints by focal length and k1, taken back by the camera as it is believed."""
    scene, sensor = beside.scene, np.array(list(beside.sensor))
    camera, points = scene.camera, scene.placement.board.points
    axes, at = camera_frame(camera, sensor), sensor_position(camera, sensor)
    turn = np.stack([axes.right, axes.down, axes.forward])
    middle = np.array([camera.width - 1, camera.height - 1]) / 2

    def seen(focal, k1):
        matrix = np.array([[focal, 0, middle[0]], [0, focal, middle[1]], [0, 0, 1]])
        return cv2.projectPoints(points, cv2.Rodrigues(turn)[0], -turn @ at, matrix, np.array([k1, 0, 0, 0]))[0][:, 0]

    told, slopes = camera.focal_px, points_by_deviations(points, sensor, scene)
    for k, step in ((6, (1e-3, 0)), (7, (0, 1e-3))):
        ends = [seen(told * np.exp(sign * step[0]), -0.1 + sign * step[1]) for sign in (1, -1)]
        ideal = [back(each, told, middle) for each in ends]
        expected = (ideal[0] - ideal[1]) / 2e-3
        assert np.abs(expected).max() > 1  # negative control: they move
        np.testing.assert_allclose(slopes[..., k], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())


def test_lines_and_circles_move_as_projections_of_a_longer_camera():
    """Ends of lines, and rims by least squares over 64 places, in pictures by focal lengths a ten-thousandth apart."""
    scene = scenes.load("bracket_station").with_(
        placement={"from": "datums", "datums": ["c2", "e10"], "datum_sd": 0.002, "camera": ["focal"]},
        uncertainty={"covariance": None}, camera={"lens": {"distortion": [0.0]}},
    )  # fmt: skip
    picture = Picture.of(scene, (20, 0), (20, 225))
    known, sensor = measurands(Pictures.of(picture)), np.array([20.0, 0.0])
    number = known.placing.names.index("placement.camera.focal")
    slope = known.placing.slopes[:, number] / known.placing.root[6, number]
    cameras = [placed(picture, np.append(np.zeros(6), step)).scene.camera for step in (1e-4, -1e-4)]
    seen = known.seen
    e = seen.names.index("e10")
    ends = scene.solid.vertices[list(scene.solid.edge("e10").ends)]
    moved = np.subtract(*(project(ends, sensor, camera) for camera in cameras)) / 2e-4 @ seen.normals[e]
    length = np.linalg.norm(seen.along[e])
    np.testing.assert_allclose(
        slope[2 * e : 2 * e + 2], [moved[0], (moved[1] - moved[0]) / length], rtol=1e-6, atol=1e-9
    )
    circle, c = scene.solid.circle("c2"), seen.circles.index("c2")
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    one, two = circle.axes

    def rim(x, y, growth):
        radial = np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two
        return circle.centre + x * one + y * two + (circle.radius + growth) * radial

    here = project(rim(0, 0, 0), sensor, scene.camera)
    along = np.roll(here, -1, 0) - np.roll(here, 1, 0)
    normal = np.stack([-along[:, 1], along[:, 0]], 1) / np.sqrt(np.linalg.norm(along, axis=1))[:, None]
    steps = (project(rim(*step), sensor, scene.camera) - here for step in 1e-4 * np.eye(3))
    design = [(step * normal).sum(1) / 1e-4 for step in steps]
    moved = np.subtract(*(project(rim(0, 0, 0), sensor, camera) for camera in cameras)) / 2e-4
    expected = np.linalg.lstsq(np.stack(design, 1), (moved * normal).sum(1), rcond=None)[0]
    np.testing.assert_allclose(slope[seen.numbers(c)], expected, rtol=1e-3, atol=1e-6)  # chords of 64


def test_what_is_known_before_is_what_the_scene_says(roof):
    """Of the pitch of pixels, of a calibration of two focal lengths, of nothing."""
    scene = scenes.load("bracket_station")
    told = scene.with_(
        placement={"from": "datums", "datums": ["e10"], "datum_sd": 0.0, "camera": ["focal"]},
        uncertainty={"covariance": None},
        uncertain=[{"key": "camera.pixel_pitch_um", "sd": 0.003 * scene.camera.pixel_pitch_um}],
    )
    np.testing.assert_allclose(estimated.covariance(told), [[0.003**2]], rtol=1e-4)
    nothing = roof.scene.with_(uncertain=[])
    np.testing.assert_allclose(estimated.covariance(nothing), [[estimated.UNTOLD**2]])
    assert components(nothing)[-1] == "placement.camera.focal"
    calibrated = nothing.with_(uncertainty={"covariance": {"names": ["fx", "fy"], "matrix": [[4, 2], [2, 4]]}})
    np.testing.assert_allclose(estimated.covariance(calibrated), [[3 / calibrated.camera.focal_px**2]])  # their mean
    rows = [row.source for row in planner.budget(roof.with_scene(nothing))["length"].contributions]
    assert rows.count("placement.camera.focal") == 1


def test_correlated_deviations_have_their_root(beside):
    given = {"names": ["fx", "k1"], "matrix": [[9.0, 0.03], [0.03, 4e-4]]}
    scene = beside.scene.with_(
        uncertain=[{"key": "placement.board.pitch", "sd": 2e-4}], uncertainty={"covariance": given}
    )
    focal = scene.camera.focal_px
    whole = root(scene)[6:] @ root(scene)[6:].T
    np.testing.assert_allclose(whole, [[9 / focal**2, 0.03 / focal], [0.03 / focal, 4e-4]], rtol=1e-9)


def test_a_longer_camera_has_the_data_sheet_of_one():
    """Its own numbers, changed as a scene file's would be."""
    for name, key in (("bracket_mm", "camera.focal_length_mm"), ("telecentric_plate", "camera.magnification")):
        scene = scenes.load(name)
        longer = scene.camera.enlarged(1.01)
        number = getattr(longer, key.removeprefix("camera."))
        assert with_number(scene, key, number).camera.focal_px == pytest.approx(1.01 * scene.camera.focal_px, rel=1e-9)


def test_places_with_cameras_go_one_after_the_other(roof):
    first, then = np.array([1.0, -2, 0.5, 1, 2, -1, 0.01]), np.array([0.5, 1, -1, -2, 1, 2, -0.02])
    twice, whole = placed(placed(roof, first), then), placed(roof, combined(first, then))
    seen = [project(roof.scene.solid.vertices, np.array(list(p.sensor)), p.scene.camera) for p in (twice, whole)]
    np.testing.assert_allclose(*seen, atol=1e-9)  # margin: rounding
    np.testing.assert_allclose(difference(combined(first, then), first), then, atol=1e-9)
    assert twice.scene.placement.mean[6] == pytest.approx(0.01)  # what is expected of the focal length stays


def test_the_information_is_that_of_exact_images(roof):
    """By differences of whole images, pixel by pixel, of displaced parts by longer cameras; 0.5 % of sd found."""
    found = find(parts.seen(roof, np.zeros(7))[None], roof, "arrangement")
    told, exact = (
        np.sqrt(np.diag(np.linalg.inv(each)))
        for each in (found.adjustment.information[0], parts.exact_information(roof))
    )
    np.testing.assert_allclose(told, exact, rtol=0.01)
    known = np.sqrt(np.diag(np.linalg.inv(found.adjustment.information[0][:6, :6])))
    assert (exact[:3] > 2 * known[:3]).all()  # negative control: a known focal length tells the distance better


def _squares(picture, start, there, image):
    """Chi-square of what an adjustment from a start finds of a true place and camera; infinite where it finds none."""
    where = adjusted(image, picture, start)
    off = difference(there[: len(start)], where.placement)
    return off @ np.linalg.solve(where.covariance, off) if where.status == "ok" else np.inf


@pytest.mark.parametrize("count", [1, 14])
def test_places_and_focal_lengths_are_as_well_known_as_told(roof, count):
    """`python -m tests.proofs placements --camera focal`, reduced: chi-square of noisy pictures by drawn cameras."""
    rng, total, wrong = np.random.default_rng(5), 0.0, 0.0
    for _ in range(count):
        there = np.append(parts.drawn(rng, 0.1 * parts.MOST), printed.of_camera(roof, rng))
        (image,) = render.expose(parts.seen(roof, there), roof.scene.noise, rng, 1)
        total += _squares(roof, there + np.array([0.02] * 6 + [0.001]), there, image)
        wrong += _squares(printed.as_said(roof), there[:6], there, image)
    low, high = chdtri(7 * count, [0.9995, 0.0005])
    assert low < total < high, total
    assert wrong > 3 * high  # negative control: the focal length is off, and taken for known
    if count > 10:
        for factor in (0.5, 2.0):  # negative controls
            assert not low < factor * total < high


def test_focal_length_and_distance_from_above_are_left_open(folder):
    """A board that faces the camera, all in one plane below the part: a matter of height, of which a datum is none."""
    scene = printed.estimated(printed.scene(folder, "block"), "focal")
    scene = scene.with_(uncertainty={"part_shift": [{"half_width": each} for each in (5, 5, 20)]})
    above = Picture.of(scene, (0.0, 0.0), parts.LIGHT)
    told = planner.predict(above).measurands
    assert {each.status for each in told[:2]} == {"unplaced"}
    assert "board tells less of part_shift.z or placement.camera.focal than was known before" in told[0].reason
    assert "unplaced" not in {each.status for each in planner.predict(printed.as_said(above)).measurands}
    top = parts.scene(folder, "block", ("e4", "e11"), placement={"camera": ["focal"]})
    plane = planner.predict(Picture.of(top, (0.0, 0.0), parts.LIGHT)).measurands
    assert "unplaced" not in {plane[0].status}  # in the datums' plane the scale is theirs, whatever focal and height


def test_the_budget_has_the_focal_length_once(roof):
    """What the adjustment leaves of it, in place of what it would do to a known place; together as predicted."""
    errors = variance_model("calibrated")(Pictures.of(roof))
    told = planner.budget(roof)
    rows = [{row.source: row.contribution for row in each.contributions} for each in told]
    assert [list(row).count("camera.focal_px") for row in rows] == [1, 1]
    of_place = [sum(u**2 for name, u in row.items() if name.startswith(("part_", "camera."))) for row in rows]
    np.testing.assert_allclose(errors.placed, of_place, rtol=1e-3)
    taken = {row.source: row.contribution for row in planner.budget(printed.as_said(roof))["length"].contributions}
    assert rows[0]["camera.focal_px"] < 0.2 * taken["camera.focal_px"]
    held = [each.held for each in drawn(told, 4000, 3)]
    np.testing.assert_allclose(held, 0.95, atol=0.02)  # chance 0.0035; rectangular inputs are on the safe side


def test_a_board_tells_focal_length_and_distortion(beside):
    """What is not known of the camera moves values less where it is estimated; and is named with its deviation."""
    ours, fixed = planner.budget(beside), planner.budget(printed.as_said(beside))
    assert ours["length"].U < 0.8 * fixed["length"].U
    there = np.array([1.0, -1.0, 0.5, 1.0, -1.0, 1.0, 0.008, 0.015])
    rng = np.random.default_rng(2)
    (image,) = render.expose(printed.seen(printed.drawn(beside, rng), there), beside.scene.noise, rng, 1)
    where = measure.locate(image, beside, estimator="gradient")
    assert where.status == "ok", where.reason
    pull = difference(there, where.placement) / np.sqrt(np.diag(where.covariance))
    assert np.abs(pull).max() < 5
    told = words.facts(where)["camera"]
    assert told["focal_px"]["value"] == pytest.approx(1200 * np.exp(there[6]), abs=5 * told["focal_px"]["sigma"])
    assert "; focal_px 12" in words.text(where)
    assert "; k1 -0.0" in words.text(where)
    wrong = measure.locate(image, printed.as_said(beside), estimator="gradient")  # negative control
    pull = difference(there[:6], wrong.placement) / np.sqrt(np.diag(wrong.covariance))
    assert not np.abs(pull).max() < 5
