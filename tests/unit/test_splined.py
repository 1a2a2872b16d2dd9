"""Splined lenses: what they are, what boards tell of them, and when they are proposed."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

import measure
import planner
import scenes
from measure.boards.parameters import read_model, splined_control
from measure.boards.splined import SplinedModel
from measure.boards.view import View
from scenes import InvalidInput
from scenes.cameras import Splined
from scenes.cameras.splined import plane_slope
from tests.boards import SMALL, poses, told

SHAPE, SIGMA = SMALL.size[::-1], 0.05
FLAT = told(np.zeros((54, 2)), np.tile(SIGMA**2 * np.eye(2), (54, 1, 1)), SMALL.board)
PLACES = np.column_stack([FLAT.places * SMALL.square, np.zeros(54)])


class Wavy:
    """OpenCV's polynomial, and waves of 1.5 px over the image that no polynomial in the radius has."""

    def __init__(self, high: float) -> None:
        self.high, self.plain = high, read_model("k1,k2,p1,p2,k3")

    def seen(self, values: np.ndarray, points: np.ndarray):
        image, _, by_points = self.plain.seen(SMALL.values, points)
        k = 2 * np.pi / np.array([480.0, 360.0])
        (s, t), (c, d) = np.sin(image * k).T, np.cos(image * k).T
        moved = self.high * np.stack([s * d, c * t], -1)
        slope = self.high * np.stack([np.stack([c * d, -s * t], -1), np.stack([-s * t, c * d], -1)], -2) * k
        return image + moved, np.zeros((len(points), 2, 0)), (np.eye(2) + slope) @ by_points


def boards(lens, seen, rng):
    found = []
    for pose in seen:
        image = lens.seen(None, PLACES @ cv2.Rodrigues(pose[:3])[0].T + pose[3:])[0]
        found.append(told(image + SIGMA * rng.standard_normal((54, 2)), FLAT.covariance, SMALL.board))
    return found


def random_lens(rng, plane="stereographic"):
    right, down = 0.03 * rng.standard_normal((2, 5, 7))
    return Splined(kind="splined", plane=plane, extent=(-0.5, -0.4, 0.6, 0.5), right=right.tolist(), down=down.tolist())


@pytest.mark.parametrize("plane", ["normalised", "stereographic"])
def test_a_splined_lens_against_its_formula(plane, rng):
    """Where it records is a sum of cubic polynomials between knots (another of SciPy's routines); slopes by
    differences; beyond the extent nothing."""
    lens = random_lens(rng, plane)
    points = rng.uniform([-0.4, -0.3], [0.5, 0.4], (200, 2))
    radius = np.linalg.norm(points, axis=1)
    factor = 2 * np.tan(np.arctan(radius) / 2) / radius if plane == "stereographic" else np.ones(200)
    place = points * factor[:, None]
    width = np.array([1.1 / 4, 0.9 / 2])
    u = (place - [-0.5, -0.4]) / width
    cell = np.floor(u).astype(int)
    v = u - cell
    basis = [np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]) / 6 for t in v.T]
    moved = np.zeros((200, 2))
    for n in range(200):
        for k, rows in enumerate((lens.right, lens.down)):
            some = np.array(rows)[cell[n, 1] : cell[n, 1] + 4, cell[n, 0] : cell[n, 0] + 4]
            moved[n, k] = basis[1][:, n] @ some @ basis[0][:, n]
    assert lens.bent(points) == pytest.approx(place + moved, abs=1e-14)
    h = 1e-6
    steps = [(lens.bent(points + d) - lens.bent(points - d)) / (2 * h) for d in h * np.eye(2)]
    assert lens.slope(points) == pytest.approx(np.stack(steps, -1), abs=1e-8)
    assert np.isnan(lens.bent(np.array([[0.8, 0.0], [0.0, -0.5]]))).all()
    assert plane_slope(points, plane).shape == (200, 2, 2)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"right": [[0.0] * 4] * 5}, "right and down must be equally many rows"),
        ({"down": [[0.0] * 3] * 4}, "right and down must be equally many rows"),
        ({"extent": [1, 0, 0, 1]}, "extent must be least x and y, largest x and y"),
        ({"plane": "cylinder"}, "normalised"),
    ],
)
def test_what_is_no_splined_lens_is_refused(change, match):
    flat = [[0.0] * 4] * 4
    lens = {"kind": "splined", "extent": [-1, -1, 1, 1], "right": flat, "down": flat} | change
    with pytest.raises(InvalidInput, match=match):
        scenes.load("task1").with_(camera={"lens": lens})


def test_a_scene_is_seen_through_a_splined_lens_as_through_the_polynomial_that_it_is():
    """k1 r^2 x is bicubic: splines through it are it, in predictions to rounding."""
    plain = scenes.load("task1").with_(camera={"lens": {"distortion": -0.2}})
    y, x = np.meshgrid(np.linspace(-0.5, 0.5, 40), np.linspace(-0.5, 0.5, 40), indexing="ij")
    rows = [_control(-0.2 * each * (x**2 + y**2), x, y) for each in (x, y)]
    lens = {"kind": "splined", "extent": [-0.5, -0.5, 0.5, 0.5], "right": rows[0], "down": rows[1]}
    splined = plain.with_(camera={"lens": lens})
    a, b = (planner.predict(scene, (30, 90), (15, 270)) for scene in (plain, splined))
    assert b.value_px == pytest.approx(a.value_px, rel=1e-9)
    assert b.variance_px2 == pytest.approx(a.variance_px2, rel=1e-6)


