"""Telecentric cameras against closed forms that are written here anew: a projection matrix, dual conics, ellipses.

A camera is a matrix P (3, 4) that takes homogeneous points to homogeneous images: of parallel lines of sight its last
row is (0, 0, 0, d), of a residual angle it has a little of the axis in it. A quadric with the dual matrix Q* has the
outline whose tangents l satisfy l' P Q* P' l = 0 (Hartley and Zisserman, Multiple View Geometry, 8.2).
"""

import numpy as np
import pytest

import measure
import planner
import render
import scenes
from imaging.contours.limb import limb
from imaging.geometry.blur import signed_confusion
from imaging.geometry.projection import (
    depth,
    facing,
    from_axis,
    jacobian_ideal,
    project,
    ray_origins,
    rays,
    sensor_position,
    viewpoint,
)  # fmt: skip
from imaging.geometry.visibility import hidden_spans, seen
from imaging.pictures import Pictures
from planner.budgeting.budgets import budget
from planner.budgeting.features import Features
from planner.budgeting.products import products
from planner.budgeting.sources import sources
from scenes import Camera, InvalidInput, Picture, Telecentric
from scenes.numbers import with_number
from scenes.parts.surfaces import Cone, Cylinder, Sphere, Torus
from scenes.viewpoint import Viewpoint
from validation.chain import Chain

LOOK_AT = (3.0, -2.0, 1.5)
ANGLES = (0.0, 0.15, -0.15, 2.0)  # degrees of the chief ray at the image's corner
SHEET = {
    "kind": "telecentric", "width": 320, "height": 128, "magnification": 0.1, "pixel_pitch_um": 5.0,
    "working_distance_mm": 110.0,
}  # fmt: skip
WIDE = {
    "kind": "telecentric", "width": 256, "height": 240, "magnification": 0.03, "pixel_pitch_um": 20.0,
    "working_distance_mm": 1000.0,
}  # fmt: skip
POSES = ((0.0, 0.0), (35.0, 120.0), (80.0, 250.0))


def camera(angle: float = 0.0, **more) -> Telecentric:
    """Of 640 x 480 px of 5 um, a fifth of the part's size, 110 mm away: 40 px / mm."""
    known = {"width": 640, "height": 480, "focal_px": 4400.0, "distance": 110.0, "look_at": LOOK_AT, "roll_deg": 20.0}
    return Telecentric(**known, kind="telecentric", magnification=0.2, telecentricity_deg=angle, **more)


def turned(pose, roll):
    """Right, down and forward of a sensor that looks along -z, its right along y, turned about y, z and its axis."""
    polar, azimuth = np.radians(pose)
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    forward = -np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
    down, roll = np.cross(forward, right), np.radians(roll)
    return np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right, forward


def matrix(pose, angle: float) -> np.ndarray:
    """P, px from the image's middle: magnification 40 px / mm, which the angle at 400 px makes less behind."""
    right, down, forward = turned(pose, 20.0)
    less = np.tan(np.radians(angle)) / (400 / 40)  # of the magnification, per mm
    found = np.zeros((3, 4))
    found[:, :3] = 40 * right, 40 * down, less * forward
    found[:, 3] = -found[:, :3] @ LOOK_AT
    found[2, 3] += 1
    return found


def image(points, pose, angle):
    x, y, w = matrix(pose, angle) @ np.append(points, np.ones((len(points), 1)), 1).T
    return np.stack([x / w, y / w], -1)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("pose", POSES)
def test_points_land_where_a_matrix_takes_them(pose, angle):
    points = np.random.default_rng(4).uniform(-12, 12, (50, 3))
    found = from_axis(points, np.array(pose), camera(angle))
    assert np.abs(found - image(points, pose, angle)).max() < 1e-9
    step = 1e-4
    slopes = [
        (image(points + step * e, pose, angle) - image(points - step * e, pose, angle)) / (2 * step) for e in np.eye(3)
    ]
    assert jacobian_ideal(points, np.array(pose), camera(angle)) == pytest.approx(np.stack(slopes, -1), abs=1e-6)


