"""Irradiance by quadrature over lights of some size against closed forms and against integrals over directions."""

import numpy as np
import pytest
from scipy import integrate

import scenes
from imaging.light.emitters import emitters, nodes
from imaging.light.irradiance import beam
from scenes import Backlight, Bar, Disc, Dome, Light, Pose, Ring, as_point
from scenes.lights.luminaire import ERROR
from tests.oracle import axes

DISTANCE, REACH = 50.0, 8.0


def irradiance(light, points, normals, reach=REACH):
    """On surfaces at points (n, 3) of a light above the origin, the reference point."""
    made, total = nodes(light, reach), 0.0
    for place, normal, power in zip(
        made.places, made.normals if made.normals is not None else [None] * len(made.places), made.powers, strict=True
    ):
        at = np.array([place[0], place[1], DISTANCE - place[2]])  # its axes seen from above: down stays, towards falls
        away = at - points
        square = (away**2).sum(1)
        sent = (
            1.0 if normal is None else np.maximum(away @ np.array([-normal[0], -normal[1], normal[2]]), 0) / square**0.5
        )
        total = total + power * sent * np.maximum((away * normals).sum(1), 0) / square**1.5
    return total


def disc_above(radius, heights, aside):
    """Form factor from a plane element to a parallel disc, its middle aside (Howell, B-15)."""
    return (
        1
        - (heights**2 + aside**2 - radius**2)
        / np.sqrt((heights**2 + aside**2 + radius**2) ** 2 - 4 * (aside * radius) ** 2)
    ) / 2


def rectangle_above(x, y, height):
    """From a plane element to a parallel rectangle from (0, 0) to (x, y) above it (Howell, B-4)."""
    x, y = x / height, y / height
    a, b = np.sqrt(1 + x * x), np.sqrt(1 + y * y)
    return (x / a * np.arctan(y / a) + y / b * np.arctan(x / b)) / (2 * np.pi)


def points(rng, count=40):
    return rng.uniform(-REACH / 2, REACH / 2, (count, 3)), np.tile([0.0, 0.0, 1.0], (count, 1))


@pytest.mark.parametrize("radius", [0.1, 5.0, 25.0, 60.0])
def test_disc(radius, rng):
    at, normals = points(rng)
    exact = disc_above(radius, DISTANCE - at[:, 2], np.hypot(*at[:, :2].T)) / disc_above(radius, DISTANCE, 0.0)
    assert irradiance(Disc(kind="disc", distance=DISTANCE, radius=radius), at, normals) == pytest.approx(
        exact, rel=2 * ERROR
    )


@pytest.mark.parametrize(("inner", "outer"), [(0.0, 10.0), (15.0, 25.0), (29.0, 30.0)])
def test_flat_ring(inner, outer, rng):
    at, normals = points(rng)
    height, aside = DISTANCE - at[:, 2], np.hypot(*at[:, :2].T)
    exact = disc_above(outer, height, aside) - disc_above(inner, height, aside)
    exact /= disc_above(outer, DISTANCE, 0.0) - disc_above(inner, DISTANCE, 0.0)
    ring = Ring(kind="ring", distance=DISTANCE, inner_radius=inner, outer_radius=outer)
    assert irradiance(ring, at, normals) == pytest.approx(exact, rel=2 * ERROR)


@pytest.mark.parametrize(("length", "width"), [(1.0, 0.2), (40.0, 5.0), (90.0, 60.0)])
def test_bar(length, width, rng):
    at, normals = points(rng)

    def exact(x, y, height):
        parts = [
            np.sign(u) * np.sign(v) * rectangle_above(abs(u), abs(v), height)
            for u in (length / 2 - x, length / 2 + x) for v in (width / 2 - y, width / 2 + y)
        ]  # fmt: skip
        return sum(parts)

    wanted = np.array([exact(x, y, DISTANCE - z) for x, y, z in at]) / exact(0.0, 0.0, DISTANCE)
    bar = Bar(kind="bar", distance=DISTANCE, length=length, width=width)
    assert irradiance(bar, at, normals) == pytest.approx(wanted, rel=2 * ERROR)


@pytest.mark.parametrize("radius", [0.4, 3.0, 20.0])
def test_sphere_is_a_point_for_whoever_sees_all_of_it(radius, rng):
    """Its field is a point's."""
    at, normals = points(rng)
    ball = Light(distance=DISTANCE, radius=radius)
    assert irradiance(ball, at, normals) == pytest.approx(irradiance(Light(distance=DISTANCE), at, normals), rel=1e-4)


@pytest.mark.parametrize("elevation", [-1.0, -0.5, 0.0, 0.5, 1.0, 2.0])
def test_sphere_behind_a_horizon(elevation):
    """Elevation of its middle in its own angular radii; a disc of even radiance cut off by a line, of what it gives to
    a surface that faces it."""
    radius = 2.0
    sine = radius / DISTANCE
    tilt = np.arcsin(elevation * sine)
    normal = np.array([[np.cos(tilt), 0.0, np.sin(tilt)]])
    found = irradiance(Light(distance=DISTANCE, radius=radius), np.zeros((1, 3)), normal)[0]
    # chords across the disc in the plane of light and normal, small angles
    exact = integrate.quad(
        lambda u: 2 / np.pi * np.sqrt(max(1 - u * u, 0)) * max(np.sin(tilt + u * sine), 0), -1, 1, points=[-elevation]
        if abs(elevation) < 1 else None,
    )[0]  # fmt: skip
    assert found == pytest.approx(exact, abs=1e-4)
    point = max(np.sin(tilt), 0.0)
    # margin: a tenth of a percent is ten times the limit above
    assert abs(elevation) >= 1 or abs(point - exact) > 1e-3  # what a point would have been wrong by


