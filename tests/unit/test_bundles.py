"""Several pictures adjusted together: against today's one picture, closed forms, least squares over everything, drawn
errors; what pictures leave open."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

import measure
import planner
import render
import scenes
from imaging.blurred.whole import image
from imaging.bundles.bundle import Bundle
from imaging.bundles.cameras import root
from imaging.bundles.preferred import Preferred
from imaging.bundles.told import Told
from imaging.bundles.unknowns import Freedom
from imaging.features.displaced import by_camera
from imaging.models import variance_model
from imaging.pictures import Pictures
from planner.budgeting.bundles import bundle_budget
from planner.budgeting.features import Features
from planner.budgeting.sources import sources
from planner.budgeting.station import Station
from scenes import InvalidInput, Picture, Pose
from scenes.cameras.covariance import ORDER
from tests import placements as parts
from tests import toleranced
from tests.bundles import SENSOR_SD, UNSURE, camera, exact_covariance, line_covariance, project, widths

LIGHT = (22.0, 60.0)
SENSORS = (28.0, 300.0), (30.0, 60.0), (25.0, 200.0)
KNOWN = {"from": "known", "datums": [], "datum_sd": None}


def corner(vertex, *edges):
    return {"vertex": vertex, "edges": list(edges)}


TOP = (corner("corner", "e8", "e11"), corner("v2", "e4", "e5"), corner("v4", "e4", "e8"), corner("v6", "e5", "e11"))
LENGTH = {"name": "length", "kind": "distance", "features": [*TOP[:2]]}
SQUARE = {"name": "square", "kind": "angle", "features": [{"edge": "e4"}, {"edge": "e8"}]}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("bundles")


@pytest.fixture(scope="module")
def roof(folder):
    """A part with features at three heights, in pictures from three sides, whose sensors are not sure."""
    scene = parts.scene(folder, "roof", placement=KNOWN, uncertainty=UNSURE)
    return tuple(Picture.of(scene, sensor, LIGHT) for sensor in SENSORS)


def noise_of(pictures):
    return [variance_model("calibrated")(Pictures.of(each)).of_features for each in pictures]


def test_what_rows_tell_is_what_dense_algebra_says():
    """Random rows of a known null space: rank, pseudo-inverse, and which functions change along it."""
    rng = np.random.default_rng(1)
    space = np.linalg.qr(rng.standard_normal((9, 9)))[0]
    rows, units = rng.standard_normal((14, 7)) @ space[:7], np.geomspace(0.1, 10, 9)
    told = Told(rows, units)
    assert (told.rank, told.freedom) == (7, 7)
    inside, outside = rng.standard_normal((5, 7)) @ space[:7], rng.standard_normal((5, 9))
    assert told.is_told(inside).all()
    assert not told.is_told(outside).any()
    expected = inside @ np.linalg.pinv(rows.T @ rows) @ inside.T
    np.testing.assert_allclose(told.gain(inside) @ told.gain(inside).T, expected, rtol=1e-9, atol=1e-12)


def test_one_picture_of_features_in_their_planes_is_today_s_adjustment(folder):
    """Noise, and what part and datums leave open, of the same lines by `imaging.features.placing`.

    Of datums both together: here what is known of these is weighed with their own images, too.
    """
    plain = {"from": "uncertain", "datums": [], "datum_sd": None}
    for placement in (plain, {"datums": ["e4", "e11"], "datum_sd": 0.02}):
        picture = Picture.of(parts.scene(folder, "block", placement=placement), parts.SENSOR, parts.LIGHT)
        errors = variance_model("calibrated")(Pictures.of(picture))
        told = Bundle.of([picture], Freedom("known", "in_plane")).adjusted([errors.of_features])
        noise, placed = np.diag(told.covariance), sum(part**2 for part in told.known_before.values())
        np.testing.assert_allclose(noise + placed, errors.variances_object + errors.placed, rtol=1e-6)
        assert (errors.placed > 10 * errors.variances_object).all()
        if placement is plain:
            np.testing.assert_allclose(noise, errors.variances_object, rtol=1e-6)


def test_circles_in_their_planes_are_today_s_too():
    scene = scenes.load("plate").with_(
        measurands=[
            {"name": "bore", "kind": "diameter", "features": [{"circle": "c2"}]},
            {"name": "place", "kind": "offset", "features": [{"circle": "c2"}, {"edge": "e5"}]},
        ],
        uncertainty={"part_shift": 0.01, "part_tilt_deg": 0.02},
        placement={"from": "uncertain"},
    )
    picture = Picture.of(scene, (35, 70), (20, 225))
    errors = variance_model("calibrated")(Pictures.of(picture))
    told = Bundle.of([picture], Freedom("known", "in_plane")).adjusted([errors.of_features])
    np.testing.assert_allclose(np.diag(told.covariance), errors.variances_object, rtol=1e-6)
    np.testing.assert_allclose(told.known_before["part"] ** 2, errors.placed, rtol=1e-6)


def test_kinds_of_measurands_in_space_are_those_of_one_picture_s_planes(folder):
    """All kinds of edges and circles, and what lies between some: values of the part, variances of one picture."""
    scene = toleranced.scene(folder, facets=48)
    picture = Picture.of(scene, (25, 290), (20, 200))
    errors = variance_model("calibrated")(Pictures.of(picture))
    bundle = Bundle.of([picture], Freedom("known", "in_plane"))
    np.testing.assert_allclose(bundle.nominal[0], errors.measurands.value_object, rtol=1e-6, atol=1e-6)
    told = bundle.adjusted([errors.of_features])
    assert told.is_told.all()
    np.testing.assert_allclose(np.diag(told.covariance), errors.variances_object, rtol=1e-5)


def test_derivatives_of_a_picture_are_those_of_exact_projection(folder):
    """Central differences of `Bundle.expected` by every unknown: lines, circles; part, sensors, tilted axes."""
    plate = scenes.load("plate").with_(
        measurands=[{"name": "place", "kind": "offset", "features": [{"circle": "c2"}, {"edge": "e5"}]}],
        uncertainty={"part_shift": 0.01, "part_tilt_deg": 0.02},
    )
    pictures = [Picture.of(plate, sensor, (20, 225)) for sensor in ((35, 70), (30, 200))]
    bundle = Bundle.of(pictures, Freedom("unknown", "in_space", "unknown"))
    assert bundle.unknowns.count == 6 + 2 * 6 + 2 * 3 + 6
    for k in range(bundle.unknowns.count):
        step = np.eye(bundle.unknowns.count)[k] * 1e-4
        ahead, behind = bundle.expected(step), bundle.expected(-step)
        for design, one, other in zip(bundle.designs, ahead, behind, strict=True):
            slope = (one - other) / 2e-4
            np.testing.assert_allclose(design[:, k], slope, rtol=1e-5, atol=1e-5 * np.abs(design[:, k]).max() + 1e-7)


def test_depth_of_two_parallel_cameras_is_the_stereo_formula(folder):
    """sigma_z = z^2 sigma_d / (f b) of a corner whose image is known to sigma in both directions in both pictures."""
    made = parts.scene(folder, "block", placement=KNOWN, uncertainty={"part_shift": None, "part_tilt_deg": None})
    corners = [corner("v8", "e8", "e11"), corner("v2", "e4", "e5")]
    made = made.with_(measurands=[{"name": "diagonal", "kind": "distance", "features": corners}])
    base, sigma = 20.0, 0.03
    sides = [made.with_(camera={"look_at": [x, 0.0, 6.0]}) for x in (-base / 2, base / 2)]
    bundle = Bundle.of([Picture.of(side, (0, 0), LIGHT) for side in sides], Freedom("known"))
    errors = []
    for seen in bundle.seen:
        whole = np.zeros((seen.count, seen.count))
        for e, length in enumerate(np.linalg.norm(seen.along, axis=1)):
            whole[2 * e : 2 * e + 2, 2 * e : 2 * e + 2] = [[1, -1 / length], [-1 / length, 2 / length**2]]
        errors.append(sigma**2 * whole)
    told = bundle.adjusted(errors).told
    top = made.solid.vertex("v8")[2]
    away, focal = made.camera.distance + 6.0 - top, made.camera.focal_px
    upwards = bundle.unknowns.basis("v8")[2]
    assert told.is_told(upwards[None]).all()
    found = np.linalg.norm(told.gain(upwards[None]))
    assert found == pytest.approx(away**2 * np.sqrt(2) * sigma / (focal * base), rel=1e-9)


def test_the_adjustment_is_that_of_least_squares_over_everything(roof):
    """`scipy.optimize.least_squares`, numerical Jacobian, a projection of its own, three uncertain sensors.

    Values and their covariance by noise and by sensors together.
    """
    scene, rng = roof[0].scene, np.random.default_rng(3)
    bundle, noise = Bundle.of(roof, Freedom("uncertain")), noise_of(roof)
    adjustment, unknowns = bundle.adjusted(noise), bundle.unknowns
    roots = [np.linalg.cholesky(np.where(np.isfinite(each), each, 0.0)) for each in noise]
    found = [root @ rng.standard_normal(len(root)) for root in roots]
    names, start = bundle.seen[0].names, scene.solid.vertices[list(unknowns.vertices)]
    ends = [[unknowns.vertices.index(end) for end in scene.solid.edge(name).ends] for name in names]

    def rows(numbers):
        sensors, places = numbers[:12].reshape(3, 4), start + numbers[12:].reshape(-1, 3)
        left = [(sensors / SENSOR_SD).ravel()]
        for k, (pose, seen) in enumerate(zip(SENSORS, bundle.seen, strict=True)):
            there = project(places, *camera(scene, pose, sensors[k]))
            off = []
            for e, (i, j) in enumerate(ends):
                along = there[j] - there[i]
                normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
                cosine = normal @ seen.normals[e]
                off += [normal @ (there[i] - seen.start[e]) / cosine, np.arctan2(
                    -normal[0] * seen.normals[e][1] + normal[1] * seen.normals[e][0], cosine)]  # fmt: skip
            left.append(np.linalg.solve(roots[k], found[k] - np.array(off)))
        return np.concatenate(left)

    solved = least_squares(rows, np.zeros(12 + start.size), "3-point", method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14)

    def values(numbers):
        places = scene.solid.vertices.copy()
        places[list(unknowns.vertices)] += numbers[12:].reshape(-1, 3)
        return widths(scene.solid, scene.quantities, places)

    steps = 1e-5 * np.eye(solved.x.size)
    gradient = np.stack([(values(h) - values(-h)) / 2e-5 for h in steps], -1)
    jacobian = np.stack([(rows(h) - rows(-h)) / 2e-5 for h in steps], -1)
    sizes, axes = np.linalg.eigh(jacobian.T @ jacobian)
    kept = sizes > 1e-8 * sizes.max()
    pulls = gradient @ axes[:, kept]
    expected = (pulls / sizes[kept]) @ pulls.T
    numbers, squares = adjustment.solved(found)
    assert squares == pytest.approx(2 * solved.cost, rel=3e-4)  # derivatives of what is expected: 4e-5 found
    off = bundle.values(numbers) - values(solved.x)
    assert (np.abs(off) < 0.05 * np.sqrt(np.diag(expected))).all(), off  # the same: 0.02 found
    whole = adjustment.covariance + sum(pull @ pull.T for pull in adjustment.by_priors.values())
    np.testing.assert_allclose(whole, expected, rtol=1e-5)


@pytest.mark.parametrize(("sensors", "sd"), [("uncertain", SENSOR_SD), ("known", None)])
def test_the_adjustment_of_what_images_tell_is_their_fisher_matrix(folder, sensors, sd):
    """Two pictures of a block pixel by pixel, all its vertices free in space, against lines adjusted; 1e-8 found.

    Negative control: one edge less that ties both pictures.
    """
    pairs = [("e4", "e11"), ("e5", "e8"), ("e9", "e12"), ("e10", "e11"), ("e1", "e6"), ("e2", "e4"), ("e3", "e5")]
    asked = [
        {"name": f"{a} {b}", "kind": "width", "features": [{"edge": a}, {"edge": b}]} for a, b in (*pairs, ("e7", "e8"))
    ]
    scene = parts.scene(folder, "block", placement=KNOWN, uncertainty=UNSURE, measurands=asked)
    pictures = tuple(Picture.of(scene, sensor, LIGHT) for sensor in SENSORS[:2])
    exact = exact_covariance(pictures, sd)
    bundle = Bundle.of(pictures, Freedom(sensors))
    errors = [line_covariance(picture, seen) for picture, seen in zip(pictures, bundle.seen, strict=True)]
    told = bundle.adjusted(errors)
    assert told.is_told[:2].all()
    whole = told.covariance + sum(pull @ pull.T for pull in told.by_priors.values())
    both = np.ix_(told.is_told, told.is_told)
    np.testing.assert_allclose(whole[both], exact[both], rtol=1e-4, atol=1e-6 * exact[both].max())
    counts = [np.arange(seen.count) // 2 != seen.names.index("e8") for seen in bundle.seen]
    less = bundle.adjusted(errors, counts)
    assert less.covariance[1, 1] > 1.01 * told.covariance[1, 1]


def test_drawn_sensors_and_noise_scatter_as_told(roof):
    """80 drawn sets of three pictures, exact projection; negative controls: a third as much, noise alone, sensors
    taken for known."""
    rng, count = np.random.default_rng(4), 80
    bundle, noise = Bundle.of(roof, Freedom("uncertain")), noise_of(roof)
    adjustment, unknowns = bundle.adjusted(noise), bundle.unknowns
    as_known = Bundle.of(roof, Freedom("known")).adjusted(noise)
    roots = [np.linalg.cholesky(each) for each in noise]
    sds = np.concatenate([np.where(np.isfinite(block.sd), block.sd, 0.0) for block in unknowns.blocks])
    off, wrong = [], []
    for _ in range(count):
        there = bundle.expected(sds * rng.standard_normal(unknowns.count))
        found = [h + root @ rng.standard_normal(len(root)) for h, root in zip(there, roots, strict=True)]
        off.append(bundle.values(adjustment.solved(found)[0]) - bundle.nominal[0])
        wrong.append(as_known.bundle.values(as_known.solved(found)[0]) - bundle.nominal[0])
    sigma2 = np.diag(adjustment.covariance)
    u2 = sigma2 + sum(part**2 for part in adjustment.known_before.values())
    ratio, chance = np.var(off, 0) / u2, 4 * np.sqrt(2 / count)
    assert (np.abs(ratio - 1) < chance).all(), ratio
    assert (np.abs(np.mean(off, 0)) < 4 * np.sqrt(u2 / count)).all()
    assert (np.abs(ratio * 3 - 1) > chance).all()
    assert (np.var(off, 0) / sigma2 > 1 + chance).all()
    assert (np.var(wrong, 0) > (1 + chance) * np.diag(as_known.covariance)).all()


def test_what_pictures_leave_open_is_told_and_has_no_value():
    """Of unknown sensors three pictures tell no length, for want of a scale, but an angle; two tell neither; two datums
    give the scale; and one picture tells nothing where features may lie anywhere."""
    scene = scenes.load("plate").with_(measurands=[LENGTH, SQUARE], uncertainty={"part_shift": None})
    tri = [Picture.of(scene, sensor, (20, 225)) for sensor in ((35, 70), (30, 200), (25, 310))]
    told = planner.predict_bundle(tri, "unknown", close=False)
    assert told.status == ("unplaced", "glanced")
    assert told.reason[0] == "nothing tells the scale: where sensors stand must be known, or datums be named"
    assert np.isfinite(told.u).tolist() == [False, True]
    assert planner.predict_bundle(tri[:2], "unknown", close=False).status == ("unplaced", "unplaced")
    assert planner.predict_bundle(tri, "uncertain", close=False).status == ("glanced", "glanced")
    alone = planner.predict_bundle(tri[:1], "known", close=False)
    assert alone.status == ("unplaced", "unplaced")
    assert "one picture leaves open where" in alone.reason[0]
    pair = {"from": "datums", "datums": ["e4", "e11"], "datum_sd": 0.002}
    made = scene.with_(placement=pair, uncertainty={"part_shift": 1.0, "part_tilt_deg": 1.0})
    datums = planner.predict_bundle([each.with_scene(made) for each in tri], "unknown", close=False)
    assert datums.status == ("glanced", "glanced")
    assert datums.u_placed[0] > 0.001  # what its datums are not sure of


CALIBRATED = {
    "names": ["fx", "cx", "cy", "k1"],
    "matrix": [[0.36, 0, 0, 1e-4], [0, 0.16, 0, 0], [0, 0, 0.16, 0], [1e-4, 0, 0, 1e-6]],
}


def test_what_a_camera_s_errors_move_is_what_a_budget_has(folder):
    """Derivatives of lines and a circle against those of recorded points (`planner.budgeting`), which weigh the part of
    an edge that is used, and places around a rim by contrast: where distortion bends a line that is a few percent."""
    plate = scenes.load("plate").with_(
        measurands=[LENGTH, SQUARE, {"name": "bore", "kind": "diameter", "features": [{"circle": "c2"}]}],
        uncertainty={"covariance": CALIBRATED},
    )
    pictures = Pictures.of(Picture.of(plate, (35, 70), (20, 225)))
    features = Features(pictures)
    ours, here = by_camera(features.known.seen), Station.nominal(pictures)
    assert root(plate) @ root(plate).T == pytest.approx(np.array(_grown(CALIBRATED)), abs=1e-12)
    for each in sources(plate):
        step = 1e-5 * each.scale
        ahead, behind = features.errors([each.moved(here, step), each.moved(here, -step)])
        ours_now = ours[:, ORDER.index(each.name)] + (ours[:, ORDER.index("fy")] if each.name == "fx" else 0.0)
        expected, bent = (ahead - behind) / (2 * step), each.name == "k1"
        off = np.abs(ours_now - expected) / np.abs(expected).max()
        assert off.max() < (0.1 if bent else 0.02), (each.name, off)


def _grown(told):
    """A covariance of fx, cx, cy, k1 as one of all nine parameters, fy as fx."""
    whole = np.zeros((9, 9))
    which = [ORDER.index(name) for name in told["names"]]
    whole[np.ix_(which, which)] = told["matrix"]
    whole[1] = whole[0]
    whole[:, 1] = whole[:, 0]
    return whole


def test_a_budget_of_several_pictures_has_what_is_adjusted_and_what_is_not(roof):
    """Rows by name; their squares add up to noise and `u_placed`; one camera for all is another thing than three."""
    scene = roof[0].scene.with_(uncertainty={"covariance": CALIBRATED, "rounding": 0.001})
    pictures = [each.with_scene(scene) for each in roof]
    told = planner.predict_bundle(pictures)
    budgets = bundle_budget(pictures)
    assert budgets.statuses == told.status
    for m, each in enumerate(budgets):
        rows = {row.source: row.contribution for row in each.contributions}
        assert {"pixel noise", "sensor 1", "sensor 2", "sensor 3", "camera", "rounding"} <= set(rows)
        adjusted = sum(rows[name] ** 2 for name in ("pixel noise", "sensor 1", "sensor 2", "sensor 3", "camera"))
        assert adjusted == pytest.approx(told.u[m] ** 2, rel=1e-6)
        assert each.value == pytest.approx(told.value[m])
    known = {row.source: row.contribution for row in bundle_budget(pictures, "known")["length"].contributions}
    assert {"sensor_distance 1", "sensor_deg.azimuth 2", "camera"} <= set(known)
    assert planner.predict_bundle(pictures, cameras="each").u[0] != pytest.approx(told.u[0], rel=1e-3)
    with pytest.raises(InvalidInput, match="length must be measurable for a budget, got unplaced: "):
        bundle_budget(pictures[:1])


def test_a_datum_that_no_picture_shows_well_is_not_measured_by_the_drawing():
    """Two datums, one of them clutter in both pictures: the angle between them leans on it and is clutter, not ok;
    where it is not seen at all there is none, though the drawing tells one."""
    pair = {"from": "datums", "datums": ["e4", "e8"], "datum_sd": 0.001}
    scene = scenes.load("plate").with_(
        measurands=[SQUARE], placement=pair, uncertainty={"part_shift": 1.0, "part_tilt_deg": 1.0}
    )
    pictures = [Picture.of(scene, sensor, (20, 225)) for sensor in ((35, 70), (30, 200))]
    bundle, noise = Bundle.of(pictures, Freedom("known")), noise_of(pictures)
    for second, says in (("ok", "ok"), ("clutter", "clutter"), ("short", "short")):
        states = [np.array(["ok", second])] * 2
        assert bundle.seen[0].names == ("e4", "e8")
        told = Preferred.of(bundle, noise, states)
        assert told.statuses(states) == (says,)
        assert np.isfinite(told.u_placed[0]) == (second != "short")
    assert told.good.is_told.all()
    assert told.reasons == ("no picture shows a datum that it needs, which is known by the drawing alone",)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda two: Freedom("sure"), "sensors must be one of known, uncertain, unknown, got 'sure'"),
        (lambda two: Freedom(shape="flat"), "shape must be one of in_space, in_plane, got 'flat'"),
        (lambda two: Bundle.of(two, Freedom(("known",))), "sensors must be one for all, or one for each of 2 pictures"),
        (lambda two: Bundle.of([], Freedom()), "pictures must be at least one, got none"),
        (
            lambda two: Bundle.of([two[0], two[1].with_scene(scenes.load("plate"))], Freedom()),
            "pictures must be of one",
        ),
        (
            lambda two: Bundle.of([Picture.of(scenes.load("shaft"), (20, 0))], Freedom()),
            "straight edges and circ",
        ),
        (lambda two: measure.bundle([]), "shots must be at least one image with its picture, got none"),
        (lambda two: planner.predict_bundle(two, model="bound"), "model must be one of calibrated, paper"),
    ],
)
def test_what_cannot_be_is_told_in_a_line(roof, make, says):
    with pytest.raises(InvalidInput, match=says):
        make(roof[:2])


def test_two_pictures_are_measured_as_told(roof):
    """30 noisy images each: scatter inside 4 times chance, means within 0.3 sigma and chance; displaced sensors."""
    count, rng = 30, np.random.default_rng(5)
    shots = [(render.expose(image(each), each.scene.noise, rng, count), each) for each in roof[:2]]
    found = measure.bundle(shots, "known")
    assert (found.status == "ok").all()
    ratio = found.value.var(0, ddof=1) / found.sigma.mean(0) ** 2
    assert (np.abs(ratio - 1) < 4 * np.sqrt(2 / count)).all(), ratio
    assert (np.abs(found.value.mean(0) - found.nominal) < (0.3 + 4 / np.sqrt(count)) * found.sigma.mean(0)).all()
    predicted = planner.predict_bundle(roof[:2], "known", model="calibrated")
    one = measure.bundle([(stack[0], each) for stack, each in shots], "known", estimator="gradient")
    np.testing.assert_allclose(one.sigma, predicted.sigma, rtol=0.1)
    assert set(one.status) == set(predicted.status) == {"clutter"}


@pytest.fixture(scope="module")
def corrected(roof):
    """Two exact pictures of the roof, and what `gradient` finds in them that is not there."""
    images = [image(each) for each in roof[:2]]
    pairs = zip(images, roof[:2], strict=True)
    return images, [measure.correction(measure.Images((clean, clean)), each, "gradient") for clean, each in pairs]


def test_biases_are_taken_off_line_by_line(roof, corrected):
    """20 noisy images of lines that are clutter: means within 0.3 u and chance, variances inside 4 times chance, and
    what is predicted; negative control: as they are found one value is 2.7 sigma off."""
    count, rng = 20, np.random.default_rng(1)
    images, told = corrected
    shots = [
        (render.expose(clean, each.scene.noise, rng, count), each) for clean, each in zip(images, roof, strict=False)
    ]
    found = measure.bundle(shots, "known", corrections=told)
    assert (found.status == "ok").all()
    off = (found.value - found.nominal) / found.u
    assert (np.abs(off.mean(0)) < 0.3 + 4 / np.sqrt(count)).all()
    assert (np.abs(off.var(0, ddof=1) - 1) < 4 * np.sqrt(2 / count)).all()
    plain = measure.bundle(shots, "known", estimator="gradient")
    assert (plain.status == "clutter").all()
    assert np.isnan(plain.u_bias).all()
    assert np.abs(((plain.value - plain.nominal) / plain.sigma).mean(0)).max() > 1.5 + 4 / np.sqrt(count)
    np.testing.assert_allclose(plain.value - found.value, found.bias, atol=0.2 * found.sigma.min())
    expected = planner.predict_bundle(roof[:2], "known", biases=[each.features for each in told])
    assert expected.status == ("ok", "ok")
    np.testing.assert_allclose(found.sigma.mean(0), expected.sigma, rtol=0.05)


def unsure(told, sources, rendering=0.0):
    """A correction whose lines' biases are not sure of what sources move them by."""
    features = replace(told.features, moved=sources, rendering=rendering * np.eye(len(told.features.bias)))
    return replace(told, features=features)


