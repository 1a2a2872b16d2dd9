"""A board beside the part in several pictures adjusted together: against one picture's adjustment, exact projection,
least squares over all points with a projection of its own, drawn errors, and rendered pictures."""

import numpy as np
import pytest
from scipy.linalg import block_diag

import measure
import planner
import render
import scenes
from imaging.blurred.whole import image
from imaging.bundles.bundle import Bundle
from imaging.bundles.unknowns import BOARD_POINTS, Freedom
from imaging.models import variance_model
from imaging.pictures import Pictures
from imaging.placed import placed
from planner.budgeting.bundles import bundle_budget
from scenes import InvalidInput, Picture
from scenes.placement import prior
from tests.bundles import SENSOR_SD, camera, project, widths

SENSORS, LIGHT = ((25.0, 60.0), (28.0, 240.0)), (25.0, 180.0)
UNSURE = {"sensor_deg": 0.02, "sensor_distance": 0.1, "sensor_roll_deg": 0.05}


@pytest.fixture(scope="module")
def scene():
    return scenes.load("board_block").with_(uncertainty=UNSURE)


def pair(scene):
    return tuple(Picture.of(scene, sensor, LIGHT) for sensor in SENSORS)


def errors_of(pictures):
    return [variance_model("calibrated")(Pictures.of(each)) for each in pictures]


def noise_of(pictures):
    return [each.of_features for each in errors_of(pictures)]


@pytest.mark.parametrize("estimated", [[], ["focal", "k1"]])
def test_one_picture_of_features_in_their_planes_is_today_s_adjustment(scene, estimated):
    here = scene.with_(placement={"camera": estimated}).settings[0]
    picture = Picture.of(scene.with_(placement={"camera": estimated}), here.sensor, here.light)
    (errors,) = errors_of([picture])
    told = Bundle.of([picture], Freedom("known", "in_plane")).adjusted([errors.of_features])
    np.testing.assert_allclose(np.diag(told.covariance), errors.variances_object, rtol=1e-6)
    np.testing.assert_allclose(sum(u**2 for u in told.known_before.values()), errors.placed, rtol=1e-6)
    assert {"board", "board pitch", BOARD_POINTS} <= set(told.known_before)
    assert ("estimated" in told.known_before) == bool(estimated)


def test_derivatives_are_those_of_exact_projection(scene):
    """Central differences by every unknown: part, sensors, camera, board, pitch, points."""
    made = scene.with_(placement={"camera": ["focal", "k1"]})
    bundle = Bundle.of(pair(made), Freedom("unknown"))
    for k in range(bundle.unknowns.count):
        step = np.eye(bundle.unknowns.count)[k] * 1e-5
        ahead, behind = bundle.expected(step), bundle.expected(-step)
        for design, one, other in zip(bundle.designs, ahead, behind, strict=True):
            scale = np.abs(design).max(1)
            assert (np.abs(design[:, k] - (one - other) / 2e-5) < 1e-5 * scale).all(), k


def test_what_is_expected_elsewhere_is_what_was_off(scene):
    """Part, sensors and camera moved by `moved_by`: what the old expectation saw off is what the new one sees not."""
    made = scene.with_(placement={"camera": ["focal"]})
    bundle = Bundle.of(pair(made), Freedom("uncertain"))
    slices = bundle.unknowns.slices
    numbers = np.zeros(bundle.unknowns.count)
    for name, many in (("part", 0.01), ("sensor 1", 0.003), ("sensor 2", -0.002), ("estimated", 0.01)):
        numbers[slices[name]] = many
    off = bundle.expected(numbers)
    there = bundle.moved_by(numbers)
    assert there.moved == pytest.approx(numbers)
    assert there.pictures[0].scene.camera.focal_px == pytest.approx(made.camera.focal_px * np.exp(0.01), rel=1e-9)
    for before, after, one in zip(bundle.seen, there.seen, off, strict=True):
        lines = before.line_errors(after.start, after.along)
        assert (np.abs(lines - one[: lines.size]) < 0.01 * np.abs(one[: lines.size]).max()).all()


