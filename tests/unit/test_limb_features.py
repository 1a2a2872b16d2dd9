"""Curved bodies end to end: what moves their limbs, what is refused, and prediction beside measurement."""

import numpy as np
import pytest
from scipy.optimize import brentq

import scenes
from imaging.features.limb_outline import limb_outline, limb_places
from imaging.features.limbs import limb_rim
from imaging.features.measurand import measurands
from imaging.geometry.projection import sensor_position
from imaging.pictures import Pictures
from imaging.pose_scatter import _half_angle
from measure.features.optics import Optics
from render import Quality
from scenes import Ball, InvalidInput, Picture, Turned
from tests.proofs.centres import centre_at, scene_beside
from tests.proofs.limbs import rows_at, scene_of
from tests.proofs.silhouettes import LIMIT_PX, cone_of, silhouettes

QUICK = Quality(edge_samples=16)
CONE = Turned(kind="turned", profile=[(-5.0, 3.0), (5.0, 2.0), (5.0, 4.0), (9.0, 4.0)]).solid
BALL = Ball(kind="ball", radius=3.0, centre=(0.5, -0.2, 0.3)).solid


@pytest.mark.parametrize("curved", [*BALL.curved, *CONE.curved], ids=["ball", "cone", "cylinder"])
@pytest.mark.parametrize("which", range(4))
def test_limb_moves_as_its_design_says(curved, which):
    """Central differences of the outline along its normal, relative to 1e-6; of the cone by its half angle, too."""
    if which == curved.count:
        assert curved.count == 3 + (curved.name == "d1")
        return
    camera = scenes.load("ball").camera.model_copy(update={"look_at": (0, 0, 0)})
    pose, step = np.array([70.0, 30.0]), 1e-4
    nominal, eye = limb_outline(curved, pose, camera, 32), sensor_position(camera, pose)
    error = np.eye(curved.count)[which] * step
    ahead, behind = (limb_outline(curved.moved(eye, tuple(sign * error)), pose, camera, 32) for sign in (1, -1))
    seen = nominal.seen & ahead.seen & behind.seen
    moved = ((ahead.at - behind.at) * nominal.outward).sum(-1)[seen] / (2 * step)
    assert seen.any()
    assert np.abs(moved - nominal.design[seen, which]).max() < 1e-6 * np.abs(nominal.design[seen]).max()


def test_walls_of_a_turned_part_are_told_with_their_facets():
    assert [(c.name, type(c.surface).__name__, c.radius, len(c.faces)) for c in CONE.curved] == [
        ("d1", "Cone", 2.5, 48), ("d2", "Cylinder", 4.0, 48),
    ]  # fmt: skip
    for curved in CONE.curved:
        corners = CONE.vertices[[v for f in curved.faces for v in CONE.faces[f]]]
        assert np.abs(curved.surface.values(corners)).max() < 1e-12
    assert not CONE.sharp


@pytest.mark.parametrize(
    ("part", "values", "match"),
    [
        ("object", {"kind": "turned", "profile": [[0, 1], [-1, 1]]}, "profile must be different points"),
        ("object", {"kind": "turned", "profile": [[0, 1], [0, 2], [1, 2]]}, "profile must begin and end with a wall"),
        ("object", {"kind": "ball", "radius": 0}, "radius"),
        ("camera", {"lens": {"distortion": [0.1, 0, 0, 0, 0]}}, "lens must be without distortion"),
    ],
)
def test_what_limbs_are_not_known_with_is_refused(part, values, match):
    data = scenes.load("ball").model_dump(mode="json", exclude_defaults=True)
    data[part] = values if part == "object" else data[part] | values
    with pytest.raises(ValueError, match=match):
        scenes.Scene.model_validate(data)