def test_what_biases_are_not_sure_of_goes_together_where_its_cause_does(roof, corrected):
    """Of drawn inputs of two pictures that share reflectances and not a light, the adjustment's values scatter as told;
    negative control: each picture its own reflectances. Where that is more than noise and zone allow: clutter."""
    rng, (_, told) = np.random.default_rng(8), corrected
    apart = [roof[0], replace(roof[1], lights=(Pose(30.0, 60.0),))]
    moves = [0.1 * rng.standard_normal((2, 8)) * np.tile([1, 0.01], 4) for _ in apart]
    lamps = [0.1 * rng.standard_normal((1, 8)) * np.tile([1, 0.01], 4) for _ in apart]
    given = [
        unsure(each, {"reflectance": move, "light_place": lamp}, 1e-8).features
        for each, move, lamp in zip(told, moves, lamps, strict=True)
    ]
    known = planner.predict_bundle(apart, "known", biases=given)
    pulls, count = known.preferred.by_features, 4000
    shared, own, rays = (rng.standard_normal((count, *size)) for size in ((2,), (2, 1), (2, 8)))
    drawn = sum(
        (shared @ move + own[:, k] @ lamp + 1e-4 * rays[:, k]) @ pull.T
        for k, (move, lamp, pull) in enumerate(zip(moves, lamps, pulls, strict=True))
    )
    u2, chance = known.u_bias**2, 4 * np.sqrt(2 / count)
    assert (np.abs(drawn.var(0) / u2 - 1) < chance).all()
    alone = sum(((move @ pull.T) ** 2).sum(0) for move, pull in zip(moves, pulls, strict=True))
    assert (np.abs(known.doubts["reflectance"] ** 2 / alone - 1) > 2 * chance).any()
    assert known.status == ("clutter", "clutter")
    rows = {row.source: row.contribution for row in bundle_budget(apart, "known", biases=given)["length"].contributions}
    assert np.linalg.norm(
        [rows[f"bias by {name}"] for name in ("reflectance", "light_place", "rendering")]
    ) == pytest.approx(known.u_bias[0], rel=1e-3)
    assert "model error" not in rows


