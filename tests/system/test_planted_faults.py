"""Faults of the kind a good engineer makes were planted one at a time; each test here is one that had not been noticed.

The references are others' formulas: SciPy's distributions, OpenCV, marginal rays, great circles, Monte Carlo.
"""

import csv
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
import trimesh
from scipy import stats

import measure
import planner
import render
import scenes
import validation
from imaging.geometry import blur as blurs
from imaging.geometry import lens as lenses
from imaging.geometry.visibility import seen
from scenes import InvalidInput, Lens, Picture
from scenes.load import BUNDLED
from scenes.parts import mesh
from validation.report import export

SENSOR, LIGHT = (30, 135), (15, 315)


@pytest.fixture(scope="module")
def clean(task1):
    return render.image(task1, SENSOR, LIGHT)


@pytest.fixture
def saturated(task1):
    """Its top face is 12 grey levels above the end of the scale: nearly all of its pixels say 255."""
    return task1.model_copy(update={"camera": task1.camera.model_copy(update={"exposure": 260.0})})


def of_digits(level, sigma, full=255):
    """Mean and variance of a normal level, rounded, cut off at both ends of the scale: the sum over all digits."""
    digits = np.arange(full + 1)
    upper = stats.norm.cdf((digits + 0.5 - level[..., None]) / sigma)
    upper[..., -1] = 1.0
    weights = np.diff(upper, prepend=0.0, axis=-1)
    mean = weights @ digits
    return mean, weights @ digits**2 - mean**2


@pytest.mark.render
def test_a_saturated_image_is_propagated_with_the_noise_that_is_left(saturated):
    """Exactly with the variance of each pixel's digits; with the noise of an endless scale it would be 8 % more."""
    image = render.image(saturated, SENSOR, LIGHT)
    assert image.max() > 265  # margin: beyond the end of the scale at 255
    found = measure.propagate(image, saturated, SENSOR)
    mean, variance = of_digits(image, saturated.noise.sigma)
    assert found.variance_px2 == pytest.approx(float((variance * found.response**2).sum()), rel=2e-3)
    endless = saturated.noise.sigma**2 + 1 / 12
    # margin: 2 %, ten times the limit of what is right
    assert float((endless * found.response**2).sum()) / found.variance_px2 > 1.02
    # margin: second order of what the end takes away
    assert found.value_px == pytest.approx(float(measure.distance(mean, saturated, SENSOR).value_px), abs=1e-4)


@pytest.fixture(scope="module")
def many(task1, clean):
    """1500 pictures, noisy where it is looked at."""
    where = measure.region_of_interest(task1, SENSOR, LIGHT, ("gradient", "strip", "polygon"))
    return render.expose(clean, task1.noise, np.random.default_rng(7), 1500, where)


@pytest.mark.render
@pytest.mark.parametrize("estimator", ["gradient", "strip", "polygon"])
def test_both_corners_errors_are_those_of_many_pictures(estimator, task1, many):
    """All of the joint covariance, in units in which it should be the unit matrix; beside it the reported variance.

    Without the covariance between the corners, or with 1.3 x the variance, the same test fails.
    """
    count = len(many)
    found = measure.distance(many, task1, SENSOR, LIGHT, estimator)
    assert (found.status == "ok").all()
    corners = found.corners.reshape(count, 4)
    told = found.covariance.mean(0)
    limit = 5 * np.sqrt(2 / (count - 1))

    def apart(covariance):
        root = np.linalg.inv(np.linalg.cholesky(covariance))
        return np.abs(root @ np.cov(corners.T) @ root.T - np.eye(4)).max()

    assert apart(told) < limit  # margin: 4 standard errors and more
    assert apart(1.3 * told) > limit  # margin: 30 % are beyond chance
    ratio = found.value_px.var(ddof=1) / found.variance_px2.mean()
    assert abs(ratio - 1) < 4 * np.sqrt(2 / (count - 1))  # margin: 4 standard errors
    assert abs(ratio / 1.3 - 1) > 4 * np.sqrt(2 / (count - 1))  # margin: 30 % are beyond 4 standard errors


