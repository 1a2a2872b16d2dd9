"""Another program's stored calibration, written here from a simulated camera: read as its documentation says."""

import base64
import io

import cv2
import numpy as np
import pytest

from scenes import InvalidInput
from tests.boards import SMALL, poses
from tests.proofs.peer import Stereographic, line, read

RATIONAL = np.array([420.0, 421, 161, 118.5, -0.1, 0.02, 1e-3, -5e-4, 0.0, 0.05, 0.0, 0.0])
WARP, SPACING = np.array([-1.5, 0.8]), 25.0


def write(path, **change):
    """Twelve boards of 9 x 6 corners, weights of 1 and 1/2, errors of 0.05 px over the weight; one corner is out."""
    rng = np.random.default_rng(3)
    seen = np.array(poses(SMALL, 12, rng, 420.0))
    x, y = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 6))
    places = np.stack([SPACING * 4 * (x + 1), SPACING * 2.5 * (y + 1), WARP[0] * (1 - x**2) + WARP[1] * (1 - y**2)], -1)
    matrix = np.array([[RATIONAL[0], 0, RATIONAL[2]], [0, RATIONAL[1], RATIONAL[3]], [0, 0, 1]])
    observed = np.empty((12, 6, 9, 3))
    observed[..., 2] = rng.choice([1.0, 0.5], (12, 6, 9))
    for pose, corners in zip(seen, observed, strict=True):
        image = cv2.projectPoints(places.reshape(-1, 3), pose[:3], pose[3:], matrix, RATIONAL[4:])[0]
        corners[..., :2] = image.reshape(6, 9, 2) + 0.05 * rng.standard_normal((6, 9, 2)) / corners[..., 2:]
    observed[0, 0, 0] = [5.0, 5.0, -1.0]
    told = {
        "intrinsics": RATIONAL[None], "frames_rt_toref": seen, "observations_board": observed,
        "lensmodel": "LENSMODEL_OPENCV8", "imagersizes": np.array([[320, 240]]), "calobject_warp": WARP,
        "calibration_object_spacing": SPACING,
    } | change  # fmt: skip
    file = io.BytesIO()
    np.savez_compressed(file, **told)
    path.write_text(f"# a comment\n{ ({'optimization_inputs': base64.b85encode(file.getvalue())})!r}\n")
    return path


def test_a_stored_solution_leaves_its_noise_and_stays_where_it_is(tmp_path):
    """The noise of 647 corners to 4 sigma; another warp leaves more; adjusted, the sags are told again."""
    peer = read(write(tmp_path / "a.cameramodel"))
    assert (peer.marked, peer.image_shape) == (1, (240, 320))
    assert peer.stored == pytest.approx(0.05 * np.sqrt(2), rel=0.08)  # margin: chance, 4 sigma of 1294 numbers
    assert read(write(tmp_path / "b.cameramodel", calobject_warp=-WARP)).stored > 0.15
    found = line(peer, "opencv8")
    left = np.sqrt(2 * found.whole.chi_square / found.whole.rows)
    assert left <= peer.stored
    scale = np.sqrt(np.diag(found.found.covariance))
    assert np.abs((found.found.values - RATIONAL)[:4] / scale[:4]).max() < 4
    assert np.abs(found.whole.sags - WARP).max() < 0.1
    assert found.left_out.sum() > found.whole.chi_square


def test_splines_over_the_stereographic_plane():
    """Control points that are a plane give that plane; and without displacement all rays their closed form."""
    model = Stereographic((12, 8), 120.0)
    per_unit = 9 / (4 * np.tan(np.radians(120) / 4))
    x, y = np.meshgrid((np.arange(12) - 5.5) / per_unit, (np.arange(8) - 3.5) / per_unit)
    values = np.array([500.0, 510, 320, 240])
    points = np.random.default_rng(1).uniform([-1, -0.5, 0.8], [1, 0.5, 1.2], (40, 3))
    length = np.linalg.norm(points, axis=1)
    u = 2 * points[:, :2] / (length + points[:, 2])[:, None]  # 2 tan(theta / 2), by half angles
    flat = model.seen(np.append(values, np.zeros(192)), points)[0]
    assert flat == pytest.approx([320, 240] + values[:2] * u)
    plane = np.stack([0.01 + 0.02 * x - 0.03 * y, 0.05 * x], -1)
    image, _, by_points = model.seen(np.append(values, plane.ravel()), points)
    moved = u + np.stack([0.01 + 0.02 * u[:, 0] - 0.03 * u[:, 1], 0.05 * u[:, 0]], -1)
    assert image == pytest.approx([320, 240] + values[:2] * moved)
    ahead = model.seen(np.append(values, plane.ravel()), points / length[:, None] + [1e-5, 0, 0])[0]
    assert by_points[:, :, 0] == pytest.approx((ahead - image) / 1e-5, rel=1e-2, abs=1.0)  # margin: its curvature


@pytest.mark.parametrize(
    ("change", "match"),
    [({"lensmodel": "LENSMODEL_CAHVOR"}, "lensmodel must be OPENCV8 or cubic splines"), (None, "got")],
)
def test_what_is_no_stored_calibration_is_refused(tmp_path, change, match):
    path = tmp_path / "c.cameramodel"
    if change is None:
        path.write_text("{'lensmodel': 'x'}")
    else:
        write(path, **change)
    with pytest.raises(InvalidInput, match=match):
        read(path)
