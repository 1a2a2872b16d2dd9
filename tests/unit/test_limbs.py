"""Limbs: against 50 digits, against rays, derivatives against differences, and what has none."""

import mpmath
import numpy as np
import pytest

from imaging.contours import contour, limb
from imaging.geometry.projection import frame, from_axis, sensor_position
from scenes import Camera, InvalidInput
from scenes.parts.surfaces import Cone, Cylinder, Plane, Quadric, Sphere, Surface, Torus
from tests.conics import ellipse_of, image_conic
from tests.curved import SURFACES, changed

CAMERA = Camera(width=1280, height=1024, focal_px=2000.0, distance=30.0, look_at=(0.5, -1.0, 0.5))
POSES = [(35.0, 20.0), (80.0, 200.0), (120.0, 310.0)]
SOLID = [name for name, surface in SURFACES.items() if not surface.hollow and name != "plane"]
STEP = 1e-6


def lines(at: np.ndarray, pose, camera: Camera = CAMERA) -> tuple[np.ndarray, np.ndarray]:
    """Eye and unit directions of the lines through image points (n, 2), px from the middle."""
    axes = frame(np.array(pose))
    way = at[:, :1] * axes.right + at[:, 1:] * axes.down + camera.focal_px * axes.forward
    return sensor_position(camera, np.array(pose)), way / np.linalg.norm(way, axis=1, keepdims=True)


def chord(surface: Surface, eye: np.ndarray, way: np.ndarray):
    """At 50 digits: a function that is positive where a line meets the surface and 0 where it touches, of direction."""
    vector = lambda v: [mpmath.mpf(x) for x in np.asarray(v).tolist()]  # noqa: E731
    dot = lambda a, b: mpmath.fsum(x * y for x, y in zip(a, b, strict=True))  # noqa: E731
    if isinstance(surface, Quadric):
        form, linear, constant = surface.form, surface.linear, surface.constant
        e, point = vector(eye), [mpmath.mpf(0)] * 3
        rows, b = [vector(row) for row in form], vector(linear)
    else:
        point = vector(surface.centre if isinstance(surface, Sphere) else surface.point)
        axis, slope = (
            ([mpmath.mpf(0)] * 3, mpmath.mpf(0)) if isinstance(surface, Sphere) else _axis(surface, vector, dot)
        )
        radius, one = mpmath.mpf(surface.radius), mpmath.mpf(1)
        rows = [[(one if i == j else 0) - (1 + slope**2) * axis[i] * axis[j] for j in range(3)] for i in range(3)]
        b, constant = [-2 * radius * slope * x for x in axis], -(radius**2)
        e = [x - y for x, y in zip(vector(eye), point, strict=True)]
    turned = [dot(row, e) for row in rows]
    half = [t + x / 2 for t, x in zip(turned, b, strict=True)]
    level = dot(e, turned) + dot(b, e) + mpmath.mpf(constant)
    return lambda d: dot(d, half) ** 2 - level * dot(d, [dot(row, d) for row in rows])


def _axis(surface, vector, dot):
    axis = vector(surface.axis)
    size = mpmath.sqrt(dot(axis, axis))
    angle = mpmath.mpf(getattr(surface, "half_angle_deg", 0.0))
    return [x / size for x in axis], mpmath.tan(angle * mpmath.pi / 180)


def _off(surface: Surface, at: np.ndarray, outward: np.ndarray, pose) -> float:
    """How far, px, an image point (2,) is from the limb along its normal, by Newton's method at 50 digits."""
    with mpmath.workdps(50):
        axes, eye = frame(np.array(pose)), sensor_position(CAMERA, np.array(pose))
        met = chord(surface, eye, at)

        def along(s):
            x, y = (mpmath.mpf(a) + s * mpmath.mpf(n) for a, n in zip(at.tolist(), outward.tolist(), strict=True))
            columns = zip(axes.right.tolist(), axes.down.tolist(), axes.forward.tolist(), strict=True)
            return met([x * r + y * d + CAMERA.focal_px * f for r, d, f in columns])

        return float(along(mpmath.mpf(0)) / mpmath.diff(along, mpmath.mpf(0)))


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("name", [name for name in SOLID if name != "torus"])
def test_against_50_digits(name, pose):
    """The limb's image is within 1e-9 px of where lines touch at 50 digits."""
    found = limb(SURFACES[name], pose, CAMERA, 7)
    if found.status != "ok":
        assert (name, found.status) in {("one sheet", "inside")}
        return
    for strand in found.strands:
        for at, outward in zip(strand.at, strand.outward, strict=True):
            if np.abs(at).max() < 2000:
                assert abs(_off(SURFACES[name], at, outward, pose)) < 1e-9


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("name", SOLID)
def test_just_inside_meets_and_just_outside_misses(name, pose):
    """Rays 1e-4 px beside the limb: inside they meet the surface twice near the limb's point, outside they do not."""
    surface = SURFACES[name]
    for strand in limb(surface, pose, CAMERA, 50).strands:
        near = np.abs(strand.at).max(1) < 2000
        eye, _ = lines(strand.at, pose)
        far = np.linalg.norm(strand.points - eye, axis=1)
        for side, met in ((-1, True), (1, False)):
            start, way = lines(strand.at + side * 1e-4 * strand.outward, pose)
            t = surface.intersections(start, way)
            reach = 2 * np.sqrt(2 * 1e-4 / strand.magnification / strand.bend) + 1e-3
            close = (np.abs(t - far[:, None]) < reach[:, None]).any(1)
            assert (close == met)[near].all()
            assert not ((t > 0) & (t < (far - reach)[:, None])).any(1)[near].any()  # nothing lies before it