def _control(moved, x, y):
    """Control points, 5 x 5, of splines that are least squares through numbers on a grid."""
    model = SplinedModel.over("normalised", np.array([-0.5, -0.5, 0.5, 0.5]), (5, 5), np.zeros(2))
    design = model._design(np.stack([x.ravel(), y.ravel()], -1), (0, 0))
    return np.linalg.lstsq(design, moved.ravel())[0].reshape(5, 5).tolist()


def test_derivatives_of_a_splined_camera(rng):
    """By its numbers, by points and by poses against differences; held combinations move nothing in the middle."""
    model = SplinedModel.over("stereographic", np.array([-0.5, -0.4, 0.6, 0.5]), (7, 5), np.array([159.5, 119.5]))
    values = np.append(420.0, 0.02 * rng.standard_normal(len(model.names) - 1))
    assert len(model.names) == 1 + 2 * 35 - 4
    points = rng.uniform([-0.3, -0.2, 0.8], [0.3, 0.2, 1.2], (9, 3))
    image, by_values, by_points = model.seen(values, points)
    for k in (0, 1, 30, 66):
        h = 1e-5 * np.eye(len(values))[k]
        rise = (model.seen(values + h, points)[0] - model.seen(values - h, points)[0]) / 2e-5
        assert by_values[..., k] == pytest.approx(rise, rel=1e-6, abs=1e-6)
    for k, h in enumerate(1e-6 * np.eye(3)):
        rise = (model.seen(values, points + h)[0] - model.seen(values, points - h)[0]) / 2e-6
        assert by_points[..., k] == pytest.approx(rise, rel=1e-6, abs=1e-4)
    axis = model.seen(values, np.array([[0.0, 0.0, 2.0]]))
    assert axis[0][0] == pytest.approx([159.5, 119.5], abs=1e-9)
    assert axis[2][0, :, :2].trace() / 420 == pytest.approx(1.0)  # two axes over a depth of two
    assert axis[2][0, 0, 1] == pytest.approx(axis[2][0, 1, 0])
    assert image == pytest.approx(
        np.array([159.5, 119.5]) + 420 * model.lens(values).bent(points[:, :2] / points[:, 2:])
    )


def test_derivatives_of_a_view_of_a_bent_board(rng):
    model, values = read_model("k1,k2,p1,p2,k3"), SMALL.values
    view = View.of(told(np.zeros((54, 2)), np.tile([[0.02, 0.01], [0.01, 0.03]], (54, 1, 1)), SMALL.board), 25.0)
    sags, pose = np.array([1.0, -0.5]), poses(SMALL, 1, rng, 420.0)[0]
    by_shared, by_pose = view.jacobian(model, values, sags, pose)
    for k in range(11):
        h = 1e-5 * np.eye(11)[k]
        ends = [view.residual(model, values + s * h[:9], sags + s * h[9:], pose) for s in (1, -1)]
        assert by_shared[:, k] == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-5, abs=1e-4)
    for k, h in enumerate(1e-5 * np.eye(6)):
        ends = [view.residual(model, values, sags, pose + s * h) for s in (1, -1)]
        assert by_pose[:, k] == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-5, abs=1e-3)


def modes(away, count):
    """Pulls of a difference's largest modes."""
    sizes, axes = np.linalg.eigh(away.covariance)
    return (axes[:, -count:].T @ away.away.ravel()) / np.sqrt(sizes[-count:])


def test_a_lens_that_no_polynomial_fits_is_proposed_and_its_covariance_is_true():
    """Waves: a misfit of coefficients. Projections against the truth after the best rotation, by the 20 largest modes
    of what is told; 1.5 times either way is rejected."""
    lens, seen = Wavy(1.5), poses(SMALL, 12, np.random.default_rng(5), 420.0)
    truth = SimpleNamespace(model=lens, values=SMALL.values, covariance=np.zeros((0, 0)), image_shape=SHAPE)
    given = boards(lens, seen, np.random.default_rng(6))
    assert measure.calibrate_camera(given, SMALL.square, SHAPE).status == "misfit"
    compared = measure.compare_models(given, SMALL.square, SHAPE, ("k1,k2,p1,p2,k3", "splined:6x5"))
    assert compared.proposed == "splined:6x5"
    assert compared.rms_px[1] < 0.4 * compared.rms_px[0]
    found = measure.calibrate_camera(given, SMALL.square, SHAPE, "splined")
    assert (found.status, found.names[:2], found.is_splined) == ("ok", ("fx", "d1"), True)
    pulls = modes(measure.projection_difference(found, truth, 0.2), 20)
    assert 0.6 < np.sqrt((pulls**2).mean()) < 1.4  # margin: chance, 2.5 sigma of 20; the proof takes many draws
    with pytest.raises(InvalidInput, match="model must be one of coefficients for a covariance"):
        _ = found.for_budget


def test_a_plain_lens_is_left_plain():
    seen = poses(SMALL, 8, np.random.default_rng(5), 420.0)
    given = boards(Wavy(0.0), seen, np.random.default_rng(7))
    compared = measure.compare_models(given, SMALL.square, SHAPE, ("k1,k2,p1,p2,k3", "splined:6x5"))
    assert compared.proposed == "k1,k2,p1,p2,k3"
    assert compared.p_value > 0.3


@pytest.mark.parametrize("text", ["splined:3x6", "splined:axb", "splined:8", "splined:8x41"])
def test_splines_that_are_none(text):
    with pytest.raises(InvalidInput, match="model must be splined:COLUMNSxROWS, 4 to 40 control points each, got"):
        splined_control(text)


def test_a_lens_file_gives_the_lens_back(tmp_path, rng):
    lens = measure.SplinedIntrinsics(fx=400.0, cx=159.5, cy=119.5, spline=random_lens(rng))
    flat = rng.uniform([60, 60], [220, 180], (20, 2))
    assert lens.straighten(lens.distort(flat)) == pytest.approx(flat, abs=1e-8)
