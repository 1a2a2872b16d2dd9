"""Binning of a scene's sensor: against drawn pixels that are taken together here, and where single pixels see."""

from __future__ import annotations

import math

import numpy as np
import pytest

import scenes
from imaging.geometry.projection import project
from imaging.sensor import recorded
from planner.budgeting.plans import systematic
from planner.budgeting.sources import sources
from render.sensor import expose
from scenes import InvalidInput, Noise
from scenes.cameras.binning import Binning
from scenes.scene import Scene

PICTURES = 400
RAW = Noise(sigma=2.5, gain=0.4, bits=8, dark_level=20.0, row_sigma=0.8)
CAMERA = {"width": 480, "height": 360, "pixel_pitch_um": 4.95}


def _together(images: np.ndarray, factor: int) -> np.ndarray:
    """Sums of squares of pixels, (..., height / factor, width / factor)."""
    *lead, height, width = images.shape
    return images.reshape(*lead, height // factor, factor, width // factor, factor).sum((-3, -1))


def _taken(noise: Noise, kind: str, factor: int, signal: float, rng: np.random.Generator) -> np.ndarray:
    """Pictures (n, h, w) of an even light that adds ``signal`` grey levels to a pixel."""
    shape = 16 * factor, 16 * factor
    if kind != "charge":
        drawn = _together(expose(np.full(shape, noise.dark_level + signal), noise, rng, PICTURES), factor)
        return drawn if kind == "sum" else np.rint(drawn / factor**2)
    electrons = _together(rng.poisson(signal / noise.gain, (PICTURES, *shape)), factor)
    read = noise.sigma * rng.standard_normal(electrons.shape)
    rows = noise.row_sigma * rng.standard_normal((*electrons.shape[:2], 1))
    return np.rint(noise.dark_level + noise.gain * electrons + read + rows)


@pytest.mark.parametrize(("kind", "factor"), [("charge", 2), ("sum", 2), ("mean", 2), ("mean", 4)])
@pytest.mark.parametrize("signal", [0.0, 9.0])
def test_mean_and_noise_are_those_of_squares_of_drawn_pixels(kind: str, factor: int, signal: float, rng) -> None:
    """Variance of all pixels, and of rows' means, which rows' own noise decides; that of a pixel is another."""
    drawn = _taken(RAW, kind, factor, signal, rng)
    told = Binning(kind=kind, factor=factor).noise(RAW)
    over = {"charge": factor**2, "sum": factor**2, "mean": 1}[kind]
    dark = RAW.dark_level * (factor**2 if kind == "sum" else 1)
    found = recorded(told.model_copy(update={"dark_level": dark}), np.array([dark + over * signal]))
    white, rows = float(found.noise_variance[0]), told.row_sigma**2
    assert drawn.mean() == pytest.approx(found.level[0], abs=5 * math.sqrt((white / 16 + rows) / 16 / PICTURES))
    wide = 5 * math.sqrt(2 / (PICTURES * 16 * 15))
    assert drawn.var(2, ddof=1).mean() == pytest.approx(white, rel=wide)
    assert drawn.mean(2).var(0, ddof=1).mean() == pytest.approx(rows + white / 16, rel=5 * math.sqrt(2 / 16 / PICTURES))
    as_it_was = RAW.variance + RAW.gain * over * signal
    if kind != "charge":  # its noise is one read's
        assert drawn.var(2, ddof=1).mean() != pytest.approx(as_it_was, rel=wide)


def test_fixed_patterns_add_up_as_independent_numbers() -> None:
    raw = Noise(sigma=1.0, gain=0.1, prnu=0.01, dsnu=0.6)
    flat = expose(np.full((400, 400), 100.0), raw.model_copy(update={"sigma": 1e-6, "gain": 0.0}),
                  np.random.default_rng(1), 1)[0]  # fmt: skip
    drawn = _together(flat, 2)
    told = Binning(kind="sum").noise(raw)
    assert drawn.std() == pytest.approx(math.hypot(told.dsnu, told.prnu * 400), rel=5 * math.sqrt(0.5 / 200**2))


def _binned(kind: str = "mean", factor: int = 2, **more: object) -> Scene:
    changes = {"camera": CAMERA | {"binning": {"kind": kind, "factor": factor}}} | more
    return scenes.load("telecentric_plate").with_(**changes)


def test_what_is_seen_in_a_pixel_is_seen_in_its_square() -> None:
    single, squares = scenes.load("telecentric_plate").with_(camera=CAMERA), _binned(factor=4)
    assert (squares.camera.width, squares.camera.height, squares.camera.pixel_pitch_um) == (120, 90, 4 * 4.95)
    assert squares.camera.binning is None
    points, pose = single.solid.vertices[:9], np.array([20.0, 40.0])
    before, after = (project(points, pose, each.camera) for each in (single, squares))
    assert after == pytest.approx((before + 0.5) / 4 - 0.5, abs=1e-9)


def test_what_is_known_of_the_pixels_is_known_of_the_squares() -> None:
    """The pitch's part of a bore's uncertainty is the same; what the file says of pixels alone it no longer says."""
    pitch = {"pixel_pitch_um": {"value": 4.95, "sd": 0.002}}
    noise = {"sigma": {"value": 2.0, "sd": 0.2}}
    single = scenes.load("telecentric_plate").with_(camera=CAMERA | pitch, noise=noise)
    squares = _binned(camera=CAMERA | pitch | {"binning": {"kind": "mean"}}, noise=noise)
    told = {each.key: each.u for each in squares.uncertain}
    assert told["camera.pixel_pitch_um"] == pytest.approx(0.004)
    assert told["noise.sigma"] / squares.noise.sigma == pytest.approx(0.1)
    by_pitch = [
        systematic(scene, np.array([0.0, 0.0]), tuple(each for each in sources(scene) if "pitch" in each.name),
                   closely=False)
        for scene in (single, squares)
    ]  # fmt: skip
    assert by_pitch[1] == pytest.approx(by_pitch[0], rel=1e-3)
    assert by_pitch[0][0] == pytest.approx((6.0 * 0.002 / 4.95) ** 2, rel=1e-2)  # of a bore of 6 mm


@pytest.mark.parametrize(
    ("scene", "change", "text"),
    [
        ("task1", {}, "camera.pixel_pitch_um must be a pixel's with camera.binning, got None"),
        ("task1", {"camera": {"pixel_pitch_um": 5.0}}, "camera.focal_px must follow from focal_length_mm"),
        ("telecentric_plate", {"noise": {"colour": {"pattern": "RGGB"}}},
         "camera.binning must be left out with noise.colour, got sum"),
        ("telecentric_plate", {"noise": {"bits": 15}},
         "noise.bits must be at most 14 for sums of 2 x 2 pixels, got 15"),
        ("telecentric_plate", {"noise": {"bits": 4}}, "camera.exposure must be at most 44, where pixels end"),
        ("telecentric_plate", {"camera": {"line_time_us": 10.0}}, "camera.line_time_us must be 0 with camera.binning"),
        ("telecentric_plate", {"camera": {"binning": {"kind": "skip"}}}, "camera.binning.kind must be"),
        ("telecentric_plate", {"camera": {"binning": {"kind": "sum", "factor": 1}}}, "camera.binning.factor must be"),
        ("telecentric_plate", {"noise": {"sigma": -1}}, "noise.sigma must be at least 0, got -1"),
    ],
)  # fmt: skip
def test_what_it_does_not_go_with_is_refused(scene: str, change: dict, text: str) -> None:
    camera = {"binning": {"kind": "sum", "factor": 2}} | change.get("camera", {})
    with pytest.raises(InvalidInput) as told:
        scenes.load(scene).with_(**(change | {"camera": camera}))
    assert text in str(told.value)


@pytest.mark.render
def test_a_render_is_the_mean_of_its_pixels() -> None:
    """Levels of a picture of squares against those of single pixels through the same lens, 2 x 2 taken together."""
    from render import image

    small = {"width": 96, "height": 72, "pixel_pitch_um": 24.0}
    single = scenes.load("telecentric_plate").with_(camera=small | {"blur_px": 1.2})
    squares = scenes.load("telecentric_plate").with_(camera=small | {"blur_px": 0.6, "binning": {"kind": "mean"}})
    pose = (8.0, 30.0)
    fine, coarse = image(single, pose), image(squares, pose)
    wide = float(np.ptp(coarse))
    assert np.abs(_together(fine, 2) / 4 - coarse).max() < 0.04 * wide
    assert np.abs(fine[::2, ::2] - coarse).max() > 0.1 * wide