@pytest.mark.parametrize("pose", POSES[1:2])
@pytest.mark.parametrize("name", SOLID)
def test_design_against_differences(name, pose):
    """Each column moves the limb along its normal as the surface with that number changed has it, for the eye too."""
    surface = SURFACES[name]
    for strand in limb(surface, pose, CAMERA, 5).strands:
        near = np.abs(strand.at).max(1) < 3000
        for k, parameter in enumerate(surface.parameters):
            apart = [_moved(changed(surface, parameter, by), strand, pose) for by in (-STEP, STEP)]
            scale = np.abs(strand.design[near]).max()
            np.testing.assert_allclose(
                (apart[1] - apart[0])[near] / (2 * STEP), strand.design[near, k], atol=2e-5 * scale
            )
        for k in range(3):
            apart = [_moved(surface, strand, pose, by * np.eye(3)[k]) for by in (-STEP, STEP)]
            scale = np.abs(strand.eye_design[near]).max()
            np.testing.assert_allclose(
                (apart[1] - apart[0])[near] / (2 * STEP), strand.eye_design[near, k], atol=2e-5 * scale
            )


def _moved(surface: Surface, strand, pose, shift: np.ndarray = 0.0) -> np.ndarray:
    """Shift (n,) along the normals of a surface's limb, by halving: does a line beside the strand come near it?

    A line's least value of the surface's signed distance tells whether it meets; Newton's method on it.
    """
    found = np.zeros(len(strand.u))
    for _ in range(3):
        eye, way = lines(strand.at + found[:, None] * strand.outward, pose)
        eye = eye + shift
        t = ((strand.points - eye) * way).sum(-1)
        for _ in range(8):  # least distance along the line
            place = eye + t[:, None] * way
            slope = (surface.normals(place) * way).sum(-1)
            t = t - slope / np.einsum("ni,nij,nj->n", way, surface.shape_operator(place), way)
        place = eye + t[:, None] * way
        found = found - surface.values(place) * strand.magnification
    return found


def test_sphere_beside_the_axis():
    """The image of a sphere's centre is not the centre of its ellipse: 50 digits of both, and by how much."""
    ball, pose = Sphere((3.0, 2.0, 1.0), 2.0), (40.0, 30.0)
    ellipse = ellipse_of(image_conic(ball.quadric, pose, CAMERA))
    axes, eye = frame(np.array(pose)), sensor_position(CAMERA, np.array(pose))
    with mpmath.workdps(50):
        x, y, z = (
            mpmath.mpf(float(v)) for v in (ball.centre - eye) @ np.stack([axes.right, axes.down, axes.forward], 1)
        )
        depth2 = z**2 - mpmath.mpf(ball.radius) ** 2
        exact = [float(CAMERA.focal_px * v * z / depth2) for v in (x, y)]
        square = x**2 + y**2 + depth2
        half = [
            float(CAMERA.focal_px * ball.radius * mpmath.sqrt(v) / w) for v, w in ((square, depth2), (depth2, depth2))
        ]
    np.testing.assert_allclose(ellipse.centre, exact, rtol=1e-10)
    np.testing.assert_allclose(ellipse.half_axes, half, rtol=1e-10)
    middle = from_axis(ball.centre[None], np.array(pose), CAMERA)[0]
    assert np.linalg.norm(ellipse.centre - middle) == pytest.approx(
        np.linalg.norm(middle) * 4.0 / float(depth2), rel=1e-9
    )
    assert np.linalg.norm(ellipse.centre - middle) > 0.5  # margin: that there is a difference to be told, px
    at = limb(ball, pose, CAMERA).strands[0].at
    tilt = np.array([[np.cos(ellipse.angle), np.sin(ellipse.angle)], [-np.sin(ellipse.angle), np.cos(ellipse.angle)]])
    np.testing.assert_allclose((((at - ellipse.centre) @ tilt.T / ellipse.half_axes) ** 2).sum(1), 1, rtol=1e-10)


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "one sheet", "paraboloid"])
def test_dual_conic(name):
    """The image conic is the inverse of P Q* P' (Hartley and Zisserman 8.2)."""
    quadric, pose = getattr(SURFACES[name], "quadric", SURFACES[name]), np.array(POSES[0])
    axes, eye = frame(pose), sensor_position(CAMERA, pose)
    turned = np.stack([axes.right, axes.down, axes.forward])
    camera = np.diag([CAMERA.focal_px, CAMERA.focal_px, 1.0]) @ np.column_stack([turned, -turned @ eye])
    found = np.linalg.inv(camera @ np.linalg.inv(quadric.matrix) @ camera.T)
    conic = image_conic(quadric, pose, CAMERA)
    np.testing.assert_allclose(
        found / found.ravel()[np.abs(found).argmax()], conic / conic.ravel()[np.abs(conic).argmax()], atol=1e-9
    )