@pytest.mark.parametrize(("half_angle", "opening"), [(30.0, 0.0), (70.0, 10.0), (90.0, 20.0)])
def test_dome(half_angle, opening, rng):
    """Against an integral over directions: its radiance is the same wherever a ray meets it."""
    at = rng.uniform(-3, 3, (6, 3))
    normals = rng.normal(size=(6, 3)) + [0, 0, 4]
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    dome = Dome(kind="dome", distance=DISTANCE, half_angle_deg=half_angle, opening_deg=opening)
    cosine, angle = np.meshgrid((np.arange(3000) + 0.5) / 3000 * 2 - 1, (np.arange(900) + 0.5) / 900 * 2 * np.pi)
    sine = np.sqrt(1 - cosine**2)
    ways = np.stack([sine * np.cos(angle), sine * np.sin(angle), cosine], -1)
    low, high = np.cos(np.radians([half_angle, opening]))
    radiance = 1 / (np.pi * (high**2 - low**2) * -1) if high < low else 1 / (np.pi * (high**2 - low**2))
    for point, normal in zip(at, normals, strict=True):
        along = ways @ point
        t = -along + np.sqrt(along**2 + DISTANCE**2 - point @ point)
        height = (point[2] + t * cosine) / DISTANCE
        seen = (height >= low) & (height <= high)
        exact = radiance * (np.maximum(ways @ normal, 0) * seen).mean() * 4 * np.pi
        found = irradiance(dome, point[None], normal[None])[0]
        assert found == pytest.approx(exact, abs=4e-3 if half_angle > 80 else 2e-3)


@pytest.mark.parametrize("light", [
    Light(distance=DISTANCE), Light(distance=DISTANCE, radius=9.0), Disc(kind="disc", distance=DISTANCE, radius=9.0),
    Bar(kind="bar", distance=DISTANCE, length=9.0, width=3.0, turn_deg=20.0), Dome(kind="dome", distance=DISTANCE),
    Ring(kind="ring", distance=DISTANCE, inner_radius=9.0, outer_radius=12.0, tilt_deg=40.0),
], ids=lambda light: light.kind)  # fmt: skip
def test_intensity_is_the_irradiance_at_the_reference_point(light):
    bright = light.model_copy(update={"intensity": 0.4})
    assert irradiance(bright, np.zeros((1, 3)), np.array([[0.0, 0, 1]])) == pytest.approx([0.4])


def test_telecentric_backlight():
    """Irradiance of a cone of half angle c across its axis: pi L sin^2 c, wherever; radiance L = intensity / pi."""
    light = Backlight(kind="backlight", distance=DISTANCE, half_side=30.0, cone_deg=8.0, intensity=2.0)
    for place in ([[0.0, 0, 0]], [[3.0, -2.0, 1.0]]):
        found = irradiance(light, np.array(place), np.array([[0.0, 0, 1]]))
        assert found == pytest.approx([2.0 * np.sin(np.radians(8)) ** 2], rel=1e-3)


@pytest.mark.parametrize("mount", ["free", "camera", "fixed"])
def test_where_emitters_stand(mount, task1):
    """By the axes of the sensor, of the light's own pose, of its fixed pose; a ring's nodes around its middle."""
    pose = {"pose": Pose(40, 200)} if mount == "fixed" else {"offset": (3.0, -2.0)} if mount == "camera" else {}
    ring = Ring(kind="ring", distance=60.0, inner_radius=5.0, outer_radius=7.0, mount=mount, **pose)
    scene = task1.model_copy(update={"light": ring})
    picture = scenes.Picture.of(scene, (30, 135), (15, 315) if mount == "free" else None)
    where = {"free": (15, 315), "camera": (30, 135), "fixed": (40, 200)}[mount]
    assert tuple(picture.lights[0]) == where
    out, right, down = axes(where)
    middle = np.array(scene.camera.look_at) + 60.0 * out + (3.0 * right - 2.0 * down if mount == "camera" else 0)
    found = emitters(scene, tuple(np.array(list(pose)) for pose in picture.lights))
    places = np.array([each.at for each in found])
    assert places.mean(0) == pytest.approx(middle)
    assert np.allclose((places - middle) @ out, 0)
    away = np.linalg.norm(places - middle, axis=1)
    assert 5 < away.min() < away.max() < 7  # margin: the ring's own radii
    assert all(each.axis == pytest.approx(-out) for each in found)
    sent = sum(beam(each, np.array(scene.camera.look_at)).strength for each in found)
    assert sent == pytest.approx(1.0, rel=0.03)
    assert as_point(ring).mount == mount