def test_it_is_at_least_squares_over_all_points(scene):
    """Joint covariance by dense algebra over every point, with print, pitch and place as unknowns, by a projection of
    its own: the parameters by which a board counts never tell more, and 0.15 % less in a variance.

    Negative control: print that is another one in each picture, as noise is.
    """
    pictures = pair(scene)
    bundle, errors = Bundle.of(pictures, Freedom("uncertain")), errors_of(pictures)
    told = bundle.adjusted([each.of_features for each in errors])
    whole = told.covariance + sum(pull @ pull.T for pull in told.by_priors.values())
    board, solid = scene.placement.board, scene.solid
    vertices, names = list(bundle.unknowns.vertices), bundle.seen[0].names
    count, points = len(vertices), board.points
    prior = np.concatenate([
        np.full(3, scene.uncertainty.part_shift[0].u), [scene.uncertainty.part_tilt_deg.u * np.pi / 180] * 3,
        np.tile(SENSOR_SD, 2), np.full(3 * count, np.inf),
        [0.01 / np.sqrt(3)] * 3, [0.02 / np.sqrt(3) * np.pi / 180] * 3,
        [0.0001], np.full(points.size, board.point_sd),
    ])  # fmt: skip
    prior[2] = scene.uncertainty.part_shift[2].u
    pivot = np.array(scene.camera.look_at)

    def images(numbers, k, own):
        part, sensors, free = numbers[:6], numbers[6:14].reshape(2, 4), numbers[14 : 14 + 3 * count].reshape(-1, 3)
        place, pitch, printed = numbers[14 + 3 * count :][:6], numbers[14 + 3 * count + 6], numbers[-points.size :]
        corners = solid.vertices[vertices] + free
        grid = points + (points - board.corner) / board.pitch * pitch + own * printed.reshape(-1, 3)
        grid = grid + place[:3] + np.cross(place[3:], grid - pivot)
        both = np.concatenate([corners, grid])
        both = both + part[:3] + np.cross(part[3:], both - pivot)
        there = project(both, *camera(scene, SENSORS[k], sensors[k]))
        return there[:count], there[count:]

    def rows(numbers, k):
        there, grid = images(numbers, k, 1.0)
        seen, off = bundle.seen[k], []
        for e, name in enumerate(names):
            i, j = (vertices.index(end) for end in solid.edge(name).ends)
            along = there[j] - there[i]
            normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
            cosine = normal @ seen.normals[e]
            sine = -normal[0] * seen.normals[e][1] + normal[1] * seen.normals[e][0]
            off += [normal @ (there[i] - seen.start[e]) / cosine, np.arctan2(sine, cosine)]
        return np.concatenate([off, grid.ravel()])

    gradient = np.zeros((len(scene.quantities), prior.size))
    for h in range(3 * count):
        moves = 1e-5 * np.eye(3 * count)[h].reshape(-1, 3)
        ends = []
        for sign in (1, -1):
            moved = solid.vertices.copy()
            moved[vertices] += sign * moves
            ends.append(widths(solid, scene.quantities, moved))
        gradient[:, 14 + h] = (ends[0] - ends[1]) / 2e-5

    def bound(own_print):
        information = np.diag(1 / prior**2)
        for k, each in enumerate(errors):
            slopes = np.stack([(rows(h, k) - rows(-h, k)) / 2e-5 for h in 1e-5 * np.eye(prior.size)], -1)
            lines = 2 * len(names)
            covariance = block_diag(each.of_features[:lines, :lines], *each.measurands.board.noise)
            if own_print:
                printed = slopes[:, -points.size :] * board.point_sd
                covariance, slopes = (
                    covariance + printed @ printed.T,
                    slopes * (np.arange(prior.size) < prior.size - points.size),
                )
            some = np.isfinite(covariance.diagonal())
            information += slopes[some].T @ np.linalg.solve(covariance[np.ix_(some, some)], slopes[some])
        return np.diag(gradient @ np.linalg.pinv(information, rcond=1e-14, hermitian=True) @ gradient.T)

    ratio, wrong = np.diag(whole) / bound(False), np.diag(whole) / bound(True)
    assert (ratio > 1 - 1e-4).all(), ratio
    assert (ratio < 1.005).all(), ratio
    assert (np.abs(wrong - 1) > 0.02).any(), wrong


def test_drawn_boards_sensors_and_noise_scatter_as_told(scene):
    """200 drawn sets, exact projection. Negative controls, each seen: board points, pitch, and sensors left out."""
    rng, count = np.random.default_rng(4), 200
    made = scene.with_(uncertain=[{"key": "placement.board.pitch", "sd": 0.0003}])
    bundle, noise = Bundle.of(pair(made), Freedom("uncertain")), noise_of(pair(made))
    adjustment, unknowns = bundle.adjusted(noise), bundle.unknowns
    roots = [np.linalg.cholesky(np.where(np.isfinite(each), each, 0.0)) for each in noise]
    sds = np.concatenate([np.where(np.isfinite(block.sd), block.sd, 0.0) for block in unknowns.blocks])
    off = []
    for _ in range(count):
        there = bundle.expected(sds * rng.standard_normal(unknowns.count))
        found = [h + root @ rng.standard_normal(len(root)) for h, root in zip(there, roots, strict=True)]
        off.append(bundle.values(adjustment.solved(found)[0]) - bundle.nominal[0])
    parts = adjustment.known_before
    u2 = np.diag(adjustment.covariance) + sum(u**2 for u in parts.values())
    chance = 4 * np.sqrt(2 / count)
    assert (np.abs(np.var(off, 0) / u2 - 1) < chance).all()
    assert (np.abs(np.mean(off, 0)) < 4 * np.sqrt(u2 / count)).all()
    for name in (BOARD_POINTS, "board pitch"):
        assert (np.var(off, 0) / (u2 - parts[name] ** 2) > 1 + chance).any(), name


