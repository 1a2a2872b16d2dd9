"""A photograph found, measured, said and drawn."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

import measure
from measure.features.optics import Optics
from measure.photo.edge_points import ellipse_by_points
from scenes import InvalidInput
from tests import commands
from tests.photographs import _HOLES, _PLATE, _TAG, board, disc, ellipse, plate, tag
from validation.report import overlay


def sigmas(values, true, covariance):
    return np.abs(np.ravel(values) - np.ravel(true)) / np.sqrt(np.diag(covariance))


@pytest.fixture(scope="module")
def plates():
    """A picture, and what is found in it."""
    image = plate()
    return image, measure.photograph(image)


@pytest.fixture(scope="module")
def boards():
    image = board()
    return image, measure.photograph(image)


def test_plate(plates):
    """The plate and its four holes, each within 4.5 sigma; sigmas below a hundredth of a pixel."""
    found = plates[1].found
    assert [one.kind for one in found] == ["quadrilateral"] + ["circle"] * 4
    (whole, *holes) = found
    near = [int(np.linalg.norm(whole.corners - corner, axis=1).argmin()) for corner in _PLATE]
    order = np.ravel([[2 * i, 2 * i + 1] for i in near])
    # margin: 4.5 standard deviations
    assert sigmas(whole.corners[near], _PLATE, whole.covariance[np.ix_(order, order)]).max() < 4.5
    for hole in holes:
        assert hole.status == "ok"
        true = min(_HOLES, key=lambda each: np.hypot(*(hole.ellipse[:2] - each[:2])))
        assert sigmas(hole.ellipse[:3], true, hole.covariance[:3, :3]).max() < 4.5  # margin: 4.5 standard deviations
        assert 0 < np.diag(hole.covariance)[:3].max() < 1e-4


@pytest.mark.parametrize("family", ["APRILTAG_36h11", "4X4_1000"])
def test_tag(family):
    """Its black square is measured as one without cells: unbiased, and ``ok``; in the tag's own order."""
    (found,) = measure.photograph(tag(family, 3, 1), kinds=("tag",)).found
    assert (found.kind, found.status, found.candidate.identifier) == ("tag", "ok", 3)
    assert sigmas(found.corners, np.roll(_TAG, 1, 0), found.covariance).max() < 4.5  # margin: 4.5 standard deviations
    assert np.abs(found.corners - np.roll(_TAG, 1, 0)).max() < 0.035


def test_chessboard(boards):
    """All inner corners; until they are measured they have no covariance."""
    (found,) = boards[1].found
    assert found.kind == "chessboard"
    assert found.corners.shape == (35, 2)


def test_box_near_and_corners():
    image = plate()
    (hole,) = measure.photograph(image, box=(120, 100, 200, 180)).found
    assert hole.ellipse[:3] == pytest.approx([160, 140, 30], abs=0.05)
    (same,) = measure.photograph(image, near=(160, 140)).found
    assert same.ellipse == pytest.approx(hole.ellipse, abs=0.01)
    (whole,) = measure.photograph(image, corners=_PLATE + 2.0).found
    assert whole.candidate is None
    assert np.abs(whole.corners - _PLATE).max() < 0.03
    two = measure.photograph(image, most=2)
    assert (len(two.found), len(two.candidates)) == (2, 5)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"box": (5, 5, 1, 9)}, "box must be x0, y0, x1, y1 with x0 < x1"),
        ({"box": (700, 5, 800, 9)}, "box must lie in the image of 640 x 480 px"),
        ({"box": (0, 0, 40, 40)}, "image must show a quadrilateral, .* in the box, got none that stands out"),
        ({"near": (-1, 5)}, "near must be x, y in the image"),
        ({"kinds": ("tag",)}, "image must show a tag, got none that stands out"),
        ({"most": 0}, "most must be from 1 to 1000, got 0"),
        ({"corners": _PLATE, "near": (1, 1)}, "near, box and kinds must be left out where corners are given"),
        ({"box": (0, 0, 40, np.nan)}, "box must be of finite numbers"),
    ],
)
def test_refused(how, said):
    with pytest.raises(InvalidInput, match=said):
        measure.photograph(plate(), **how)