@pytest.fixture(scope="module")
def wedges():
    """Where the wedge is looked at, and a thousand pictures."""
    wedge = scenes.load("wedge")
    picture = scenes.Picture.of(wedge, wedge.settings[0].sensor, wedge.settings[0].light)
    where = measure.region_of_interest(picture)
    return picture, render.expose(render.image(picture), wedge.noise, np.random.default_rng(5), 1000, where)


@pytest.mark.render
@pytest.mark.parametrize("estimator", ["strip", "polygon"])
def test_the_corners_share_an_edge_and_so_an_error(estimator, wedges):
    """The wedge's corners share the edge e5: their covariance is not 0, and many pictures have the same one."""
    picture, pictures = wedges
    found = measure.distance(pictures, picture, estimator=estimator)
    corners = found.corners[np.isfinite(found.value_px)].reshape(-1, 4)
    assert len(corners) > 980
    told, real = found.covariance.mean(0), np.cov(corners.T)
    sigma = np.sqrt(np.diag(real))
    correlation = (told / np.outer(sigma, sigma))[:2, 2:]
    assert np.abs(correlation).max() > 0.1  # margin: that there is a correlation to be told
    # margin: 4 standard errors of 1000 pictures
    assert np.abs(correlation - (real / np.outer(sigma, sigma))[:2, 2:]).max() < 0.12


def test_shadows_of_the_object_on_itself_are_where_rays_are_stopped():
    """Points of the bracket's edges from 40 places around: `seen` against rays followed one by one."""
    solid, rng = scenes.load("bracket").solid, np.random.default_rng(3)
    fractions = (np.arange(20) + 0.5) / 20
    triangles = solid.triangles
    stopped = total = 0
    for edge in [e for e in solid.edges if np.linalg.norm(np.diff(solid.vertices[list(e.ends)], axis=0)) > 1][:25]:
        ways = rng.normal(size=(40, 3))
        places = solid.vertices.mean(0) + 60 * ways / np.linalg.norm(ways, axis=1)[:, None]
        clear = seen(solid, edge, places, fractions)
        start, stop = solid.vertices[list(edge.ends)]
        others = triangles[~np.isin(solid.triangle_faces, edge.faces)]
        points = start + fractions[:, None] * (stop - start)
        free, sure = _free(places, points, others)
        assert (clear == free)[sure].all()
        stopped, total = stopped + (~free).sum(), total + free.size
    assert 0.05 < stopped / total < 0.95  # margin: some rays, not all


def _free(places, points, triangles):
    """Whether no triangle lies between, by Moeller and Trumbore; and whether that is not decided by rounding."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    along = points[None] - places[:, None]
    normal = np.cross(along[:, :, None], (c - a))
    with np.errstate(all="ignore"):
        scale = 1 / np.einsum("pfti,ti->pft", normal, b - a)
        away = places[:, None, None] - a
        u = np.einsum("pfti,pfti->pft", normal, np.broadcast_to(away, normal.shape)) * scale
        across = np.cross(away, b - a)
        v = np.einsum("pfi,pxti->pft", along, np.broadcast_to(across, (len(places), 1, *across.shape[2:]))) * scale
        t = np.einsum("pxti,ti->pxt", across, c - a) * scale
        margin = np.minimum.reduce([u, v, 1 - u - v, t, 1 - t])
    margin = np.where(np.isfinite(margin), margin, -1)
    return (margin.max(-1) < 0), (np.abs(margin) > 1e-4).all(-1)


def test_forbidden_regions_by_great_circles(task1):
    """Haversines of the poses that a plan's constraints let pass and of those they do not."""
    poses = planner.ViewingSpace(5.0, (0.0, 90.0)).poses
    regions = ((30.0, 20.0, 25.0), (70.0, 350.0, 15.0))
    limits = planner.Constraints(forbidden_sensor=regions, forbidden_light=regions[:1], light_polar_deg=(10, 80))
    away = [2 * np.degrees(np.arcsin(np.sqrt(_haversine(poses, polar, azimuth)))) for polar, azimuth, _ in regions]
    free = [a > radius for a, (_, _, radius) in zip(away, regions, strict=True)]
    sure = np.all([np.abs(a - r[2]) > 1e-6 for a, r in zip(away, regions, strict=True)], 0)
    assert (limits.sensors(task1, poses) == free[0] & free[1])[sure].all()
    polar = (poses[:, 0] >= 10) & (poses[:, 0] <= 80)
    assert (limits.lights(poses) == free[0] & polar)[sure].all()
    assert 0 < (~limits.lights(poses)[polar]).sum() < 0.5 * polar.sum()