def test_a_board_tells_where_sensors_stand_of_which_nothing_is_known(scene):
    """Lengths of two pictures, and rows of the budget; without the board nothing tells a length."""
    budgets = bundle_budget(pair(scene), "unknown")
    told, budget = budgets.prediction, budgets["length"]
    rows = {row.source: row.contribution for row in budget.contributions}
    assert {"pixel noise", "board points", "board pitch"} <= set(rows)
    assert not {"sensor_distance 1", "placement.board.pitch", "board_shift.x"} & set(rows)
    adjusted = sum(rows[name] ** 2 for name in ("pixel noise", "board points", "board pitch"))
    assert adjusted == pytest.approx(told.u[0] ** 2, rel=1e-6)
    none = {"placement": {"from": "known", "board": None}, "uncertain": []}
    bare = scene.with_(**none, uncertainty={"board_shift": None, "board_tilt_deg": None})
    assert planner.predict_bundle(pair(bare), "unknown", close=False).status == ("unplaced", "unplaced")


@pytest.mark.parametrize(("sensors", "estimated"), [("uncertain", []), ("unknown", ["focal"])])
def test_pictures_of_a_part_that_lies_elsewhere_are_measured(scene, sensors, estimated):
    """2 mm and a degree off, by a lens 1 % longer where that is estimated: found, ok, within 4 u, exact pictures."""
    rng, made = np.random.default_rng(7), scene.with_(placement={"camera": estimated})
    place = np.array([1.5, -1.0, 0.7, 0.5, -0.6, 0.8, *[0.01] * len(estimated)])
    there = [placed(picture, place) for picture in pair(made)]
    shots = [
        (render.expose(image(each), made.noise, rng, 1)[0], said) for each, said in zip(there, pair(made), strict=True)
    ]
    found = measure.bundle(shots, sensors, estimator="arrangement")
    assert set(found.status) == {"ok"}
    assert (np.abs(found.value - found.nominal) < 4 * found.u).all()
    assert (found.u < 0.01).all()
    for one, wanted in zip(found.pictures, there, strict=True):
        assert one.scene.camera.focal_px == pytest.approx(wanted.scene.camera.focal_px, rel=1e-3)


def test_pictures_of_other_boards_or_places_are_refused(scene):
    """Also where one was put to where its part was found: where sensors stand would be no longer as the scene says."""
    first, second = pair(scene)
    other = second.with_scene(scene.with_(placement={"board": {"pitch": 5.4}}, uncertain=[]))
    for wrong in (other, placed(second, np.array([0.1, 0, 0, 0, 0, 0]))):
        with pytest.raises(InvalidInput, match="pictures must be of one placement, as the scene says it, got others"):
            Bundle.of([first, wrong], Freedom())


def test_where_a_part_is_expected_counts(scene):
    """A part that lies, as its camera is, where that was expected before: chi-square 0, and it is told where.

    Negative control: expected where the scene says, chi-square is what was known before of the place.
    """
    there = np.array([0.3, -0.2, 0.1, 0.2, -0.1, 0.3, 0.004])
    squares = []
    for expected in ([*there], [0.0] * 7):
        made = scene.with_(placement={"camera": ["focal"], "expected": expected})
        bundle = Bundle.of(pair(made), Freedom("uncertain"))
        turned = np.where(np.isin(np.arange(7), (3, 4, 5)), np.radians(there), there)
        numbers = bundle.unknowns.numbers({"part": turned[:6], "estimated": turned[6:]})
        told = bundle.adjusted(noise_of(bundle.pictures))
        found, square = told.solved(bundle.expected(numbers))
        squares.append(square)
        assert bundle.placement_by(numbers) == pytest.approx(there, abs=1e-3)
    assert squares[0] < 1e-6
    assert bundle.placement_by(found) == pytest.approx(there, abs=5 * told.u_placement.max())
    known = np.append(prior(scene.uncertainty), 0.1)
    assert squares[1] == pytest.approx(((there / known) ** 2).sum(), rel=0.1)


def test_how_well_a_place_is_told_is_what_one_picture_s_adjustment_says(scene):
    """By the board in one picture with the features in their planes, which tell nothing of it."""
    made = scene.with_(placement={"camera": ["focal", "k1"]})
    (picture, *_), (errors,) = pair(made), errors_of(pair(made)[:1])
    told = Bundle.of([picture], Freedom("known", "in_plane")).adjusted([errors.of_features])
    alone = errors.adjustment.covariance()
    assert told.u_placement == pytest.approx(np.sqrt(np.diag(alone)), rel=1e-6)
