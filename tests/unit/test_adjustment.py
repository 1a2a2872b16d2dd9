"""What a picture tells of inputs that its scene is not sure of: right within what it says, and never of noise."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import measure.adjustment as adjustments
import scenes
from measure import adjusting
from measure.adjustment import Adjusted
from scenes import Picture

SIGMA, ROWS, COLUMNS = 2.0, 240, 256
Y, X = np.indices((ROWS, COLUMNS))
EDGE = X > 150  # of two faces
BASE = 16 + np.where(EDGE, 60.0, 90.0) + 0.02 * Y
CHANGES = np.array([
    0.4 * np.exp(-np.abs(X - 150) / 30.0) * EDGE,  # light of a wall, near its foot
    0.3 * (Y - ROWS / 2) / ROWS,  # a lamp that stands elsewhere
    0.3 * (X - COLUMNS / 2) / COLUMNS,
])  # fmt: skip


@pytest.fixture(autouse=True)
def linear(monkeypatch):
    """What these inputs do is told by multiples."""
    monkeypatch.setattr(adjustments, "_LINEAR", 0.1)


@pytest.fixture(scope="module")
def picture():
    scene = scenes.load("task1").with_(noise={"sigma": SIGMA, "bits": None, "dark_level": 16.0})
    return Picture.of(scene, (30, 135), (15, 315))


def _sets(changes, rng, level=0.0, alike=0.0):
    """Two sets of renders whose levels, and differences, have so much noise of rays."""
    return np.array([
        [BASE + level * rng.normal(size=BASE.shape), BASE,
         *(BASE + each + alike * rng.normal(size=BASE.shape) for each in changes)]
        for _ in range(2)
    ])  # fmt: skip


def _blotches(rng, size):
    field = gaussian_filter(rng.normal(size=BASE.shape), 20)
    return size * field / field.std()


def _pulls(adjustment, rng, count, faces=0.0, blotches=0.0):
    """Of so many pictures with inputs at random, (count, k); faces, and blotches on them, are a part brighter or darker
    than they should."""
    found = []
    for _ in range(count):
        true = rng.normal(size=len(CHANGES))
        uneven = 1 + np.where(EDGE, *rng.normal(0, faces, 2)) + _blotches(rng, blotches)
        light = (1 + rng.normal(0, 0.1)) * (BASE - 16 + np.tensordot(true, CHANGES, 1)) * uneven
        told, covariance = adjustment.inputs(16 + light + rng.normal(0, SIGMA, BASE.shape))
        found.append((told - true) / np.sqrt(np.diag(covariance)))
    return np.array(found)


def test_errors_of_inputs_are_as_told(picture):
    rng = np.random.default_rng(1)
    adjustment = adjusting.adjustment(_sets(CHANGES, rng, level=0.5, alike=0.1), picture)
    told = np.sqrt(np.diag(adjustment.covariance))
    assert (told < 0.7).all()
    assert (told > 0.12).all()
    pulls = _pulls(adjustment, rng, 150)
    assert np.sqrt((pulls**2).mean(0)) == pytest.approx(np.ones(3), abs=0.2)  # 0.06 by chance
    noisy = adjusting.adjustment(_sets(CHANGES, rng, level=0.5, alike=1.0), picture)  # its columns are mostly noise
    pulls_of_noisy = _pulls(noisy, rng, 80)
    assert np.sqrt((pulls_of_noisy**2).mean(0)).max() < 1.8  # 1.4: their noise is the same in all pictures
    assert (np.sqrt(np.diag(noisy.covariance)) < 0.8).any()
    alone = (pulls * told).std(0)  # negative control: no input is known as well as half of that
    assert (alone > 0.6 * told).all()


def test_noise_of_rays_tells_nothing(picture):
    """Of two sets it does not agree with itself; one set alone would claim to know all inputs."""
    rng = np.random.default_rng(2)
    sets = _sets(np.zeros_like(CHANGES), rng, alike=3.0)
    told = np.sqrt(np.diag(adjusting.adjustment(sets, picture).covariance))
    assert (told > 0.9).all()
    same = np.array([sets[0], sets[0]])
    assert (np.sqrt(np.diag(adjusting.adjustment(same, picture).covariance)) < 0.5).all()  # negative control


def test_faces_that_reflect_otherwise_tell_nothing_wrong(picture):
    rng = np.random.default_rng(3)
    adjustment = adjusting.adjustment(_sets(CHANGES, rng), picture)
    pulls = _pulls(adjustment, rng, 80, faces=0.05)
    assert np.sqrt((pulls**2).mean(0)).max() < 1.3


def test_a_model_that_does_not_fit_is_believed_less(picture):
    """Blotches of one per cent do as much as the inputs."""
    rng = np.random.default_rng(5)
    adjustment = adjusting.adjustment(_sets(CHANGES, rng), picture)
    pulls = _pulls(adjustment, rng, 60, blotches=0.01)
    sure = np.sqrt(np.diag(adjustment.covariance))
    _, covariance = adjustment.inputs(BASE + (BASE - 16) * _blotches(rng, 0.01))
    told = np.sqrt(np.diag(covariance))
    assert (told > 1.5 * sure).all()
    assert np.sqrt((pulls**2).mean(0)).max() < 2.5  # 1.5: none of its parts is independent of the others
    assert (np.sqrt((pulls**2).mean(0)) * told / sure).max() > 4  # negative control: as sure as without them


def test_what_shows_edges_only_tells_nothing(picture):
    busy = BASE + 60 * ((X // 6 + Y // 6) % 2)
    assert adjusting.adjustment(np.array([[busy] * 4] * 2), picture) is None


def test_sources_add_up_to_the_joint_uncertainty(picture):
    adjustment = adjusting.adjustment(_sets(CHANGES, np.random.default_rng(4)), picture)
    moved = np.array([[0.3, 0.0, 1.0], [0.1, 0.0, -1.0], [0.2, 0.0, np.nan]])
    told = Adjusted(adjustment, ("reflectance", "light_place", "light_place"), moved, moved).sources(moved)
    joint = np.einsum("im,ij,jm->m", moved, adjustment.covariance, moved)
    assert told["reflectance"][:2] ** 2 + told["light_place"][:2] ** 2 == pytest.approx(joint[:2])
    assert (told["reflectance"][1], told["light_place"][1]) == (0.0, 0.0)
    assert np.isnan(told["light_place"][2])


def test_no_input_is_known_better_than_a_multiple_of_its_step(picture, monkeypatch):
    monkeypatch.setattr(adjustments, "_LINEAR", 0.3)
    covariance = adjusting.adjustment(_sets(10 * CHANGES, np.random.default_rng(6)), picture).covariance
    assert np.sqrt(np.diag(covariance)) == pytest.approx(np.full(3, 0.3), abs=0.02)