@pytest.mark.parametrize("angle", ANGLES)
def test_lines_of_sight_go_through_what_they_show(angle):
    """From where they begin, in the plane of the sensor, and towards the viewpoint."""
    at, pose, lens = np.array([[0.0, 0.0], [310.0, -200.0], [-17.0, 95.0]]), np.array([35.0, 120.0]), camera(angle)
    start, way = ray_origins(at, pose, lens), rays(at, pose, lens)
    for reach in (0.5, 1.0, 1.2):
        points = start + reach * way * lens.distance / lens.focal_px
        assert from_axis(points, pose, lens) == pytest.approx(at, abs=1e-9)
        towards = viewpoint(lens, pose).towards(points)
        assert np.cross(towards, way) / np.linalg.norm(way) == pytest.approx(0, abs=1e-9)
        assert (np.einsum("ni,ni->n", towards, way) < 0).all()
    assert depth(start, pose, lens) == pytest.approx(0, abs=1e-9)


def test_a_pinholes_share_of_perspective_is_that_of_its_field():
    """A chief ray's angle of atan(R / f) at the corner is a pinhole."""
    angle = float(np.degrees(np.arctan(400 / 4400)))
    lens, pinhole = (
        camera(angle),
        Camera(width=640, height=480, focal_px=4400.0, distance=110.0, look_at=LOOK_AT, roll_deg=20),
    )
    points, pose = np.random.default_rng(4).uniform(-12, 12, (50, 3)), np.array([35.0, 120.0])
    assert lens.perspective == pytest.approx(1, rel=1e-12)
    assert project(points, pose, lens) == pytest.approx(project(points, pose, pinhole), abs=1e-9)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("pose", POSES)
def test_a_sphere_s_outline_is_the_image_of_its_dual(pose, angle):
    centre, radius = np.array([4.0, -3.0, 2.0]), 2.5
    dual = np.diag([radius**2] * 3 + [0.0]) - np.outer(np.append(centre, 1), np.append(centre, 1))
    check_outline(Sphere(tuple(centre), radius), dual, pose, angle)
    if angle == 0:
        (strand,) = limb(Sphere(tuple(centre), radius), pose, camera()).strands
        middle = image(centre[None], pose, 0.0)
        assert np.linalg.norm(strand.at - middle, axis=1) == pytest.approx(40 * radius, abs=1e-9)
        assert strand.magnification == pytest.approx(40.0, rel=1e-12)
        assert strand.curvature == pytest.approx(1 / (40 * radius), rel=1e-9)


def check_outline(surface, dual, pose, angle):
    """Its points lie on the conic of the dual, and tangents there satisfy it."""
    P = matrix(pose, angle)
    conic = np.linalg.inv(P @ dual @ P.T)
    found = limb(surface, pose, camera(angle))
    assert found.status == "ok"
    for strand in found.strands:
        points = np.append(strand.at, np.ones((len(strand.at), 1)), 1)
        value, slope = np.einsum("ni,ij,nj->n", points, conic, points), 2 * (points @ conic)[:, :2]
        assert np.abs(value / np.linalg.norm(slope, axis=1)).max() < 1e-9  # px from the conic
        aside = slope / np.linalg.norm(slope, axis=1)[:, None]
        assert np.abs(np.abs((aside * strand.outward).sum(1)) - 1).max() < 1e-12


