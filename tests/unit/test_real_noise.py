"""Frames of a camera as noise: a made set is read, its noise found, and variances under it are as predicted."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

import measure
import render
import scenes
from measure import FramePair, photon_transfer
from render import expose
from scenes import InvalidInput, Noise, Picture
from tests.proofs.kinds import summed_up
from tests.proofs.real_noise import DESCRIPTION, before, compared, noisy, read, told_of
from validation.remeasured import Sample

TRUE = Noise(sigma=3.0, gain=0.28, dark_level=20.0, bits=12)
SIZE = (320, 360)


def made(folder, row_noise=1.0):
    """A reference set of a simulated camera, 16 steps, whose rows share so much noise."""
    rng, noise = np.random.default_rng(8), TRUE.model_copy(update={"row_sigma": row_noise})
    lines = ["# made", "v 3.0", f"n 12 {SIZE[1]} {SIZE[0]}"]
    (folder / "images").mkdir(parents=True)

    def frames(name, level):
        for i, frame in enumerate(expose(np.full(SIZE, float(level)), noise, rng, 2)):
            file = f"{name}_{i}.png"
            cv2.imwrite(str(folder / "images" / file), frame.astype(np.uint16))
            lines.append(f"i images\\{file}")

    for step in range(1, 17):
        for kind, level in (("b", TRUE.dark_level + 270 * step), ("d", TRUE.dark_level)):
            lines.append(f"{kind} {1000.0 * step}" + f" {100.0 * step}" * (kind == "b"))
            frames(f"{kind}{step}", level)
    (folder / DESCRIPTION).write_text("\n".join(lines))
    return read(folder)


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    return made(tmp_path_factory.mktemp("set") / "even")


def test_noise_is_found_by_photon_transfer(pairs):
    told, used = pairs.halves
    assert (used % 2 == 1).all()
    found = told.noise
    assert (told.status, found.bits, found.column_sigma) == ("ok", 12, 0)
    assert found.gain == pytest.approx(TRUE.gain, rel=0.02)  # margin: 5 standard errors
    assert found.sigma == pytest.approx(TRUE.sigma, rel=0.02)  # margin: 6 standard errors
    assert found.row_sigma == pytest.approx(1.0, rel=0.1)  # margin: 5 standard errors
    assert found.dark_level == pytest.approx(TRUE.dark_level, abs=0.15)  # margin: of 3000 rows


def test_a_camera_without_row_noise_has_none():
    rng = np.random.default_rng(3)
    lit, dark = (
        [FramePair.of(*expose(np.full(SIZE, 20.0 + part * step), TRUE, rng, 2)) for step in (300, 700, 1000, 1500)]
        for part in (1, 0)
    )
    found = photon_transfer(lit, dark, 12)
    assert (found.noise.row_sigma, found.noise.column_sigma, found.status) == (0, 0, "ok")
    bent = [replace(pair, variance=pair.variance * (1.3 - k / 10)) for k, pair in enumerate(lit)]
    assert photon_transfer(bent, dark, 12).status == "misfit"
    with pytest.raises(InvalidInput, match="lit and dark must be as many pairs, 3 or more, got 4 and 3"):
        photon_transfer(lit, dark[:3])
    with pytest.raises(InvalidInput, match="frames must be of one size, 16 x 16 px or more, got 9 x 20 and 20 x 20 px"):
        FramePair.of(np.ones((20, 9)), np.ones((20, 20)))


def test_noise_put_onto_an_image_has_its_levels_variance(pairs):
    steps, rng = np.flatnonzero(pairs.used), np.random.default_rng(2)
    image = np.full((64, 64), TRUE.dark_level)
    image[:, 32:] = 1500.0
    shots = np.array([noisy(image, pairs, steps, rng) for _ in range(40)])
    parts = (shots[..., :32], 20.0, TRUE.variance + 1), (shots[..., 32:], 1500.0, TRUE.variance + 1 + TRUE.gain * 1480)
    for part, level, wanted in parts:
        assert part.var() == pytest.approx(wanted, rel=0.06)  # margin: of one field and fewer places than pixels
        assert part.mean() == pytest.approx(level, abs=0.6)  # margin: 5 standard errors
    assert shots[..., :32].mean(2).var() == pytest.approx(1 + 9 / 32, rel=0.25)  # rows share it across the edge


def test_a_field_is_told_from_independent_noise(pairs):
    told = told_of(pairs.dark_fields[0])
    assert abs(told["along rows"]) < 0.02  # margin: 5 standard deviations
    assert abs(told["along columns"]) < 0.02
    assert told["beyond 5 sigma"] == 0


@pytest.mark.render
def test_variances_under_the_cameras_noise_are_as_predicted(pairs):
    """250 pictures of a block; 1.6 times the variance is refused."""
    (camera, steps), scene = pairs.halves, scenes.load("task1")
    there = scene.settings[0]
    picture = Picture.of(before(scene, camera.noise), there.sensor, there.light)
    clean = render.image(picture, quality=render.Quality(everywhere=False))
    told, rng = measure.propagate(clean, picture, estimator="gradient"), np.random.default_rng(3)
    shots = np.array([noisy(clean, pairs, steps, rng) for _ in range(250)])
    sample = Sample.of(measure.measure(shots, picture, estimator="gradient").value[:, 0])
    predicted = float(told.measurands.covariance[0, 0])
    low, high = sample.interval(predicted)
    assert (told.status, sample.failed) == ("ok", 0)
    assert low / 1.15 < 1 < high * 1.15  # margin: 95 % widened to 3 standard errors
    assert not low < 1.6 < high


@pytest.mark.render
def test_reduced_proof(pairs, capsys):
    """Biases taken off as well, by three estimators; one that takes no notice of rows says so where they matter."""
    (camera, steps), scene = pairs.halves, scenes.load("task1")
    there = scene.settings[0]
    picture = Picture.of(before(scene, camera.noise), there.sensor, there.light)
    rows = compared(picture, pairs, steps, 250, 3, ("gradient", "isophote", "strip"))
    assert summed_up(rows), capsys.readouterr().out
    assert [row.counts for row in rows] == [True, True, False]