def test_a_picture_whose_biases_are_not_known_is_left_out_where_that_can_be(roof, corrected):
    images, told = corrected
    none = replace(told[1], features=None)
    found = measure.bundle(list(zip(images, roof, strict=False)), "known", corrections=[told[0], none])
    assert set(found.status) == {"clutter"}
    assert np.isinf(found.u_bias).all()
    with pytest.raises(InvalidInput, match="corrections must be one for each of 2 pictures, got 1"):
        measure.bundle(list(zip(images, roof, strict=False)), "known", corrections=told[:1])
    with pytest.raises(InvalidInput, match="biases must be one for each of 2 pictures, got 1"):
        planner.predict_bundle(roof[:2], "known", biases=[None])


@pytest.fixture(scope="module")
def told_wrong(roof):
    """Three images, of which the third is of a sensor 0.5 degrees from where it is said."""
    there = (*roof[:2], Picture.of(roof[2].scene, (25.0, 200.5), LIGHT))
    rng = np.random.default_rng(6)
    images = [render.expose(image(each), each.scene.noise, rng, 1)[0] for each in there]
    return list(zip(images, roof, strict=True))


def test_a_sensor_that_is_told_wrong_is_a_misfit(told_wrong):
    found = measure.bundle(told_wrong, "known")
    assert set(found.status) == {"misfit"}
    assert found.p_value < 1e-4


def test_a_sensor_that_is_not_known_is_found(told_wrong):
    found = measure.bundle(told_wrong, ("known", "known", "unknown"))
    assert set(found.status) == {"ok"}
    assert (np.abs(found.value - found.nominal) < 4 * found.sigma).all()
    assert found.pictures[2].sensor.azimuth_deg == pytest.approx(200.5, abs=0.05)
    assert len(found.places) == len(found.points) == 4