@pytest.mark.parametrize("angle", ANGLES)
def test_a_cylinders_and_a_cones_outline_are_straight_and_touch_their_ends(angle):
    """Each side's line is tangent to the images of the circles at both ends: l' P C* P' l = 0, C* of a circle."""
    axis = np.array([2.0, 1.0, 2.0]) / 3
    for surface, radii in (
        (Cylinder((4, -3, 2), tuple(axis), 2.5, (-3.0, 3.0)), (2.5, 2.5)),
        (
            Cone((4, -3, 2), tuple(axis), 2.5, (-3.0, 3.0), half_angle_deg=10.0),
            tuple(2.5 + np.tan(np.radians(10)) * h for h in (-3, 3)),
        ),
    ):
        found = limb(surface, (35, 120), camera(angle))
        assert len(found.strands) == 2
        P = matrix((35, 120), angle)
        for strand in found.strands:
            line = np.append(strand.outward[0], -strand.outward[0] @ strand.at[0])
            assert strand.at @ line[:2] + line[2] == pytest.approx(0, abs=1e-9)
            for height, radius in zip((-3.0, 3.0), radii, strict=True):
                middle = np.append(np.array([4, -3, 2]) + height * axis, 1)
                flat = np.zeros((4, 4))
                flat[:3, :3] = radius**2 * (np.eye(3) - np.outer(axis, axis))
                conic = P @ (flat - np.outer(middle, middle)) @ P.T
                foot = (P @ middle)[:2] / (P @ middle)[2]
                off = line @ conic @ line / (2 * (line[:2] @ foot + line[2]) * (P @ middle)[2] ** 2)
                assert abs(off) < 1e-9  # px, to first order


def test_a_toruss_outline_is_parallel_to_its_circles_image():
    """Parallel lines of sight: both its curves are the ellipse of its circle, moved by the tube's radius (px)."""
    pose, axis = (50.0, 30.0), np.array([1.0, 2.0, 2.0]) / 3
    torus = Torus((4, -3, 2), tuple(axis), 5.0, 1.0)
    found = limb(torus, pose, camera())
    assert found.status == "ok"
    one = np.cross(axis, [0.0, 0.0, 1.0])
    one, P = one / np.linalg.norm(one), matrix(pose, 0.0)
    two, middle = np.cross(axis, one), image(np.array([[4.0, -3.0, 2.0]]), pose, 0.0)[0]
    for strand in found.strands:
        away = strand.points - np.array([4.0, -3.0, 2.0])
        angle = np.arctan2(away @ two, away @ one)
        u, v = P[:2, :3] @ one * 5, P[:2, :3] @ two * 5
        ellipse = middle + np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
        tangent = -np.sin(angle)[:, None] * u + np.cos(angle)[:, None] * v
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        apart = strand.at - ellipse
        assert np.abs((apart * tangent).sum(1)).max() < 1e-9
        assert np.linalg.norm(apart, axis=1) == pytest.approx(40.0, abs=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1.0, -1.0])
def test_what_hides_an_edge_is_what_lines_of_sight_meet(angle):
    """Against rays to points along it, cast at every triangle."""
    bracket = scenes.load("bracket")
    scene = bracket.with_(camera={**WIDE, "look_at": bracket.camera.look_at, "telecentricity_deg": angle})
    solid, fractions = scene.solid, (np.arange(60) + 0.5) / 60
    hidden = 0
    for pose in ((55, 178), (35, 120), (70, 250)):
        eye = viewpoint(scene.camera, np.array(pose))
        for name in ("e14", "e3", "e8"):
            edge = solid.edge(name)
            found = seen(solid, edge, eye, fractions)
            start, stop = solid.vertices[list(edge.ends)]
            blocked = np.array(
                [met(solid, edge, p, eye.towards(p)) for p in start + fractions[:, None] * (stop - start)]
            )
            hidden += blocked.sum()
            assert (found == ~blocked).mean() > 0.96  # margin: but for the points beside a limit
    assert hidden > 60


def met(solid, edge, point, way):
    """Whether a triangle of another face is met from a point on (Moeller and Trumbore)."""
    others = solid.triangles[~np.isin(solid.triangle_faces, edge.faces)]
    one, two = others[:, 1] - others[:, 0], others[:, 2] - others[:, 0]
    across = np.cross(way, two)
    with np.errstate(divide="ignore", invalid="ignore"):
        size = (one * across).sum(1)
        u = ((point - others[:, 0]) * across).sum(1) / size
        round_ = np.cross(point - others[:, 0], one)
        v, t = (round_ @ way) / size, (two * round_).sum(1) / size
    return bool(((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-6)).any())