@pytest.mark.parametrize(
    ("scene", "values", "match"),
    [
        ("ball", {"kind": "taper"}, "must be a cone for kind taper, got 'ball'"),
        ("shaft", {"kind": "position", "features": [{"surface": "d1"}]}, "must be a ball for kind position, got 'd1'"),
        ("ball", {"kind": "taper", "features": [{"circle": "c1"}]}, "features must be a curved surface for kind taper"),
        ("ball", {"kind": "position", "nominal": 1.0}, "nominal must be two numbers for kind position"),
        ("ball", {"kind": "position", "features": [{"edge": "e1"}]}, "then an edge; or a curved surface for kind pos"),
    ],
)
def test_measurands_that_a_surface_has_not_are_refused(scene, values, match):
    data = scenes.load(scene).model_dump(mode="json", exclude_defaults=True)
    data["measurands"] = [data["measurands"][0] | {"tolerance": 0.1} | values]
    with pytest.raises(ValueError, match=match):
        scenes.Scene.model_validate(data)


def test_an_unknown_surface_is_refused():
    data = scenes.load("ball").model_dump(mode="json", exclude_defaults=True)
    data["measurands"][0]["features"] = [{"surface": "egg"}]
    with pytest.raises(ValueError, match=r"surface must be one of ball, got 'egg'"):
        scenes.Scene.model_validate(data)


