"""The spectral sum of eq. 1 by the trapezium rule, written out interval by interval."""

import numpy as np
import pytest

import scenes
from imaging.light.emitters import Emitter
from imaging.light.irradiance import bands, beam, electric_field, squared_distance
from scenes import Light, Material
from tests.oracle import axes


def shares(wavelengths, *curves):
    """Half of each interval belongs to each of its ends."""
    width = np.zeros(len(wavelengths))
    for i in range(len(wavelengths) - 1):
        width[i : i + 2] += (wavelengths[i + 1] - wavelengths[i]) / 2
    for curve in curves:
        width *= np.interp(wavelengths, *np.array(curve).T)
    return width / width.sum()


@pytest.mark.parametrize("wavelengths", [(500.0, 600.0), (450.0, 500.0, 620.0), (400.0, 410.0, 500.0, 700.0)])
@pytest.mark.parametrize("weighted", [False, True])
def test_shares(task1, wavelengths, weighted):
    table = tuple((w, 1.2 + w / 1000, 0.1 * i) for i, w in enumerate(wavelengths))
    curves = ((400.0, 0.2), (700.0, 1.0)), ((400.0, 1.0), (550.0, 0.4), (700.0, 0.9)), ((400.0, 0.5), (700.0, 0.7))
    scene = task1.model_copy(update={"material": Material(
        specular_fraction=0.5, diffuse_reflectance=0.5, roughness=0.3, index_table=table)})  # fmt: skip
    if weighted:
        camera = scene.camera.model_copy(update={"transmission": curves[0], "responsivity": curves[1]})
        light = scene.light.model_copy(update={"spectrum": curves[2]})
        scene = scene.model_copy(update={"camera": camera, "light": light})
    found = bands(scene)
    assert [(band.n, band.k) for band in found] == [row[1:] for row in table]
    assert [band.share for band in found] == pytest.approx(shares(wavelengths, *(curves if weighted else ())))


def test_one_band_without_a_table(task1):
    (band,) = bands(task1)
    assert (band.n, band.k, band.share) == (task1.material.refractive_index, task1.material.extinction, 1.0)


def test_beams_fall_off_with_the_square(rng):
    at, points = np.array([10.0, -20.0, 60.0]), rng.uniform(-5, 5, (7, 3))
    emitter = Emitter(Light(distance=50.0), 0, at, None, 2500.0, 50.0)
    found = beam(emitter, points)
    for point, to_light, strength in zip(points, found.to_light, found.strength, strict=True):
        away = np.sqrt(sum((a - p) ** 2 for a, p in zip(at, point, strict=True)))
        assert to_light * away == pytest.approx(at - point)
        assert strength == pytest.approx(2500 / away**2)
    assert beam(emitter, points, fall_off=False).strength == 1.0


def test_squared_distance_along_segments(rng):
    starts, stops, lights = (rng.uniform(-9, 9, (n, 3)) for n in (4, 4, 3))
    fractions = rng.uniform(0, 1, 5)
    found = squared_distance(starts, stops, fractions, lights)
    for i, j, k in np.ndindex(3, 4, 5):
        point = starts[j] + fractions[k] * (stops[j] - starts[j])
        assert found[i, j, k] == pytest.approx(((lights[i] - point) ** 2).sum())


@pytest.mark.parametrize("pose", [(20, 50), (90, 200), (140, 300)])
@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0])
def test_electric_field(pose, angle):
    """From the pole's side down the sphere (0 degrees) towards growing azimuth (90)."""
    out, right, down = axes(pose)
    expected = np.cos(np.radians(angle)) * down + np.sin(np.radians(angle)) * right
    assert electric_field(3 * out, angle) == pytest.approx(expected, abs=1e-12)
    assert electric_field(np.array([0.0, 0.0, 2.0]), angle) == pytest.approx(
        [np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0], abs=1e-12
    )


def test_scene_without_a_light_of_its_own_spectrum(task1):
    assert scenes.load("task1").light.spectrum == ()
    assert len(bands(task1, Light(distance=1.0, spectrum=((400.0, 1.0), (700.0, 2.0))))) == 1