def _haversine(poses, polar, azimuth):
    """Of the angle between directions, by latitude and longitude."""
    latitude, other = np.radians(90 - poses[:, 0]), np.radians(90 - polar)
    longitude = np.radians(poses[:, 1] - azimuth)
    return np.sin((latitude - other) / 2) ** 2 + np.cos(latitude) * np.cos(other) * np.sin(longitude / 2) ** 2


@pytest.mark.parametrize("size", [(256, 240), (255, 240), (31, 64)])
def test_distortion_is_about_the_image_centre(task1, size):
    """OpenCV with its principal point in the middle of the pixels' centres; half a pixel off would be seen."""
    camera = task1.camera.model_copy(update={
        "width": size[0], "height": size[1], "lens": Lens(distortion=(-0.2, 0.05, 0.002, -0.001, 0.01)),
    })  # fmt: skip
    matrix = np.array([[camera.focal_px, 0, (size[0] - 1) / 2], [0, camera.focal_px, (size[1] - 1) / 2], [0, 0, 1.0]])
    ideal = np.random.default_rng(1).uniform(0, size, (50, 2))
    rays = np.column_stack([(ideal - matrix[:2, 2]) / camera.focal_px, np.ones(50)])
    theirs = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), matrix, np.array(camera.lens.coefficients))[0][:, 0]
    assert np.abs(lenses.recorded(ideal, camera) - theirs).max() < 1e-9
    shifted = lenses.recorded(ideal - 0.5, camera) + 0.5
    assert np.abs(shifted - theirs).max() > 1e-4
    assert np.abs(lenses.undistorted(theirs, camera) - ideal).max() < 1e-9


@pytest.mark.parametrize("depth", [80.0, 95.0, 100.0, 140.0])
def test_defocus_by_marginal_rays(task1, depth):
    """From the rim of the aperture through a point of the axis to the plane in focus; spread of a uniform disc."""
    radius, focus = 1.3, 90.0
    camera = task1.camera.model_copy(update={"lens": Lens(aperture_radius=radius, focus=focus)})
    rim, point = np.array([radius, 0.0]), np.array([0.0, depth])
    met = rim + (point - rim) * (focus - rim[1]) / (point[1] - rim[1])
    on_image = -met[0] / focus * camera.focal_px  # on the other side of the axis behind the focus
    assert blurs.signed_confusion(camera, np.array(depth)) == pytest.approx(on_image, rel=1e-12, abs=1e-9)
    turn, reach = np.random.default_rng(2).uniform(0, 1, (2, 200_000))
    disc = abs(on_image) * np.sqrt(reach) * np.cos(2 * np.pi * turn)
    blur = np.sqrt(disc.var() + camera.blur_px**2)
    assert float(blurs.blur_at(camera, np.array(depth), lenses.image_centre(camera))) == pytest.approx(blur, rel=8e-3)


def test_one_flat_corner_is_ill_conditioned(task1):
    """At one end a corner like any other, at the other end the same edge from both sides, 0.5 degrees apart."""
    block = scenes.Block(size=(12.5, 7.5, 2.5))
    flat = task1.model_copy(update={"object": block})
    low = planner.predict(flat, (89.7, 200), (30, 200))
    assert low.status != "ok"
    assert planner.predict(flat, SENSOR, LIGHT).status == "ok"
    assert not np.isfinite(low.variance_px2)


