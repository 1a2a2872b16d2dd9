"""A board beside the part: its record, its points' noise, what it tells of the place, where it is found, its render."""

import cv2
import numpy as np
import pytest
from scipy.special import chdtri

import measure
import planner
import render
import scenes
from imaging.boards.seen import crossing, dot
from imaging.features.measurand import measurands
from imaging.geometry.projection import camera_frame, project, sensor_position
from imaging.models import variance_model
from imaging.pictures import Pictures
from imaging.placed import difference, placed
from measure.boards.chessboard import measured as measured_corners
from measure.boards.dots import measured as measured_dots
from measure.features.board import BoardTool
from scenes import Board, InvalidInput, Picture
from scenes.placement import of_board, prior
from tests import placements as parts
from tests import printed
from tests.boards import Rig

_SMALL = {"width": 220, "height": 250, "focal_px": 750.0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("boards")


@pytest.fixture(scope="module")
def block(folder):
    """The block with a chessboard behind it."""
    return Picture.of(printed.scene(folder, "block"), parts.SENSOR, parts.LIGHT)


def _with(picture, **changes):
    return picture.with_scene(picture.scene.with_(**changes))


def _without(picture):
    """The same without a board, its part where the scene says."""
    return _with(picture, placement={"from": "known", "board": None}, uncertain=[],
                 uncertainty={"board_shift": None, "board_tilt_deg": None})  # fmt: skip


_BOARD = {"shape": [4, 3], "pitch": 5.0, "corner": [0, 50, 0]}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"placement": {"from": "board"}}, "placement.board must be given with placement.from = 'board', got nothing"),
        ({"placement": {"board": _BOARD}}, "placement.board must be left out unless placement.from is board"),
        ({"uncertainty": {"board_shift": 0.1}}, "board_shift and board_tilt_deg must be left out unless"),
        ({"placement": {"from": "board", "board": {**_BOARD, "shape": [2, 3]}}}, "shape must be at least 3 both"),
        ({"placement": {"from": "board", "board": {**_BOARD, "normal": [1, 0, 1]}}}, "normal must be across along"),
        ({"placement": {"from": "board", "board": {**_BOARD, "along": [0, 0, 0]}}}, "must be directions, got 0"),
        ({"placement": {"from": "board", "board": {**_BOARD, "dark": 0.9}}}, "dark must be less than bright, 0.8"),
        ({"placement": {"from": "board", "board": {**_BOARD, "dot_radius": 1.0}}}, "dot_radius must be left out of a"),
        ({"placement": {"from": "board", "board": {**_BOARD, "kind": "dots", "dot_radius": 3.0}}}, "less than 0.45 of"),
        ({"placement": {"from": "board", "board": {**_BOARD, "corner": [20, 20, 6]}}}, "board must be outside the obj"),
        ({"placement": {"from": "board", "board": {**_BOARD, "bright": {"value": 0.8, "sd": 0.1}}}},
         "uncertain.key must be placement.board.pitch of a placement"),
        ({"placement": {"from": "board", "board": _BOARD}, "noise": {"row_sigma": 1.0}}, "noise must be without row"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_told_in_a_line(changes, says):
    with pytest.raises(InvalidInput, match=says):
        scenes.load("bracket_station").with_(**changes)


def _of_a_camera(folder, number):
    """The block and its board by a camera whose focal length and k1 are estimated: picture, where they are, image."""
    scene = printed.lenient(printed.estimated(printed.scene(folder, "block"), "focal", "k1"))
    picture, rng = Picture.of(scene, parts.SENSOR, parts.LIGHT), np.random.default_rng((2, 0, number))
    there = printed.place(picture, rng)
    (image,) = render.expose(printed.seen(printed.drawn(picture, rng), there), scene.noise, rng, 1)
    return picture, there, image


def test_a_board_of_which_a_corner_is_taken_for_another_is_found(folder):
    """OpenCV takes a place on the rim for one of 45 corners; with it, they were 2.5 px off what is plausible."""
    picture, there, image = _of_a_camera(folder, 22)
    where = measure.locate(image, picture)
    assert where.status == "ok", where.reason
    assert (np.abs(difference(there, where.placement)) < 4 * np.sqrt(np.diag(where.covariance))).all()


def test_edges_bent_by_what_is_not_known_of_the_lens_are_no_misfit(folder):
    """k1 is told 1.75 standard deviations off by the board, which bends edges visibly; a scratch beside one is one."""
    picture, _, image = _of_a_camera(folder, 8)
    where = measure.locate(image, picture)
    told = measure.measure(image, where.picture)
    assert told.status.tolist() == ["ok"] * 3
    assert (np.abs(told.value - told.nominal) < 4 * np.hypot(told.sigma, told.u_placed)).all()
    (x, y), *_ = project(
        np.array([[25.0, 0.0, 12.0]]), np.array(list(where.picture.sensor)), where.picture.scene.camera
    )
    image[round(y) - 1 : round(y) + 2, round(x) - 6 : round(x) + 7] += 20.0
    scratched = measure.measure(image, measure.locate(image, picture).picture)
    assert scratched.status.tolist() == ["misfit"] * 3


@pytest.mark.parametrize("kind", ["chessboard", "dots"])
def test_bright_and_dark_cover_a_board_once(kind):
    board = Board(kind=kind, shape=(5, 4), pitch=3.0, corner=(1, 2, 3), along=(1, 1, 0), normal=(0, 0, 2))

    def area(triangles):
        return np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)

    bright, dark = (area(each).sum() / 2 for each in board.triangles)
    assert bright + dark == pytest.approx(9 * (8 * 7 if kind == "chessboard" else 6 * 5), rel=1e-12)
    assert dark == pytest.approx(9 * 15 if kind == "chessboard" else 20 * np.pi * 0.75**2, rel=1e-12)


