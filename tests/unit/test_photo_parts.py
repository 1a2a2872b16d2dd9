"""Noise, blur and sides of a photograph, each told from images made with known ones."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from measure.find.candidate import Candidate
from measure.find.search import find_quadrilateral
from measure.photo import photograph, profiles
from measure.photo.noise import noise_sigma
from measure.photo.profiles import edge_sigma, refined
from scenes import InvalidInput
from scenes.photograph import Photograph
from tests.oracle import polygon_image
from validation.cli.measure import Options, _shapes_wanted

CORNERS = np.array([[40.0, 30.0], [150.0, 38.0], [141.0, 118.0], [33.0, 108.0]])
SHAPE = (150, 190)


def picture(blur=0.8, contrast=100.0, background=30.0):
    return polygon_image(CORNERS, SHAPE, blur, contrast, background)


@pytest.mark.parametrize("sigma", [0.5, 3.0, 12.0])
def test_noise(sigma, rng):
    """Of 28,500 pixels with edges, and on a slope: 2 %; nine tenths and eleven tenths of it are refused."""
    slope = np.add.outer(0.2 * np.arange(150), 0.3 * np.arange(190))
    for clean in (picture(), slope):
        # margin: chance: 2 % is the claim
        assert noise_sigma(clean + sigma * rng.standard_normal(SHAPE)) == pytest.approx(sigma, rel=0.025)


def test_noise_of_bytes_and_of_bands(rng):
    """Digits add a twelfth to the variance; of a large image some bands of rows are enough."""
    bytes_ = np.clip(np.rint(120 + 4 * rng.standard_normal((300, 300))), 0, 255).astype(np.uint8)
    assert noise_sigma(bytes_) == pytest.approx(np.sqrt(16 + 1 / 12), rel=0.021)
    large = (50 + 2 * rng.standard_normal((2600, 1000))).astype(np.float32)
    assert noise_sigma(large) == pytest.approx(2.0, rel=0.006)
    assert noise_sigma(np.full((40, 40), 7.0)) == 0


@pytest.mark.parametrize("blur", [0.9, 1.4, 2.0, 2.6])
@pytest.mark.parametrize("contrast", [100.0, -25.0])
def test_blur(blur, contrast):
    """The variance of a normal distribution that is cut off at 4 px: of lens and pixel together."""
    whole = np.sqrt(blur**2 + 1 / 12)
    cut = 4 / whole
    left = whole**2 * (1 - 2 * cut * norm.pdf(cut) / (norm.cdf(cut) - norm.cdf(-cut)))
    assert edge_sigma(picture(blur, contrast), CORNERS) == pytest.approx(np.sqrt(left - 1 / 12), abs=0.18)


def test_blur_has_limits():
    assert edge_sigma(np.full(SHAPE, 9.0), CORNERS) == pytest.approx(0.7)
    wide = edge_sigma(picture(6.0), CORNERS)
    assert 1.5 < wide <= 4.0  # margin: between what a wide blur has at least and the window's width
    assert edge_sigma(picture(0.05), CORNERS) >= 0.3 - 1e-6  # margin: the least that is told


@pytest.mark.parametrize("shift", [(0.0, 0.0), (2.5, -1.5), (-3.0, 3.0)])
def test_refined(shift, rng):
    """From a start some pixels off to a tenth of a pixel; where there is no side, as it was."""
    noisy = picture() + 2 * rng.standard_normal(SHAPE)
    # margin: where the measurement begins: a twentieth of the 3 px within which it seeks
    assert refined(noisy, CORNERS + shift) == pytest.approx(CORNERS, abs=0.15)


@pytest.mark.parametrize("background", [30.0, 180.0])
def test_found(background, rng):
    """Among two the stronger one, its upper left corner first; none where nothing is, or at the border."""
    contrast = 100.0 if background < 100 else -100.0
    second = np.array([[160.0, 10.0], [182.0, 12.0], [180.0, 30.0], [158.0, 28.0]])
    image = picture(0.8, contrast, background) + polygon_image(second, SHAPE, 0.8, contrast / 4, 0.0)
    found = find_quadrilateral(image + rng.standard_normal(SHAPE))
    assert min(np.abs(found - way).max() for way in (CORNERS, CORNERS[[0, 3, 2, 1]])) < 2.5
    with pytest.raises(InvalidInput, match="must show a convex quadrilateral"):
        find_quadrilateral(np.full(SHAPE, 9.0))
    cut = polygon_image(CORNERS - [39.5, 29.5], SHAPE, 0.8, 100.0, 30.0)
    with pytest.raises(InvalidInput, match="must show a convex quadrilateral"):
        find_quadrilateral(cut)


def _wanted(**given):
    return _shapes_wanted(Options(Path("photo.png"), **given))


def test_shapes_are_asked_for_by_so_many_numbers_each():
    """A place has two, a box four, four corners two each; one more or less is refused by its name."""
    assert _wanted() == {"near": None, "box": None, "corners": None, "kinds": None, "most": 5}
    found = _wanted(near="1,2.5", box="1,2,3,4", kind="circle,tag", most=3)
    assert found == {"near": (1, 2.5), "box": (1, 2, 3, 4), "corners": None, "kinds": ("circle", "tag"), "most": 3}
    assert _wanted(every=True)["most"] == 1000
    assert _wanted(corners=("1,2", "3,4", "5,6", "7,8"))["corners"] == [(1, 2), (3, 4), (5, 6), (7, 8)]
    wrong = {"near": "1", "box": "1,2,3", "corners": ("1,2", "3,4", "5,6", "7,8,9")}
    for name, value in wrong.items():
        with pytest.raises(InvalidInput, match=f"--{name} must be {4 if name == 'box' else 2} numbers"):
            _wanted(**{name: value})
    with pytest.raises(InvalidInput, match="--most must be left out with --all, got 3"):
        _wanted(every=True, most=3)


@pytest.mark.parametrize("corner", range(4))
@pytest.mark.parametrize(("off", "is_taken"), [(11.5, True), (12.5, False), (-12.5, False)])
def test_one_corner_that_is_far_off_leaves_all_as_they_were(corner, off, is_taken, monkeypatch):
    """Beyond 12 px along x or y, twice the reach of the profiles, whichever of the four it is."""
    found = CORNERS + 0.3
    found[corner, 1] = CORNERS[corner, 1] + off
    monkeypatch.setattr(profiles, "corners_through", lambda *_: (found, None))
    assert refined(picture(), CORNERS).tolist() == (found if is_taken else CORNERS).tolist()


@pytest.mark.parametrize(
    ("of_corners", "alike", "of_all", "expected"),
    [
        (("ok", "not_visible", "ok"), True, "ok", "ok"), (("ok", "not_visible", "ok"), False, "ok", "correlated"),
        (("ok", "low_contrast", "ok"), True, "compressed", "compressed"),
        (("ok", "low_contrast", "misfit"), True, "ok", "misfit"), (("not_visible",) * 3, True, "ok", "not_visible"),
    ],
)  # fmt: skip
def test_what_is_said_of_a_boards_corners(of_corners, alike, of_all, expected, monkeypatch):
    """The worst of those that are measured and of the photograph; the least p-value of them, and all their errors."""
    measured = np.array([each in ("ok", "misfit") for each in of_corners])
    corners = np.where(measured[:, None], [[1.0, 2], [3, 4], [5, 6]], np.nan)
    told = SimpleNamespace(
        measured=measured, status=of_corners, corners=corners, p_value=np.array([0.3, np.nan, 0.02]), blur_px=0.8
    )
    seen = SimpleNamespace(curve=SimpleNamespace(variance=lambda level: 2 * level), status=of_all)
    photo, grid = Photograph(np.full((4, 5), 8.0)), np.arange(6.0).reshape(1, 3, 2)
    asked = []
    monkeypatch.setattr(photograph, "recording", lambda *given: asked.append(given) or seen)
    monkeypatch.setattr(photograph, "measured", lambda *given: asked.append(given) or told)
    monkeypatch.setattr(photograph, "board_covariance", lambda *given: (np.eye(6), alike))
    one = Candidate("chessboard", grid[0], 1.0, 10.0, 1.0, grid=grid)
    found = photograph._board(photo, one)
    assert asked[0] == (photo,)
    assert asked[1][0] is photo.levels
    assert asked[1][1] is grid
    assert asked[1][2] == 4.0
    assert (found.kind, found.status, found.noise, found.blur_px) == ("chessboard", expected, 4.0, 0.8)
    assert (found.ellipse, found.quantities, found.residuals, found.candidate) == (None, (), (), one)
    if measured.any():
        assert found.p_value == 0.02
        assert found.corners is corners
        assert found.covariance.tolist() == np.eye(6).tolist()
    else:
        assert np.isnan(found.p_value)
        assert (found.corners, found.covariance) == (None, None)
