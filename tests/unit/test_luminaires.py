"""Lights of some size: their nodes and the shapes that the renderer has of them, against areas, moments and cones."""

import math

import numpy as np
import pytest

from scenes import Backlight, Bar, Disc, Dome, Light, Ring
from scenes.lights import luminaire
from scenes.lights.luminaire import annulus, shining, turned
from scenes.parts.surfaces import axes_beside

FRAME = np.stack([*axes_beside(np.array([0.36, 0.48, 0.8])), [0.36, 0.48, 0.8]], -1)
AXES = np.block([[FRAME, np.array([[3.0], [-2.0], [7.0]])], [np.zeros((1, 3)), np.ones((1, 1))]])


def area_and_normal(triangles: np.ndarray) -> tuple[float, np.ndarray]:
    """Of all triangles, and their mean normal by area."""
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2
    return float(np.linalg.norm(cross, axis=1).sum()), cross.sum(0)


@pytest.mark.parametrize("tilt", [0.0, 0.6])
def test_nodes_of_a_ring_have_its_area_and_moments(tilt):
    """Mean of r^2 is (R^2 + r^2) / 2, of x^2 half of that; normals are across the cone, inwards and forwards."""
    made = annulus(2.0, 5.0, tilt, 8)
    x, y, z = made.places.T
    assert made.areas.sum() == pytest.approx(math.pi * 21 / math.cos(tilt))
    weights = made.areas / made.areas.sum()
    assert weights @ x**2 == pytest.approx(29 / 4)
    assert weights @ y**2 == pytest.approx(29 / 4)
    assert abs(weights @ (x * y)) < 1e-12
    far = np.hypot(x, y)
    np.testing.assert_allclose(z, (far - 3.5) * math.tan(tilt), atol=1e-12)
    expected = np.stack([-math.sin(tilt) * x / far, -math.sin(tilt) * y / far, np.full(x.size, math.cos(tilt))], -1)
    np.testing.assert_allclose(made.normals, expected, atol=1e-12)


def test_pieces_of_a_turned_line_have_its_area():
    """A disc's exactly, a frustum's to what flat pieces leave; outwards is where the heights rise to."""
    area, normal = area_and_normal(turned(np.array([0.0, 3.0]), np.array([1.5, 1.5]))["triangles"])
    assert area == pytest.approx(math.pi * 9, rel=1e-12)
    assert normal == pytest.approx([0, 0, math.pi * 9], abs=1e-9)
    frustum = turned(np.array([2.0, 5.0]), np.array([-1.0, 3.0]))["triangles"]
    assert frustum.shape == (2 * luminaire._AROUND, 3, 3)
    # margin: what flat pieces leave, by the form beside it
    assert area_and_normal(frustum)[0] == pytest.approx(math.pi * 7 * 5, rel=3e-4)  # (pi / 128)^2 / 2
    inner = np.hypot(frustum[..., 0], frustum[..., 1])[np.isclose(frustum[..., 2], -1.0)]
    # margin: of corners at the radius and middles of pieces within it
    assert inner == pytest.approx(2.0, rel=3e-4)


@pytest.mark.parametrize(("half", "opening"), [(90.0, 0.0), (70.0, 25.0)])
def test_a_dome_is_a_part_of_its_sphere(half, opening):
    """Area 2 pi R^2 (cos a - cos b), by nodes and by pieces; around the reference point, shining there."""
    dome = Dome(kind="dome", distance=9.0, half_angle_deg=half, opening_deg=opening)
    area = 2 * math.pi * 81 * (math.cos(math.radians(opening)) - math.cos(math.radians(half)))
    made = dome.surface(8)
    assert made.areas.sum() == pytest.approx(area)
    away = made.places - [0, 0, 9.0]
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), 9.0)
    np.testing.assert_allclose(made.normals, -away / 9.0, atol=1e-12)
    low, high = math.cos(math.radians(half)), math.cos(math.radians(opening))
    assert made.areas @ away[:, 2] / area == pytest.approx(-9.0 * (low + high) / 2)
    triangles = dome.shape()["triangles"]
    pieces, normal = area_and_normal(triangles)
    assert pieces == pytest.approx(area, rel=2e-3)
    rim = math.pi * 81 * (math.sin(math.radians(half)) ** 2 - math.sin(math.radians(opening)) ** 2)
    assert normal == pytest.approx([0, 0, rim], rel=1e-6, abs=1e-6)  # of any surface between the two circles
    assert triangles[..., 2].max() == pytest.approx(9 - 9 * low)
    assert triangles[..., 2].min() == pytest.approx(9 - 9 * high)