def test_faces_turn_towards_parallel_lines_of_sight_by_their_normals_alone():
    """A face beside the axis that a pinhole sees is seen edge-on."""
    block, up = scenes.block((1, 1, 1)), np.array([0.0, 0.0])
    shown = facing(block, viewpoint(camera().model_copy(update={"look_at": (50.0, 50.0, 0.0)}), up))
    assert shown.tolist() == (block.normals[:, 2] > 0.5).tolist()
    assert facing(block, np.array([50.0, 50.0, 110.0])).sum() == 3
    assert hidden_spans(block, block.edges[0], Viewpoint(np.array([0.0, 0.0, 1.0]), 0.0)).shape == (0, 2)


def test_confusion_is_a_cones_cross_section():
    """Of half angle asin(A) about the working plane, on both sides alike; with the chief ray's angle too."""
    lens = camera(numerical_aperture=0.05)
    slope = 0.05 / (1 - 0.05**2) ** 0.5
    assert signed_confusion(lens, np.array([108.0, 110.0, 113.0])) == pytest.approx([80 * slope, 0, -120 * slope])
    less = np.tan(np.radians(2.0)) / 10
    assert signed_confusion(camera(2.0, numerical_aperture=0.05), np.array([108.0])) == pytest.approx(
        80 * slope / (1 - 2 * less)
    )
    assert lens.depth_of_field(1.0) == pytest.approx(1 / 40 / slope)
    assert camera().depth_of_field(1.0) == np.inf


def test_a_camera_that_is_moved_keeps_its_lens():
    """By 2 mm away: a plane there is as large as 2 mm farther was; nothing changes without a chief ray's angle."""
    points, pose = np.array([[7.0, 1.0, 1.5], [3.0, -5.0, 1.5]]), np.array([0.0, 0.0])
    for angle in ANGLES:
        moved = camera(angle).moved_to(112.0)
        assert from_axis(points, pose, moved) == pytest.approx(image(points - [0, 0, 2.0], pose, angle), abs=1e-9)
    assert sensor_position(moved, pose)[2] == 113.5


def scene(**more):
    return scenes.load("shaft").with_(camera={**SHEET, "look_at": (0.0, 0.0, 0.0), **more})


def test_a_data_sheet_says_the_scale():
    assert scene().camera.focal_px == pytest.approx(0.1 / 5e-3 * 110)
    assert scene().with_(camera={"magnification": 0.2}).camera.focal_px == pytest.approx(0.2 / 5e-3 * 110)
    assert scene(numerical_aperture=0.02, wavelength_nm=525.0).camera.blur_px == pytest.approx(
        2**0.5 / (2 * np.pi) * 0.525 * 0.1 / 0.02 / 5, rel=1e-12
    )
    assert scene().camera.field_of_view == pytest.approx((16.0, 6.4))


def test_a_sensor_beside_its_place_changes_the_scale_of_a_lens_that_is_telecentric_on_one_side():
    """By the tangent of the chief ray's angle behind the lens, over the radius of the sensor; not if that is 0."""
    radius = np.hypot(320, 128) / 2 * 5e-3
    wider = with_number(scene(image_side_deg=3.0), "camera.flange_mm", 0.1).camera.focal_px
    assert wider / scene().camera.focal_px == pytest.approx(1 + 0.1 * np.tan(np.radians(3)) / radius, rel=1e-12)
    assert with_number(scene(), "camera.flange_mm", 0.1).camera.focal_px == scene().camera.focal_px


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"kind": "telly"}, "camera.kind must be one of 'pinhole', 'telecentric', got 'telly'"),
        ({"magnification": -1.0}, "camera.magnification must be a number greater than 0, got -1.0"),
        ({"working_distance_mm": None}, "camera.distance must be a number greater than 0, got None"),
        ({"pixel_pitch_um": None}, "camera.pixel_pitch_um must be given with magnification, got nothing"),
        ({"focal_length_mm": 25.0}, "camera.focal_length_mm must be left out with magnification, got it"),
        ({"wavelength_nm": 525.0}, "camera.numerical_aperture must be given with wavelength_nm, got nothing"),
        ({"numerical_aperture": 1.0}, "camera.numerical_aperture must be less than 1, got 1.0"),
        ({"telecentricity_deg": 50.0}, "camera.telecentricity_deg must be at most 45, got 50.0"),
        ({"focal_px": 2000.0}, "camera.focal_px must be 2200, as magnification says, got 2000"),
        ({"lens": {"aperture_radius": 1.0}}, "camera.lens.aperture_radius must be left out of a telecentric camera"),
    ],
)  # fmt: skip
def test_what_a_data_sheet_cannot_say(given, told):
    with pytest.raises(InvalidInput) as refused:
        scene(**given)
    assert told in str(refused.value)


