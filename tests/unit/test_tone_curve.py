"""Tone curves that were not undone: seen in the edges, or not to be told, and then said so."""

import cv2
import numpy as np
import pytest

import measure
from measure.photo.tone_curve import UNTOLD, ToneCurve, together, tone_curve
from scenes import photograph, status
from scenes.cameras import tone
from scenes.photograph import Photograph
from tests.oracle import polygon_image

SHAPE = (120, 150)
CORNERS = np.array([[31.3, 22.2], [121.6, 33.9], [112.4, 95.7], [20.8, 89.1]])


def shot(noise, rng, coded=False, contrast=160.0, background=30.0):
    light = background + contrast / 100 * polygon_image(CORNERS, SHAPE, 0.8)
    seen = 255 * (light / 255) ** (1 / 2.2) if coded else light
    return np.clip(np.rint(seen + noise * rng.standard_normal(SHAPE)), 0, 255)


def told(image, known=True):
    photo = Photograph(image, 255.0, tone_known=known)
    return measure.measure_quadrilateral(photo, corners=CORNERS)


@pytest.mark.parametrize(("coded", "bend"), [(False, 0.0), (True, 1.2)])
def test_bend(coded, bend, rng):
    """Unbiased to 0.15, with a true standard error: 16 pictures; one 1.7 times as large would be seen."""
    curves = [measure.photo.quadrilateral.expected(image, CORNERS, measure.photo.recording.recording(Photograph(image)))
              .blur.tone for image in (shot(3.0, rng, coded) for _ in range(16))]  # fmt: skip
    found = np.array([curve.bend for curve in curves])
    error = np.mean([curve.error for curve in curves])
    assert found.mean() == pytest.approx(bend, abs=0.15)
    # margin: chance: 16 pictures tell a standard deviation to 18 %
    assert found.std(ddof=1) / error == pytest.approx(1.0, abs=0.55)


def test_a_curve_that_was_not_undone_is_a_misfit(rng):
    """At contrast over noise 40, where goodness of fit alone does not see it and the corners are 20 sigma off."""
    images = [shot(3.0, rng, coded=True) for _ in range(3)]
    found = [told(image) for image in images]
    assert {one.status for one in found} == {status.MISFIT}
    assert np.median([one.p_value for one in found]) > 1e-3
    assert {told(shot(3.0, rng)).status for _ in range(3)} == {status.OK}


def test_what_neither_file_nor_picture_tells(rng):
    """At contrast over noise 12 it matters and is not seen; where the contrast is small beside the level it does not
    matter; at 80 the picture shows it."""
    assert {told(shot(13.0, rng), False).status for _ in range(2)} == {status.TONE_UNKNOWN}
    assert {told(shot(13.0, rng)).status for _ in range(2)} == {status.OK}
    assert {told(shot(2.0, rng, contrast=10.0, background=180.0), False).status for _ in range(2)} == {status.OK}
    assert {told(shot(2.0, rng), False).status for _ in range(2)} == {status.OK}


def test_what_is_known_of_files(tmp_path, rng):
    """A mark, an option, a raw mosaic or real numbers tell; a plain PNG does not."""
    image = shot(13.0, rng).astype(np.uint8)
    cv2.imwrite(str(tmp_path / "a.png"), image)
    cv2.imwrite(str(tmp_path / "a.tif"), image.astype(np.float32))
    assert not photograph.read(tmp_path / "a.png").tone_known
    assert photograph.read(tmp_path / "a.png", gamma="1").tone_known
    assert photograph.read(tmp_path / "a.png", bayer="RGGB").tone_known
    assert photograph.read(tmp_path / "a.tif").tone_known


def test_renders_are_marked_as_linear(tmp_path, rng):
    from validation import picture_file

    for scale in (1, 100):
        picture_file.write(tmp_path / "a.png", scale * shot(2.0, rng))
        found = photograph.read(tmp_path / "a.png")
        assert (found.tone, found.tone_known) == ("tone curve: none (its gAMA mark)", True)
        assert found.levels.max() > 150 * scale


def test_edges_together():
    """Weighted by their variances; those that tell nothing do not count."""
    found = together((ToneCurve(0.1, 0.2, 3.0), ToneCurve(0.4, 0.1, 5.0), UNTOLD))
    assert found == ToneCurve(pytest.approx(0.34), pytest.approx(1 / np.sqrt(125)), 5.0)
    assert not together((UNTOLD,)).straight
    assert not UNTOLD.bent
    assert ToneCurve(0.39, 0.1, 3.0).bent
    assert not ToneCurve(0.38, 0.1, 3.0).bent
    assert tone.NONE.plain


@pytest.mark.parametrize("darkest", [0.0, -3.0, 10.0])
def test_pixels_without_light_count_as_dark_ones(darkest):
    """What a power of 1 + b leaves of levels is b times -x log(x / mean x): found again, black pixels among them."""
    levels = np.concatenate([np.linspace(20.0, 200.0, 40), [darkest] * 4])
    shown = np.where(levels > 0, levels, 0.2)  # a thousandth of the brightest
    left = 0.3 * -shown * np.log(shown / shown.mean())
    design = np.cos(np.arange(44.0))[:, None]
    left = left - design @ np.linalg.lstsq(design, left)[0]
    found = tone_curve(design, levels, left, np.full(44, 0.5), 1)
    assert found.bend == pytest.approx(0.3)
    assert found.error == pytest.approx(0.3 / np.linalg.norm(0.5 * left))