@pytest.mark.parametrize("cone_deg", [2.0, 35.0])
def test_a_telecentric_backlight_gives_what_its_cone_does(cone_deg):
    """Across its axis pi L sin^2 of the half angle, and of the cosine's square as far as a cone has it."""
    light = Backlight(kind="backlight", distance=50.0, half_side=7.0, cone_deg=cone_deg, intensity=1.3)
    made = light.nodes(10.0, 4)
    square = (made.places**2).sum(1)
    cosine = -made.places[:, 2] / np.sqrt(square)
    angle = math.radians(cone_deg)
    assert made.normals is None
    assert np.sum(made.powers * cosine / square) == pytest.approx(1.3 * math.sin(angle) ** 2)
    # 2 / 3 (1 - cos^3) is the integral of 2 cos^2 sin
    assert np.sum(made.powers * cosine**2 / square) == pytest.approx(1.3 * 2 / 3 * (1 - math.cos(angle) ** 3), rel=1e-6)
    # margin: nodes lie within the cone by their kind
    assert np.arccos(cosine).max() < angle
    assert np.abs(made.powers @ (made.places[:, :2] / square[:, None] ** 1.5)).max() < 1e-12
    assert len(made.powers) == 32
    # the renderer has them as directions, from so far away that a distance nearer is 2e-4 brighter or darker
    directions = light.described(AXES, 200.0, 10.0)
    count = len(light.nodes(10.0).powers)
    assert [each["type"] for each in directions] == ["directional"] * count
    ways = np.array([each["direction"] for each in directions])
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    values = np.array([each["irradiance"]["value"] for each in directions])
    assert values @ (ways @ FRAME[:, 2]) == pytest.approx(200.0 * 1.3 * math.sin(angle) ** 2, rel=1e-3)


def test_a_backlight_is_seen_on_its_square_and_within_its_cone():
    light = Backlight(kind="backlight", distance=50.0, half_side=7.0, cone_deg=20.0)
    within, beyond = math.cos(math.radians(19.9)), math.cos(math.radians(20.1))
    right, down = np.array([6.9, -6.9, 7.1, 0.0, -7.1]), np.array([-6.9, 6.9, 0.0, -7.1, 7.1])
    assert light.seen_at(right, down, np.full(5, within)).tolist() == [True, True, False, False, False]
    assert not light.seen_at(right, down, np.full(5, beyond)).any()
    whole = light.model_copy(update={"cone_deg": 90.0})
    assert whole.seen_at(0.0 * right, 0.0 * down, np.array([1.0, 0.01, 0.0, -0.01, -1.0])).tolist() == [1, 1, 0, 0, 0]
    assert (light.is_telecentric, whole.is_telecentric) == (True, False)
    assert light.half_size == pytest.approx(7 * math.sqrt(2))
    assert light.cone == pytest.approx(math.radians(20))


