"""Frames of a camera as noise: a made set is read, its noise found, and variances under it are as predicted."""

import cv2
import numpy as np
import pytest

from render import expose
from scenes import Noise
from tests.proofs.real_noise import DESCRIPTION, compared, noisy, read, told_of

pytestmark = pytest.mark.render
TRUE = Noise(sigma=3.0, gain=0.28, dark_level=20.0, bits=12)
SIZE = (260, 320)


def made(folder, row_noise=0.0):
    """A reference set of a simulated camera, 12 steps; its rows shift by so much from frame to frame."""
    rng = np.random.default_rng(8)
    lines = ["# made", "v 3.0", f"n 12 {SIZE[1]} {SIZE[0]}"]
    (folder / "images").mkdir(parents=True)

    def frames(name, level):
        for i, frame in enumerate(expose(np.full(SIZE, float(level)), TRUE, rng, 2)):
            shifted = np.clip(np.rint(frame + row_noise * rng.standard_normal((SIZE[0], 1))), 0, 4095)
            file = f"{name}_{i}.png"
            cv2.imwrite(str(folder / "images" / file), shifted.astype(np.uint16))
            lines.append(f"i images\\{file}")

    for step in range(1, 13):
        for kind, level in (("b", TRUE.dark_level + 370 * step), ("d", TRUE.dark_level)):
            lines.append(f"{kind} {1000.0 * step}" + f" {100.0 * step}" * (kind == "b"))
            frames(f"{kind}{step}", level)
    (folder / DESCRIPTION).write_text("\n".join(lines))
    return read(folder)


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    return made(tmp_path_factory.mktemp("set") / "even")


def test_noise_is_found_by_photon_transfer(pairs):
    found = pairs.noise(np.flatnonzero(pairs.used))
    assert found.bits == 12
    assert found.gain == pytest.approx(TRUE.gain, rel=0.02)  # margin: 5 standard errors
    assert found.sigma == pytest.approx(TRUE.sigma, rel=0.01)  # margin: 8 standard errors
    assert found.dark_level == pytest.approx(TRUE.dark_level, abs=0.02)


def test_noise_put_onto_an_image_has_its_levels_variance(pairs):
    steps, rng = np.flatnonzero(pairs.used), np.random.default_rng(2)
    image = np.full((64, 64), TRUE.dark_level)
    image[:, 32:] = 1500.0
    shots = np.array([noisy(image, pairs, steps, TRUE, rng) for _ in range(40)])
    parts = (shots[..., :32], 20.0, TRUE.variance), (shots[..., 32:], 1500.0, TRUE.variance + TRUE.gain * 1480)
    for part, level, wanted in parts:
        assert part.var() == pytest.approx(wanted, rel=0.04)  # margin: of one field and fewer places than pixels
        assert part.mean() == pytest.approx(level, abs=0.5)  # margin: 7 standard errors


def test_row_noise_shows_in_the_field(pairs, tmp_path):
    even, rows = told_of(pairs.dark_fields[0]), told_of(made(tmp_path / "rows", 1.0).dark_fields[0])
    assert 0.6 < even["rows"] < 1.4  # margin: 4.5 standard deviations
    assert rows["rows"] > 10  # a tenth of the variance, over 320 pixels
    assert abs(even["along rows"]) < 0.02
    assert rows["along rows"] > 0.05


def test_variances_under_the_cameras_noise_are_as_predicted(pairs):
    """300 pictures: inside the interval; with 1.6 times the variance they would not be."""
    found = compared(pairs, 300, 3, estimators=("gradient",))["estimators"]["gradient"]
    low, high = found["interval"]
    assert (found["failed"], found["status"]) == (0, "ok")
    assert low / 1.15 < 1 < high * 1.15  # margin: 95 % widened to 3 standard errors
    assert not low < 1.6 < high