def test_a_light_on_one_side_shows_one_limb_of_a_shaft():
    """Its other limb is dark before darkness: radius and place cannot be told apart."""
    scene = scene_of("shaft-front", small=True)
    lone = scene.lit_by(scene.lights[0])
    found = limb_rim(Pictures.of(lone, np.array([10.0, 90.0]), np.array([60.0, 90.0])), lone.solid.round("d2"))
    lit = (found.squared > 0) & found.clear
    assert lit.any()
    assert not (lit[: len(lit) // 2].any() and lit[len(lit) // 2 :].any())


@pytest.mark.parametrize(
    ("kind", "sensor", "light"),
    [
        ("ball", (40, 90), (40, 60)),
        ("cone-back", (3, 85), None),
        ("shaft-shadow", (10, 258), ((60, 50), (55, 300))),  # shoulders lie in each other's way, and send light
    ],
)
def test_diameters_tapers_and_centres_are_measured_as_predicted(kind, sensor, light):
    """Reduced form of ``python -m tests.proofs limbs``: 100 images, variance within 4 standard errors."""
    images = 100
    for row in rows_at(scene_of(kind, small=True), sensor, light, images, 7, QUICK):
        sigma, error = row.propagated**0.5, np.sqrt(2 / (images - 1))
        assert row.status == "ok"
        assert row.count == images
        assert abs(row.measured / row.propagated - 1) < 4 * error  # margin: 4 standard errors
        # margin: two models of one picture: 10 % is what is claimed
        assert abs(row.calibrated / row.propagated - 1) < 0.1
        assert abs(row.bias) < (0.3 + 4 / images**0.5) * sigma  # margin: 4 standard errors past what `ok` allows
        if kind == "ball" and row.name == "diameter":
            assert abs(row.as_step) > 5 * sigma  # what is corrected
    with pytest.raises(InvalidInput, match="sensor"):
        rows_at(scene_of(kind, small=True), (0, 0, 0), light, 2, 7)


@pytest.mark.parametrize(
    ("name", "sensor"), [("ball", (40.0, 110.0)), ("shaft", (14.0, 262.0)), ("cone", (18.0, 94.0))]
)
def test_limbs_are_rendered_where_their_closed_forms_are(name, sensor):
    """Reduced form of ``python -m tests.proofs limbs --only render``; what is 2e-3 px too large is told from it."""
    scene, rng = scenes.load("ball" if name == "ball" else "shaft"), np.random.default_rng(5)
    scene = cone_of(scene) if name == "cone" else scene
    found = list(silhouettes(scene, sensor, 32, 1024, rng))
    assert len(found) == len(scene.solid.curved)
    assert all(each.agrees for each in found), found
    wrong = next(silhouettes(scene, sensor, 32, 1024, rng, grown=2 * LIMIT_PX))
    assert not wrong.agrees
    assert wrong.mean == pytest.approx(2 * LIMIT_PX, abs=4e-4)


def test_the_ellipse_s_centre_is_not_taken_for_the_ball_s():
    """Reduced form of ``python -m tests.proofs limbs --only centre``: the ball is too dark for light upon it."""
    scene = scene_beside((9.0, -7.0), small=True)
    scene = scene.model_copy(update={"material": scene.material.model_copy(update={"diffuse_reflectance": 1e-4})})
    found = centre_at(scene, (3.0, 40.0), QUICK, "backlight,lens_blur,attached_shadow")
    assert found.agrees, found
    assert found.as_ellipse > 50  # margin: the order is said
    assert found.fitted < 0.01


def test_a_taper_seen_from_elsewhere_is_another():
    """To who trusts the pose: the angle between both lines' images is that of a cone with the half angle told."""
    scene = cone_of(scenes.load("shaft"))
    camera = scene.camera.model_copy(update={"distance": 20 * 270.0, "focal_px": 20 * 1200.0})  # nearly parallel
    scene, cone = scene.model_copy(update={"camera": camera}), scene.solid.curved[0]

    def opening(pose, by=0.0):
        outline = limb_outline(
            cone.moved(sensor_position(camera, np.array(pose)), (0, 0, 0, by)), np.array(pose), camera
        )
        along = np.split(outline.outward[outline.seen], 2)
        return float(along[0][0] @ along[1][0])

    here, there = (75.0, 15.0), (75.5, 15.8)
    seen = [measurands(Pictures.of(scene, np.array(pose))).seen for pose in (here, there)]
    change = float(_half_angle(*seen, cone)) - cone.half_angle
    found = brentq(lambda by: opening(here, by) - opening(there), -0.05, 0.05)
    assert abs(change) > 1e-3  # margin: that there is a change to be told
    assert change == pytest.approx(found, rel=0.05)


@pytest.mark.parametrize("larger", [0.1, 1.0, 4.0, 13.0])
def test_places_are_at_most_two_smoothing_scales_apart(larger):
    """As many times 64 as that takes, no more: of a limb's image of any size."""
    scene = scenes.load("ball")
    camera = scene.camera.model_dump()
    scene = scene.with_(camera={**camera, "focal_px": camera["focal_px"] * larger})
    picture, ball, optics = Picture.of(scene, (40, 30), (30, 200)), scene.solid.round("ball"), Optics.of(scene)
    pictures = Pictures.of(picture)
    length = np.nansum(limb_outline(ball, pictures.sensors, scene.camera).arc)
    count = limb_places(limb_outline(ball, pictures.sensors, pictures.scene.camera), optics.scale_px)
    times = count // 64
    assert times * 64 == count
    assert length / (times * 64) <= 2 * optics.scale_px
    assert times == 1 or length / ((times - 1) * 64) > 2 * optics.scale_px


def test_facets_of_a_ball_bend_outwards_and_none_is_an_edge():
    """Each edge between two facets, whose outer sides look away from each other; corners on the sphere."""
    edges = BALL.edges
    assert len(edges) == 3 * len(BALL.faces) // 2 == 1920
    assert len({frozenset(edge.ends) for edge in edges}) == 1920
    middles = np.array([BALL.vertices[list(face)].mean(0) for face in BALL.faces])
    for edge in edges:
        one, two = edge.faces
        assert set(edge.ends) == set(BALL.faces[one]) & set(BALL.faces[two])
        assert (edge.kind, edge.convex) == ("smooth", bool(BALL.normals[one] @ (middles[two] - middles[one]) < 0))
    assert all(edge.convex for edge in edges)
    assert np.linalg.norm(BALL.vertices - [0.5, -0.2, 0.3], axis=1) == pytest.approx(np.full(642, 3.0))
    assert BALL.is_convex
    assert BALL.sharp == ()