@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_a_distance_between_faces_is_found_in_a_render_where_it_is(angle):
    """Of the first bundled block before a telecentric camera: within the bias that is predicted, and 1e-3 px."""
    block = scenes.load("task1")
    lens = {**WIDE, "look_at": block.camera.look_at, "exposure": 200.0, "telecentricity_deg": angle}
    picture = Picture.of(block.with_(camera=lens), (40, 30), (15, 270))
    shown = render.image(picture, quality=render.Quality(supersample=6, everywhere=False))
    told = planner.predict(picture)
    found = measure.distance(shown, picture)
    assert (told.status, found.status) == ("ok", "ok")
    assert found.value_px == pytest.approx(told.value_px + told.bias_px, abs=1e-3)
    assert Pictures.of(picture).viewpoint.share == pytest.approx(angle and 0.149, abs=1e-3)


HIGHER, ANGLE = 2.0, 0.15  # mm, degrees


@pytest.fixture(scope="module")
def plate():
    """Of one bore, in a small picture along its axis, without what the telecentricity's own limit adds."""
    whole = scenes.load("telecentric_plate")
    asked = [{"name": "bore", "kind": "diameter", "features": [{"circle": "c2"}], "tolerance": 0.02}]
    near = {"width": 150, "height": 140, "look_at": (6.0, 9.0, 1.5)}
    return whole.with_(camera=near, measurands=asked, uncertain=(), uncertainty={"part_shift": HIGHER}, settings=())


RADIUS = np.hypot(150, 140) / 2 * 9.9e-3 / 0.18  # mm, of the field


def measured(scene, believed=None):
    """The diameter in a render, mm."""
    picture = Picture.of(scene, (0, 90))
    shown = render.image(picture, quality=render.Quality(everywhere=False))
    return measure.measure(shown, believed or picture).value[0]


def nearer(scene, height):
    """The part that much nearer to camera, its lamp as far below it as before."""
    look_at = (*scene.camera.look_at[:2], scene.camera.look_at[2] - height)
    return scene.with_(camera={"look_at": look_at})


@pytest.mark.parametrize("angle", [0.0, ANGLE])
def test_the_budgets_height_term_is_what_a_higher_part_does(plate, angle):
    """2 mm: nothing where the chief rays are parallel, and where they are not what is measured in the picture, to 1 %.

    By hand: the diameter times the chief ray's tangent over the field's radius, times the height.
    """
    scene = plate.with_(camera={"telecentricity_deg": angle})
    found = budget(scene, (0, 90))["bore"]
    term = next((row for row in found.contributions if row.source == "part_shift.z"), None)
    told = 0.0 if term is None else term.contribution
    wider = 1 - np.tan(np.radians(angle)) / RADIUS * 1.5  # of the scale at the rim, 1.5 mm over the middle
    assert told == pytest.approx(6 * np.tan(np.radians(angle)) / RADIUS / wider * HIGHER, rel=1e-6, abs=1e-9)
    change = measured(nearer(scene, HIGHER), Picture.of(scene, (0, 90))) - measured(scene)
    assert change == pytest.approx(told, rel=0.01, abs=2e-5)


def test_a_limit_of_unknown_sign_and_a_height_act_together(plate):
    """Each alone moves nothing of a rim in the working plane; both, by the product of their uncertainties."""
    level = plate.with_(camera={"look_at": (6.0, 9.0, 3.0), "telecentricity_deg": {"value": 0.0, "half_width": 0.1}})
    found = {row.source: row.contribution for row in budget(level, (0, 90))["bore"].contributions}
    per_degree = np.radians(0.1 / 3**0.5)
    assert found["telecentricity x depth"] == pytest.approx(6 * per_degree / RADIUS * HIGHER, rel=1e-3)
    assert found.get("camera.telecentricity_deg", 0.0) < 1e-9
    assert found.get("part_shift.z", 0.0) < 1e-9