@pytest.mark.parametrize(
    ("light", "corners"),
    [
        (Bar(kind="bar", distance=90.0, length=12.0, width=5.0, turn_deg=30.0), (12.0, 5.0, 30.0)),
        (Backlight(kind="backlight", distance=90.0, half_side=7.0), (14.0, 14.0, 0.0)),
    ],
)
def test_a_rectangle_of_light_is_where_its_nodes_are(light, corners):
    """Mitsuba's square from -1 to 1: the ends of its axes, turned from right towards down."""
    length, width, turn = corners
    matrix = light.shape()["to_world"]
    cosine, sine = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    np.testing.assert_allclose(matrix @ [1, 0, 0, 1], [length / 2 * cosine, length / 2 * sine, 0, 1], atol=1e-12)
    np.testing.assert_allclose(matrix @ [0, 1, 0, 1], [-width / 2 * sine, width / 2 * cosine, 0, 1], atol=1e-12)
    np.testing.assert_allclose(matrix @ [0, 0, 1, 0], [0, 0, 1, 0], atol=1e-12)
    made = light.surface(6)
    local = made.places @ matrix[:3, :3] / (np.array([length, width, 2.0]) / 2) ** 2
    # margin: digits of the number beside it
    assert np.abs(local[:, :2]).max(0) == pytest.approx([0.9325, 0.9325], abs=1e-4)  # the last node of six
    assert made.areas.sum() == pytest.approx(length * width)


def test_a_light_shines_where_it_stands():
    """A shape's place and radiance in the scene: of triangles the corners are moved, of others the matrix."""
    ring = Ring(kind="ring", distance=90.0, inner_radius=2.0, outer_radius=5.0, intensity=0.7)
    made = ring.described(AXES, 200.0, 10.0)[0]
    local = ring.shape()["triangles"]
    np.testing.assert_allclose(made["triangles"], local @ FRAME.T + AXES[:3, 3], atol=1e-12)
    # irradiance on the axis at 90 from a ring of radiance L: pi L (R^2 / (R^2 + d^2) - r^2 / (r^2 + d^2))
    share = 25 / (25 + 8100) - 4 / (4 + 8100)
    assert made["emitter"]["radiance"]["value"] == pytest.approx(200.0 * 0.7 / share / math.pi, rel=1e-4)
    disc = Disc(kind="disc", distance=90.0, radius=4.0).described(AXES, 200.0, 10.0)[0]
    np.testing.assert_allclose(disc["to_world"], AXES @ np.diag([4, 4, 4, 1.0]), atol=1e-12)
    bare = shining({"type": "rectangle"}, AXES, 3.0)
    np.testing.assert_allclose(bare["to_world"], AXES)
    assert bare["bsdf"] == luminaire.BLACK


@pytest.mark.parametrize(("radius", "kind"), [(0.0, "point"), (0.89, "disk"), (0.91, "sphere")])
def test_a_small_ball_of_light_is_a_disc_for_the_renderer(radius, kind):
    """Below a hundredth of its distance; all give the same irradiance at the reference point."""
    light = Light(distance=90.0, radius=radius, intensity=1.5)
    (made,) = light.described(AXES, 200.0, 10.0)
    assert made["type"] == kind
    assert light.is_point == (radius == 0.0)
    if kind == "point":
        assert made["position"] == pytest.approx([3.0, -2.0, 7.0])
        assert made["intensity"]["value"] == pytest.approx(200 * 1.5 * 90**2)
        return
    assert made["emitter"]["radiance"]["value"] == pytest.approx(200 * 1.5 * 90**2 / (math.pi * radius**2))
    if kind == "disk":
        np.testing.assert_allclose(made["to_world"], AXES @ np.diag([radius] * 3 + [1.0]))
    else:
        assert (made["center"], made["radius"]) == ([3.0, -2.0, 7.0], radius)
        assert "to_world" not in made


def test_a_ball_s_shells_are_as_bright_as_its_disc():
    """Mean square distance from the axis of a disc: r^2 / 4 each way; in all three, for it has no front."""
    light = Light(distance=90.0, radius=4.0, intensity=1.5)
    made = light.nodes(10.0)
    weights = made.powers / (1.5 * 90**2)
    assert weights.sum() == pytest.approx(1)
    for axis in made.places.T:
        assert weights @ axis**2 == pytest.approx(4.0, rel=1e-9)
        assert abs(weights @ axis) < 1e-12
    # margin: a place within the ball by its kind
    assert np.linalg.norm(made.places, axis=1).max() < 4.0
