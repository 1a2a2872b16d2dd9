"""A picture that is cut off at the end of the scale otherwise than its simulation: its bias is another one."""

import json
from dataclasses import replace

import numpy as np
import pytest

import measure
import render
from imaging.sensor import recorded
from measure import Images
from measure.saturation import _BRIGHTER, expected, limits, saturated
from scenes import Noise, Picture
from scenes.status import CLUTTER, OK
from tests.oracle import block_image
from validation import inspection, kept, simulation
from validation.cli import measurands
from validation.remeasured import Method

POSES = (30, 135), (15, 315)
MOST = 0.3  # of sigma, the largest bias of what is ok
PICTURES = 200


@pytest.fixture(scope="module")
def picture(task1):
    return Picture.of(task1, *POSES)


@pytest.fixture(scope="module")
def exact(task1):
    """Of which the brightest pixel is 15 grey levels, six standard deviations of noise, below the end."""
    image = block_image(task1, *POSES)
    return _lit(task1.noise, image, (240 - task1.noise.dark_level) / (image.max() - task1.noise.dark_level))


@pytest.fixture(scope="module")
def off(picture, exact):
    return _correction(picture, exact)


def _correction(picture, exact):
    return measure.correction(Images((exact, exact)), picture, "gradient")


def _lit(noise, image, by):
    return noise.dark_level + by * (image - noise.dark_level)


def _exposed(picture, image, seed=3):
    return render.expose(image, picture.scene.noise, np.random.default_rng(seed), PICTURES)


@pytest.mark.parametrize(
    "noise",
    [Noise(sigma=2.0, bits=8), Noise(sigma=0.5, bits=8, gain=0.05), Noise(sigma=1.0, bits=10, prnu=5e-3)],
)
def test_as_many_pixels_are_saturated_as_are_expected(noise):
    """Of 40,000 levels up to the end: drawn counts, to 4 standard errors; 1.3 times, or none, are not drawn."""
    end = 2.0**noise.bits - 1
    image = np.linspace(end - 12, end + 2, 40_000).reshape(200, 200)
    counts = (render.expose(image, noise, np.random.default_rng(5), 8) == end).sum((1, 2))
    told, error = expected(noise, image.ravel()), np.sqrt(expected(noise, image.ravel()) / 8)
    assert abs(counts.mean() - told) < 4 * error
    assert abs(counts.mean() - 1.3 * told) > 4 * error
    assert told > 1000


def test_only_pixels_that_are_looked_at_count(picture, exact):
    """All four corners of the image, and one pixel of an edge, at the end of the scale."""
    image, where = exact.copy(), measure.region_of_interest(picture, estimators=("gradient",))
    image[[0, 0, -1, -1], [0, -1, 0, -1]] = 255
    assert not where[0, 0]
    assert saturated(image[None], picture, "gradient").tolist() == [0]
    image[tuple(np.argwhere(where)[0])] = 255
    assert saturated(np.stack([exact, image]), picture, "gradient").tolist() == [0, 1]


def test_a_brighter_picture_is_ok_until_its_value_moves(picture, exact, off):
    """Under more and more light: `ok` where values are off by less than 0.3 sigma, never where by more than 0.6."""
    (_, most), states = off.saturated, []
    assert most[0] > 20
    for by in (1.0, 1.04, 1.07, 1.1, 1.15):
        found = measure.measure(_exposed(picture, _lit(picture.scene.noise, exact, by)), picture, correction=off)
        moved = abs(found.value.mean() - found.nominal[0]) / off.sigma[0]
        part = float((found.status == OK).mean())
        assert (found.u_bias[found.status == CLUTTER] == np.inf).all()
        assert np.isfinite(found.u_bias[found.status == OK]).all()
        states.append((by, moved, part))
    noise = 3 / np.sqrt(PICTURES)
    assert all(part == 1 and moved < MOST + noise for by, moved, part in states if by < 1.05)
    assert all(part == 0 for _, moved, part in states if moved > 2 * MOST + noise)
    assert states[-1][1] > 5


def test_without_limits_such_a_value_is_ok_and_wrong(picture, exact, off):
    """The negative control: what was said before the picture's own saturation was looked at."""
    image = _exposed(picture, _lit(picture.scene.noise, exact, 1.15))[0]
    found = measure.measure(image, picture, correction=replace(off, saturated=None))
    assert found.status.tolist() == [OK]
    assert abs(found.value[0] - found.nominal[0]) > 5 * found.u[0]


def test_a_picture_less_saturated_than_its_simulation_has_another_bias_too(picture, exact):
    """The simulation is cut off along edges, the picture has three quarters of its light and is not."""
    bright = _lit(picture.scene.noise, exact, 1.15)
    off = _correction(picture, bright)
    assert abs(off.bias[0]) > 5 * off.sigma[0]
    assert off.saturated[0][0] > 0
    alike = measure.measure(_exposed(picture, bright), picture, correction=off)
    assert (alike.status == OK).mean() > 0.98
    darker = measure.measure(_exposed(picture, exact), picture, correction=off)
    assert (darker.status == CLUTTER).all()
    assert np.isinf(darker.u).all()


def test_a_scale_without_an_end_has_no_limits(picture, exact):
    scene = picture.scene.tried(noise=picture.scene.noise.model_copy(update={"bits": None}))
    endless = picture.with_scene(scene)
    least, most = limits(exact, endless, "gradient", None, np.array([1e-3]))
    assert (least.tolist(), most.tolist()) == ([0.0], [np.inf])
    assert saturated(1e6 + exact[None], endless, "gradient").tolist() == [0]


def test_far_from_the_end_no_more_than_chance_is_allowed(picture, exact):
    """Levels half as high: under a quarter more light no pixel is saturated yet; three may be by chance."""
    dim = _lit(picture.scene.noise, exact, 0.5)
    assert recorded(picture.scene.noise, _lit(picture.scene.noise, dim, _BRIGHTER[-1])).level.max() < 200
    least, most = limits(dim, picture, "gradient", None, np.array([1e-3]))
    assert (least.tolist(), most.tolist()) == ([0.0], pytest.approx([3.0], abs=1e-6))


def test_why_is_said_with_the_number(picture, exact, off):
    image = _exposed(picture, _lit(picture.scene.noise, exact, 1.15))[0]
    found = measure.measure(image, picture, correction=off)
    inspected = inspection.inspect(found)
    rows = measurands.facts(inspected)
    assert (rows[0]["status"], rows[0]["u_bias"], rows[0]["u"]) == (CLUTTER, None, None)
    (told,) = measurands.reasons(rows, inspected)
    assert told == (
        f"distance: {int(found.saturated)} pixels near the edges are at the end of the sensor's scale, not as in the "
        "simulation, whose bias is another one"
    )


def test_limits_are_kept(picture, off, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    made = [off]
    monkeypatch.setattr(simulation, "simulated", lambda *_: made.pop())
    first, again = (kept.correction(picture, Method("gradient")) for _ in range(2))
    assert not made
    assert [limit.tolist() for limit in first.saturated] == [limit.tolist() for limit in again.saturated]
    (file,) = kept.folder().glob("*.json")
    told = json.loads(file.read_text())
    file.write_text(json.dumps({**told, "saturated": [[0.0, 1.0], [2.0, 3.0]]}))
    made.append(off)
    kept.correction(picture, Method("gradient"))
    assert not made  # two limits of one measurand: not as it was written