def test_a_limit_of_unknown_sign_alone_has_no_product(plate):
    """Where nothing else of the picture is uncertain, and where the angle is not."""
    for camera, count in (({"telecentricity_deg": {"value": 0.0, "half_width": 0.1}}, 1), ({}, 0)):
        scene = plate.with_(camera=camera, uncertainty={"part_shift": None})
        given = sources(scene)
        assert len(given) == count
        assert products(Features(Pictures.of(Picture.of(scene, (0, 90)))), given).tolist() == [0.0]


def test_what_is_out_of_focus_is_as_blurred_in_a_render_as_is_told():
    """A knife edge 3 mm before the working plane: the variance of its edge spread is blur^2 + c^2 / 4 + a pixel's."""
    lens = {**SHEET, "width": 64, "height": 24, "numerical_aperture": 0.02, "blur_px": 0.5, "look_at": (3.0, 1.5, -3.0)}
    told = scenes.load("telecentric_plate").with_(
        object={"kind": "block", "size": [3.0, 3.0, 0.01]}, camera=lens, measurands=(), uncertain=(), settings=()
    )
    effects = ("attached_shadow", "cast_shadow", "backlight", "lens_blur", "depth_of_field")
    shown = render.image(told, (0, 90), (), quality=render.Quality(supersample=8), effects=effects)[8:16].mean(0)
    slope = np.abs(np.diff(shown))
    place = np.arange(slope.size) + 0.5
    middle = slope @ place / slope.sum()
    spread = slope @ (place - middle) ** 2 / slope.sum()
    confusion = float(signed_confusion(told.camera, np.array(107.0)))
    assert confusion == pytest.approx(20 * 3 * 0.02 / (1 - 0.02**2) ** 0.5, rel=1e-12)
    assert spread == pytest.approx(0.5**2 + confusion**2 / 4 + 1 / 12 + 1 / 12, rel=0.02)  # and of the difference


@pytest.mark.parametrize(("aperture", "status"), [(0.0, "ok"), (0.02, "clutter")])
def test_what_a_cone_of_light_meets_beside_a_rim_is_left_to_a_simulation(plate, aperture, status):
    """The bore's wall takes part of it: 25 um of its diameter in a render, where a parallel beam leaves none."""
    told = planner.predict(plate.with_(camera={"numerical_aperture": aperture}), (0, 90), ())
    assert told.status == status


def test_straight_edges_far_out_of_focus_are_left_to_a_simulation():
    """Beyond half a pixel of confusion: of a block that reaches 9 cm beyond the working plane."""
    block = scenes.load("task1")
    found = []
    for aperture in (0.0, 0.001, 0.02):
        lens = {**WIDE, "look_at": block.camera.look_at, "exposure": 200.0, "numerical_aperture": aperture}
        found.append(planner.predict(block.with_(camera=lens), (40, 30), (15, 270)).status)
    assert found == ["ok", "ok", "clutter"]


def test_what_two_inputs_do_together_is_the_chains_second_order(plate):
    """Of stations whose points are recorded anew, at one standard uncertainty of each; what is drawn has it once."""
    level = plate.with_(camera={"look_at": (6.0, 9.0, 3.0), "telecentricity_deg": {"value": 0.0, "half_width": 0.1}})
    found = budget(level, (0, 90))
    chain, names = Chain(found), [source.name for source in found.sources]
    curved = chain.expansion[2][0]
    angle = names.index("camera.telecentricity_deg")
    together = np.linalg.norm(np.delete(curved[angle], angle))
    told = {row.source: row.contribution for row in found["bore"].contributions}["telecentricity x depth"]
    assert told == pytest.approx(together, rel=2e-3)
    assert told > 1e-4
    drawn = {term.name: np.ones(1) for term in found.terms[0]}
    added = chain.added(0, drawn)
    assert chain.added(0, drawn | {"telecentricity x depth": np.zeros(1)}) == added