@pytest.mark.parametrize("circle", [True, False])
def test_edge_points_of_an_ellipse(circle, rng):
    """60 pictures: each parameter scatters as its covariance says, standard error 9 %; not as 1.5 times that."""
    true = np.array([70.2, 60.4, 45.0, 45.0 if circle else 31.0, 0.0 if circle else 30.0])
    clean = 50 + 100 * ellipse(true, (120, 140))
    optics = Optics(clean.shape, 0.8, 4.0, 1.0, 5.0)
    runs = [ellipse_by_points(clean + 2 * rng.standard_normal(clean.shape), true + [0.6, -0.5, 0.4, 0.3, 0], optics,
                              circle) for _ in range(60)]  # fmt: skip
    free = 3 if circle else 5
    values = np.array([run.parameters for run in runs])[:, :free]
    told = np.sqrt(np.mean([np.diag(run.covariance) for run in runs], 0))[:free]
    ratio = values.std(0, ddof=1) / told
    assert np.abs(ratio - 1).max() < 4 / np.sqrt(2 * 59)  # margin: 4 standard errors of 60 pictures
    assert np.abs(ratio / 1.5 - 1).min() > 1 / np.sqrt(2 * 59)  # margin: a third of the 50 % is beyond chance
    # margin: 4 standard errors
    assert np.abs(values.mean(0) - true[:free]).max() < 4 * told.max() / np.sqrt(60) + 0.002
    assert all(run.status == "ok" for run in runs)


def test_large_circle_is_measured_by_points():
    """Of 200 px radius, in an image of half a megapixel."""
    image = 50 + 100 * disc(300.3, 280.7, 200.0, (560, 620)) + np.random.default_rng(1).standard_normal((560, 620))
    (found,) = measure.photograph(image).found
    assert (found.kind, found.status) == ("circle", "ok")
    # margin: 4.5 standard deviations
    assert sigmas(found.ellipse[:3], [300.3, 280.7, 200.0], found.covariance[:3, :3]).max() < 4.5


def test_overlay(plates, tmp_path):
    """As wide as a page; what was found is drawn in colour, and the files that cannot be written are refused."""
    image, found = plates
    overlay.write(tmp_path / "a.png", image, found)
    drawn = cv2.imread(str(tmp_path / "a.png"))
    assert drawn.shape[1] == 1200
    assert (np.ptp(drawn.astype(int), axis=2) > 60).mean() > 0.005  # margin: that something is drawn
    texts = [text.get_text() for text in overlay.figure(image, found).axes[0].texts]
    side = found.found[0].quantities[0]
    assert f"{side.value:.4f} ± {side.sigma:.4f} px" in texts
    with pytest.raises(InvalidInput, match=r"--output must end in \.png, \.pdf, \.svg"):
        overlay.write(tmp_path / "a.gif", image, found)
    with pytest.raises(InvalidInput, match="--output must be a writable file"):
        overlay.write(tmp_path / "no" / "a.png", image, found)


def test_a_board_is_drawn_with_all_its_corners(boards):
    """And one that is not measured without an ellipse."""
    image, found = boards
    (one,) = found.found
    ovals = len(overlay.figure(image, found).axes[0].patches)
    assert ovals >= len(one.corners) == 35
    covariance = one.covariance.copy()
    covariance[:2] = covariance[:, :2] = np.nan
    less = replace(found, found=(replace(one, covariance=covariance),))
    assert len(overlay.figure(image, less).axes[0].patches) == ovals - 1


def ice(*arguments):
    return commands.ice("measure", *arguments)


def test_command(tmp_path):
    cv2.imwrite(str(tmp_path / "plate.png"), plate())
    done = ice(tmp_path / "plate.png", "--json", "--all", "-o", tmp_path / "drawn.png")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert [one["kind"] for one in told["found"]] == ["quadrilateral"] + ["circle"] * 4
    assert {"status", "corners", "covariance", "sides", "quantities", "p_value", "noise", "blur_px", "score"} <= set(
        told["found"][0]
    )
    assert told["found"][0]["sides"][0]["residual_px"] < 0.2
    assert {"centre", "axes", "covariance"} <= set(told["found"][1])
    assert (tmp_path / "drawn.png").stat().st_size > 10_000
    corners = [f"{x},{y}" for x, y in _PLATE]
    said = ice(tmp_path / "plate.png", "--corners", *corners)
    assert said.returncode == 0
    assert "1. quadrilateral: ok" in said.stdout
    refused = ice(tmp_path / "plate.png", "--near", "1,2,3")
    assert refused.returncode == 2
    assert refused.stderr.strip().endswith("--near must be 2 numbers with commas between, px, got '1,2,3'")
    refused = ice(tmp_path / "plate.png", "task1", "--sensor", "30,20", "--kind", "tag")
    assert (refused.returncode, refused.stderr.count("\n")) == (2, 1)
    assert "--kind must be left out with a scene, got tag" in refused.stderr