def test_slopes_are_those_of_points_seen_by_opencv(block):
    """Central differences of cv2.projectPoints, the part and the board turned about the point that is looked at."""
    scene, board = block.scene, measurands(Pictures.of(block)).placing.board
    camera, points = scene.camera, scene.placement.board.points
    pose = np.array(list(block.sensor))
    axes, at = camera_frame(camera, pose), sensor_position(camera, pose)
    turn = np.stack([axes.right, axes.down, axes.forward])
    matrix = np.array([[camera.focal_px, 0, 0], [0, camera.focal_px, 0], [0, 0, 1]])

    def seen(place):
        moved = (points - camera.look_at) @ cv2.Rodrigues(np.radians(place[3:]))[0].T + camera.look_at + place[:3]
        return cv2.projectPoints(moved, cv2.Rodrigues(turn)[0], -turn @ at, matrix, None)[0][:, 0]

    for i, u in enumerate(prior(scene.uncertainty)):
        step = np.eye(6)[i] * 1e-3
        np.testing.assert_allclose(board.slopes[..., i], (seen(step) - seen(-step)) / 2e-3 * u, rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("kind", ["chessboard", "dots"])
def test_points_scatter_as_predicted(kind):
    """Fits in noisy images made by brute force; 600 and more coordinates, chance 6 %."""
    rig = Rig(np.array([[400.0, 0, 79.5], [0, 400, 59.5], [0, 0, 1]]), size=(160, 120), board=(4, 3))
    pose = np.array([0.3, -0.2, 0.1, -38.0, -26.0, 480.0])
    clean = rig.image(pose) if kind == "chessboard" else rig.dots(pose, 0.25)
    grid, sigma = rig.corners(pose).reshape(3, 4, 2), 2.0
    told = crossing(grid[:, :3], rig.blur) if kind == "chessboard" else dot(grid[:, :3], rig.blur, 0.25)
    told = told * (sigma / 140) ** 2
    if kind == "dots":
        toward = grid[1, 1:] - grid[1, :-1]
        size = 0.25 * np.linalg.norm(toward, axis=1).mean()
        grid = np.concatenate([grid, np.broadcast_to([size, size, 0.0], (3, 4, 3))], -1)
    fit = measured_corners if kind == "chessboard" else measured_dots
    rng = np.random.default_rng(4)
    found = np.array([fit(clean + sigma * rng.standard_normal(clean.shape), grid, sigma).corners for _ in range(26)])
    off = (found - found.mean(0)) * np.sqrt(26 / 25)
    white = np.linalg.solve(np.linalg.cholesky(told), off.reshape(-1, 2).T)
    ratio, chance = (white**2).mean(), 4 * np.sqrt(2 / (2 * 12 * 25))
    assert abs(ratio - 1) < chance, ratio
    assert abs(ratio / 1.3 - 1) > chance  # negative control


def test_the_middle_corner_stands_for_all(block):
    """What the fit of each corner of a noise-free picture tells of it, told before from one."""
    board = measurands(Pictures.of(block)).placing.board
    tool = BoardTool(block, board)
    _, noise = tool.points(tool.measured(printed.seen(block, np.zeros(6))))
    ratio = np.einsum("nii->n", noise) / np.einsum("nii->n", board.noise)
    assert ratio.mean() == pytest.approx(1, abs=0.03)  # 0.011 found
    assert ratio.std() < 0.06  # 0.025 found


def test_few_numbers_tell_what_all_points_do(block):
    """Dense least squares over place, pitch, place beside the part and all points' errors at once; and drawn errors."""
    picture = Pictures.of(block)
    errors = variance_model("calibrated")(picture)
    placing, adjustment = errors.measurands.placing, errors.adjustment
    board, (n, _, k) = placing.board, placing.board.slopes.shape
    white = np.linalg.inv(np.linalg.cholesky(board.noise))
    printed_root, none = np.linalg.cholesky(board.printed), np.zeros
    design = [(white @ board.slopes).reshape(2 * n, k), (white @ board.beside).reshape(2 * n, -1)]
    blocks = none((2 * n, 2 * n))
    for i, one in enumerate(white @ printed_root):
        blocks[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = one
    rows = np.concatenate([*design, blocks], 1)
    dense = np.concatenate([rows, np.eye(rows.shape[1])])
    rng = np.random.default_rng(2)
    truth = rng.standard_normal((4000, rows.shape[1]))
    noise = rng.standard_normal((4000, 2 * n))
    off = np.linalg.solve(white, (truth @ rows.T + noise).reshape(4000, n, 2, 1))[..., 0]
    seen = none((4000, errors.measurands.seen.count))
    seen[:, errors.measurands.seen.of_board] = np.einsum("kni,sni->sk", board.gain(), off)
    best = np.linalg.lstsq(dense, np.concatenate([truth[0] @ rows.T + noise[0], none(rows.shape[1])]), rcond=None)[0]
    sd = np.sqrt(np.diag(adjustment.posterior))
    assert np.abs(adjustment.estimate(seen[:1])[0] - best[:k]).max() < 0.1 * sd.min()  # the pitch counts in the weights
    exact = np.linalg.inv(dense.T @ dense)[:k, :k]
    np.testing.assert_allclose(np.diag(adjustment.posterior), np.diag(exact), rtol=0.01)
    left = truth[:, :k] - adjustment.estimate(seen)
    ratio, chance = left.var(0) / np.diag(adjustment.posterior), 4 * np.sqrt(2 / 4000)
    assert (np.abs(ratio - 1) < chance).all(), ratio
    assert (np.abs(ratio / 1.3 - 1) > chance).all()  # negative control
    gradient = errors.measurands.gradient_object
    moved = truth[:, :k] @ adjustment.pulls(gradient).T + seen @ (adjustment.gradient(gradient) - gradient).T
    ours = errors.placed + [errors.by_board(row) for row in adjustment.gradient(gradient)]
    np.testing.assert_allclose(moved.var(0) / ours, 1, atol=chance)


def test_a_board_takes_the_place_of_the_camera_in_the_budget(block):
    picture = _with(block, uncertainty={"sensor_distance": 0.5, "sensor_roll_deg": 0.1})
    rows = {row.source: row for row in planner.budget(picture)["length"].contributions}
    known = _without(picture)
    beside = {row.source: row for row in planner.budget(known)["length"].contributions}
    assert rows["sensor_distance"].contribution < 0.02 * beside["sensor_distance"].contribution
    assert rows["part_shift.z"].contribution < 0.02 * beside["part_shift.z"].contribution
    length, pitch = 50.0, 2e-4 / 4
    assert rows["placement.board.pitch"].contribution == pytest.approx(length * pitch, rel=0.05)  # the scale is its
    assert rows["board points"].contribution > 0


def test_a_board_that_is_not_beside_the_part_tells_nothing(block):
    for corner in ([-16, 24, 0], [-16, 150, 0]):  # behind it in the picture; outside the picture
        told = planner.predict(_with(block, placement={"board": {"corner": corner}})).measurands
        assert {each.status for each in told} == {"unplaced"}
        assert "no point of the board is found" in told[0].reason


@pytest.fixture(scope="module")
def dotted(folder):
    """The block with a few dots behind it."""
    scene = printed.scene(folder, "block", "dots")
    scene = scene.with_(placement={"board": {"shape": [6, 4], "pitch": {"value": 6.0, "sd": 2e-4}}})
    return Picture.of(scene, parts.SENSOR, parts.LIGHT)


@pytest.fixture(scope="module")
def found(dotted):
    """A part and its board somewhere, their picture, their true place."""
    picture = dotted
    rng, there = np.random.default_rng(3), np.array([3.0, -2.0, 1.5, 2.0, -2.0, 2.5])
    (image,) = render.expose(printed.seen(printed.drawn(picture, rng), there), picture.scene.noise, rng, 1)
    return picture, image, there


def test_a_part_is_found_by_its_board(found):
    picture, image, there = found
    where = measure.locate(image, picture, estimator="gradient")
    assert where.status == "ok", where.reason
    pull = difference(there, where.placement) / np.sqrt(np.diag(where.covariance))
    assert np.abs(pull).max() < 5
    told = measure.measure(image, where.picture, estimator="gradient")
    assert told.status[1] == "ok"
    assert (np.abs(told.value - told.nominal) < 5 * np.hypot(told.sigma, told.u_placed)).all()
    as_said = measure.measure(image, picture.unlit(), estimator="gradient")  # negative control: there is none
    assert not np.isfinite(as_said.value).any() or "ok" not in as_said.status


def test_places_are_as_well_known_as_told(dotted):
    """`python -m tests.proofs placements --board dots`, reduced: chi-square of 12 places, of a board drawn anew."""
    rng, total, count = np.random.default_rng(8), 0.0, 12
    for _ in range(count):
        there = printed.place(dotted, rng)
        clean = printed.seen(printed.drawn(dotted, rng), there)
        (image,) = render.expose(clean, dotted.scene.noise, rng, 1)
        where = measure.locate(image, dotted, estimator="gradient")
        off = difference(there, where.placement)
        total += off @ np.linalg.solve(where.covariance, off)
    low, high = chdtri(6 * count, [0.9995, 0.0005])
    assert low < total < high, total
    for factor in (0.5, 2.0):  # negative controls
        assert not low < factor * total < high


def test_another_board_is_not_taken_for_it(found):
    picture, image, _ = found
    other = _with(picture, placement={"board": {"shape": [5, 4]}})
    assert measure.locate(image, other).status == "not_visible"
    flat = np.full(image.shape, 16.0)
    where = measure.locate(flat, picture)
    assert where.status == "not_visible"
    assert "no board" in where.reason


def test_points_that_are_off_are_a_misfit(block):
    """One corner of a chessboard a tenth of a px off its place; the board as it is told fits."""
    picture = _with(block, placement={"board": {"shape": [4, 3], "corner": [-6, 44, 0], "point_sd": 1e-4}})
    board = measurands(Pictures.of(picture)).placing.board
    tool = BoardTool(picture, board)
    off, noise = np.zeros((12, 2)), board.noise
    assert tool._fits(off, noise) > 0.99
    off[5, 0] = 10 * np.sqrt(noise[5, 0, 0])
    assert tool._fits(off, noise) < 1e-8


def test_a_render_shows_the_board_of_the_image_model(folder):
    """Mitsuba's squares against polygons blurred in closed form; with distortion and a light of another direction."""
    scene = printed.scene(folder, "block", camera=_SMALL | {"lens": {"distortion": [-0.1]}})
    picture = Picture.of(scene, (25, 290), (30, 40))
    made, drawn = render.image(picture), printed.seen(picture, np.zeros(6))
    bare = parts.seen(_without(picture), np.zeros(6))
    rows, columns = slice(0, 115), slice(60, 220)  # the board alone
    assert drawn[rows, columns].max() > 120
    assert np.abs(made - drawn)[rows, columns].max() < 1.0  # of 150 levels; 0.4 found
    assert np.abs(made - bare)[rows, columns].max() > 100  # negative control
    np.testing.assert_array_equal(bare[130:], drawn[130:])


def test_noise_of_the_board_is_drawn_where_it_is_asked_for(block):
    """Values of images with noise where they say that it counts, and everywhere, are the same."""
    clean = printed.seen(block, np.zeros(6))
    where = measure.region_of_interest(block, estimators=("gradient",))
    some, whole = (
        measure.measure(render.expose(clean, block.scene.noise, np.random.default_rng(1), 1, here)[0], block.unlit(),
                        estimator="gradient").value
        for here in (where, None)
    )  # fmt: skip
    np.testing.assert_array_equal(some, whole)
    assert where.mean() < 0.6


def test_many_pictures_at_once_are_as_each_alone(block):
    """Sensors against lights: a board's noise depends on both."""
    sensors, lights = (
        np.array([[28.0, 300.0], [20.0, 290.0]])[:, None],
        np.array([[22.0, 60.0], [30.0, 40.0], [25, 10]]),
    )
    errors = variance_model("calibrated")(Pictures.of(block.scene, sensors, lights))
    for i, j in np.ndindex(2, 3):
        one = variance_model("calibrated")(Pictures.of(block.scene, sensors[i, 0], lights[j]))
        np.testing.assert_allclose(errors.placed[i, j], one.placed, rtol=1e-9)
        np.testing.assert_allclose(errors.variances_object[i, j], one.variances_object, rtol=1e-3)  # a glance


def test_of_board_is_what_is_said_of_it(block):
    np.testing.assert_array_equal(of_board(block.scene.uncertainty), [0.003] * 3 + [0.005] * 3)


def test_a_board_that_is_too_near_the_part_is_refused(folder):
    """Its points are found, but taken to tell nothing there: once that had no errors, and the adjustment ran to and
    fro, or settled six standard deviations away."""
    scene = printed.scene(folder, "roof")
    picture, there = Picture.of(scene, parts.SENSOR, parts.LIGHT), np.array([2.2, -0.4, 1.7, -2.8, -1.9, 2.3])
    assert not printed.is_clear(placed(picture, there))
    (image,) = render.expose(printed.seen(picture, there), scene.noise, np.random.default_rng(1), 1)
    where = measure.locate(image, picture, estimator="gradient")
    assert where.status == "not_visible"
    assert "40 px beside the part" in where.reason