def test_curvature_of_the_image():
    for name in ("sphere", "torus", "ellipsoid", "cylinder"):
        for strand in limb(SURFACES[name], POSES[0], CAMERA, 4000).strands:
            turn = np.arctan2(strand.outward[:, 1], strand.outward[:, 0])
            step = np.unwrap(turn)[2:] - np.unwrap(turn)[:-2]
            apart = np.linalg.norm(strand.at[2:] - strand.at[:-2], axis=1)
            even = np.diff(strand.u)[:-1] < 1.5 / 4000
            even &= np.diff(strand.u)[1:] < 1.5 / 4000
            scale = np.abs(strand.curvature).max() + 1e-4
            np.testing.assert_allclose(
                np.abs(step / apart)[even], np.abs(strand.curvature[1:-1])[even], atol=3e-2 * scale
            )


def test_arcs_add_up():
    strand = limb(Sphere((0.5, -1.0, 0.5), 2.0), POSES[0], CAMERA, 500).strands[0]
    assert strand.closed
    assert strand.arc.sum() == pytest.approx(2 * np.pi * 2000 * 2 / np.sqrt(30**2 - 4), rel=1e-4)
    np.testing.assert_allclose(strand.curvature, np.sqrt(30**2 - 4) / 4000, rtol=1e-9)


@pytest.mark.parametrize(
    ("surface", "status"),
    [
        (Plane((0, 0, 0), (0, 0, 1)), "degenerate"),
        (Quadric(np.diag([1.0, -1, 0]), (0, 0, 0), 0.0), "degenerate"),  # two planes
        (Quadric(np.zeros((3, 3)), (1, 0, 0), 2.0), "degenerate"),
        (Quadric(np.eye(3), (0, 0, 0), 1.0), "none"),  # nothing real
        (Sphere((0.5, -1.0, 0.5), 40.0), "inside"),
        (Quadric(np.eye(3), (0, 0, 0), -1e4), "inside"),
        (Cylinder((0.5, -1.0, 0.5), (0, 0, 1), 40.0), "inside"),
        (Sphere((0.5, -1.0, 0.5), 2.0, hollow=True), "concave"),
        (Cylinder((0.5, -1.0, 0.5), (0, 0, 1), 2.0, (0, 1), hollow=True), "inside"),  # seen from above
        (Sphere((0.5, -1.0, 100.0), 2.0), "behind"),
        (Sphere((0.5, -1.0, 0.5), 30.0), "tangent"),
        (Torus((-29.5, -1.0, 30.5), (0, 0, 1), 30.0, 1.0), "inside"),
        (Torus((-29.5, -1.0, 31.5), (0, 0, 1), 30.0, 1.0), "tangent"),
        (Cylinder((0.5, -1.0, 0.5), (1, 0, 0), 2.0, (-1, 1), hollow=True), "concave"),
    ],
)
def test_statuses(surface, status):
    found = limb(surface, (0.0, 0.0), CAMERA)
    assert (found.status, found.strands) == (status, ())


def test_a_slight_taper_is_a_cylinder_in_the_limit():
    straight = limb(Cylinder((0, 0, 0), (0, 0, 1), 2.0, (-1, 1)), (80, 30), CAMERA, 5).strands
    tapered = limb(Cone((0, 0, 0), (0, 0, 1), 2.0, (-1, 1), half_angle_deg=1e-9), (80, 30), CAMERA, 5).strands
    for one, other in zip(straight, tapered, strict=True):
        np.testing.assert_allclose(one.at, other.at, atol=1e-6)
        assert (np.abs(one.at - other.at) > 0).any()


def test_no_ellipse_is_refused():
    with pytest.raises(InvalidInput, match="conic must be an ellipse"):
        ellipse_of(np.diag([1.0, -1.0, 1.0]))


def test_contour_is_in_the_polar_plane():
    quadric, eye = SURFACES["ellipsoid"], np.array([5.0, -4.0, 6.0])
    points = contour(quadric, eye).branches[0].points(np.linspace(0, 1, 20))
    polar = quadric.matrix @ np.append(eye, 1.0)
    assert np.abs(np.column_stack([points, np.ones(20)]) @ polar).max() < 1e-12 * np.abs(polar).max() * 10