@pytest.mark.parametrize(("angle", "faces"), [(2e-3, 7), (2e-6, 6)])
def test_nearly_coplanar_faces(angle, faces):
    """A box whose top is folded by an angle: an edge where it can be measured, one plane where files are rounded so."""
    box = trimesh.creation.box((2.0, 2.0, 2.0))
    points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)] + [[0, -1, 1], [0, 1, 1]], float)
    points[8:, 2] += np.tan(angle / 2)
    hull = trimesh.Trimesh(points, trimesh.convex.convex_hull(points).faces, process=True) if angle > 1e-4 else box
    found = mesh.solid(trimesh.convex.convex_hull(points) if angle > 1e-4 else hull)
    assert len(found.faces) == faces


@pytest.fixture(scope="module")
def mixed(task1, tmp_path_factory):
    """Two settings at a camera of 128 x 120 px."""
    camera = task1.camera.model_copy(update={"width": 128, "height": 120, "focal_px": 400.0})
    scene = task1.model_copy(update={"camera": camera, "settings": task1.settings[3:5], "same_scale": ()})
    out = tmp_path_factory.mktemp("mixed")
    return validation.run(scene, renders=20, seed=4, out=out, workers=1)


@pytest.mark.render
def test_every_column_of_the_csv_is_the_row_s_number(mixed, tmp_path):
    path = export.write_csv(mixed, tmp_path / "table.csv")
    with path.open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == len(mixed.rows) == 2
    for line, row in zip(lines, mixed.rows, strict=True):
        whole = {
            "index": row.index, "scene": row.scene, "sensor_polar": row.sensor[0], "sensor_azimuth": row.sensor[1],
            "light_polar": row.light[0], "light_azimuth": row.light[1], "paper_ice": row.paper_ice,
            "paper_real_12": row.paper_real[0], "paper_real_10": row.paper_real[1],
            "our_ice": row.paper, "calibrated": row.calibrated, "bound": row.bound,
        }  # fmt: skip
        for judged in (row.main, *row.classic):
            low, high = judged.ratio_interval or (None, None)
            facts = {
                "propagated": judged.propagated, "empirical": judged.empirical, "n": judged.n, "failed": judged.failed,
                "ratio": judged.ratio, "ratio_low": low, "ratio_high": high, "bias_px": judged.bias,
                "predicted_bias_px": judged.predicted_bias, "rmse_px": judged.rmse, "status": judged.status,
                "correction_px": judged.correction, "u_bias_px": judged.u_bias,
            }  # fmt: skip
            whole |= {f"{judged.method}_{key}": value for key, value in facts.items()}
            assert judged.rmse**2 == pytest.approx(judged.empirical + judged.bias**2)
            assert low < judged.ratio < high  # margin: an interval holds its own ratio
        assert line == {key: "" if value is None else str(value) for key, value in whole.items()}


@pytest.mark.render
def test_a_table_that_mixes_measured_and_unmeasured_rows(mixed, tmp_path):
    """The empty row has empty cells, null in JSON, - in the tables, and counts in the verdict."""
    from validation.report.table import report
    from validation.report.terminal import console

    lost = replace(
        mixed.rows[1].main, empirical=None, failed=20, ratio=None, ratio_interval=None, bias=None, rmse=None,
        status="low_contrast",
    )  # fmt: skip
    table = replace(mixed, rows=(mixed.rows[0], replace(mixed.rows[1], main=lost)))
    with export.write_csv(table, tmp_path / "t.csv").open(newline="") as file:
        first, second = csv.DictReader(file)
    assert first["gradient_ratio"] != second["gradient_ratio"] == ""
    assert second["gradient_n"] == second["gradient_failed"] == "20"
    document = json.loads(json.dumps(table.to_json(), allow_nan=False))
    assert [row["ratio"] is None for row in document["settings"]] == [False, True]
    shown = console()
    with shown.capture() as text:
        shown.print(report(table))
    assert "- (low_contrast)" in text.get()


def test_a_picture_needs_a_scene(task1):
    with pytest.raises(InvalidInput, match="scene must be a Scene or a Picture, got str"):
        Picture.of("task1", SENSOR)


def test_the_bundled_meshes_are_within_their_limits():
    """Far from the limits, which are for other files."""
    for path in sorted(BUNDLED.glob("*.*")):
        if path.suffix in mesh.FORMATS:
            assert len(mesh.read(path).triangles) < mesh.MOST_TRIANGLES / 5
