"""What effects could do, against the same bounds written out with OpenCV and plain geometry."""

import cv2
import numpy as np
import pytest

import scenes
from imaging.models import variance_model
from imaging.pictures import Pictures
from render.phenomena import EFFECTS
from render.phenomena.base import SAFETY, EffectTolerance, Influence, largest
from render.phenomena.edges import sides
from scenes import Floor, InvalidInput, Jitter, Lens, Noise
from tests.oracle import axes, pinhole

SENSORS = np.array([[30.0, 135.0], [50.0, 60.0]])
LIGHTS = np.array([[15.0, 315.0], [30.0, 200.0]])


def test_distortion_stretches_and_moves(task1):
    """The Jacobian by central differences of OpenCV's projection, at 33 points of each required edge."""
    lens = Lens(distortion=(-0.1, 0.05, 0.004, -0.003, 0.01))
    scene = task1.model_copy(update={"camera": task1.camera.model_copy(update={"lens": lens})})
    camera = scene.camera
    middle = np.array([camera.width - 1, camera.height - 1]) / 2
    matrix = np.array([[camera.focal_px, 0, middle[0]], [0, camera.focal_px, middle[1]], [0, 0, 1.0]])

    def bent(image):
        rays = np.column_stack([(image - middle) / camera.focal_px, np.ones(len(image))])
        return cv2.projectPoints(rays, np.zeros(3), np.zeros(3), matrix, np.array(lens.coefficients))[0][:, 0]

    names = dict.fromkeys(name for corner in (scene.task.start, scene.task.end) for name in corner.edges)
    most = 0.0
    for pose in SENSORS:
        for name in names:
            start, stop = scene.solid.vertices[list(scene.solid.edge(name).ends)]
            image = pinhole(start + np.linspace(0, 1, 33)[:, None] * (stop - start), pose, camera)
            step = 1e-3 * np.eye(2)
            slopes = np.stack([(bent(image + h) - bent(image - h)) / 2e-3 for h in step], -1) - np.eye(2)
            most = max(most, np.sqrt((slopes**2).sum((1, 2))).max())
    found = EFFECTS["lens_distortion"].influence(Pictures.of(scene, SENSORS, LIGHTS))
    assert found.variance == pytest.approx(SAFETY * 6 * most, rel=1e-5)
    assert found.bias_px > 0
    assert EFFECTS["lens_distortion"].absent(Pictures.of(task1, SENSORS, LIGHTS)) == "all coefficients are 0"


def test_a_floor_that_ends_before_the_edges_show_it(task1):
    """Nothing where no required edge has floor behind it, the same as a wide one where all of them have."""
    floor = EFFECTS["floor"]

    def influence(half_side):
        scene = task1.model_copy(update={"floor": Floor(reflectance=0.5, height=-1.0, half_side=half_side)})
        return floor.influence(Pictures.of(scene, SENSORS[:1], LIGHTS[:1]))

    assert influence(1e-6) == (0, 0)
    assert influence(1000.0).variance > 0
    assert influence(100.0) == pytest.approx(influence(1000.0), rel=1e-12)


def test_jitter_of_the_light_alone_moves_no_edge(task1):
    """Only contrasts change: with the square of the angle, and without bias."""
    jitter = EFFECTS["pose_jitter"]

    def influence(sensor, light):
        scene = task1.model_copy(update={"jitter": Jitter(sensor_deg=sensor, light_deg=light)})
        return jitter.influence(Pictures.of(scene, SENSORS[:1], LIGHTS[:1]))

    one, two = influence(0.0, 0.5), influence(0.0, 1.0)
    assert one.bias_px == two.bias_px == 0
    assert two.variance == pytest.approx(4 * one.variance)
    # 1 / cos^2 for tilts of one standard deviation both ways, to second order, up to 60 degrees from the normal
    assert one.variance == pytest.approx(SAFETY * 6 * np.radians(0.5) ** 2)
    assert influence(0.5, 0.5).variance == pytest.approx(influence(0.5, 0.0).variance + one.variance)
    assert jitter.absent(Pictures.of(task1, SENSORS, LIGHTS)) == "poses are exact"


@pytest.mark.parametrize("height", [0.0, -2.0])
def test_interreflection_needs_another_surface(task1, height):
    """A floor of reflectance r under faces of albedo a: proportional to r to first order, and none without."""
    effect = EFFECTS["interreflection"]

    def influence(reflectance):
        scene = task1.model_copy(update={"floor": Floor(reflectance=reflectance, height=height)})
        return effect.influence(Pictures.of(scene, SENSORS[:1], LIGHTS[:1]))

    assert influence(1e-4).variance == pytest.approx(10 * influence(1e-5).variance, rel=1e-2)
    assert effect.absent(Pictures.of(task1, SENSORS, LIGHTS)) is not None
    hollow = scenes.load("bracket")
    assert effect.absent(Pictures.of(hollow, SENSORS, LIGHTS)) is None


@pytest.mark.parametrize("focus", [85.0, 97.0, 120.0])
def test_depth_of_field_widens_the_blur(focus, task1):
    """Marginal rays through 9 points of each required edge: a disc of radius r adds r^2 / 4 to the blur's square."""
    lens = Lens(aperture_radius=0.4, focus=focus)
    scene = task1.model_copy(update={"camera": task1.camera.model_copy(update={"lens": lens})})
    names = dict.fromkeys(name for corner in (scene.task.start, scene.task.end) for name in corner.edges)
    own = scene.locator.scale_px**2 + scene.camera.blur_px**2 + 1 / 12
    most = 0.0
    for pose in SENSORS:
        out = axes(pose)[0]
        for name in names:
            start, stop = scene.solid.vertices[list(scene.solid.edge(name).ends)]
            points = start + np.linspace(0, 1, 9)[:, None] * (stop - start)
            depth = scene.camera.distance - points @ out
            radius = np.abs(lens.aperture_radius * (1 - lens.focus / depth)) / lens.focus * scene.camera.focal_px
            most = max(most, (radius**2 / 4).max())
    effect = EFFECTS["depth_of_field"]
    found = effect.influence(Pictures.of(scene, SENSORS, LIGHTS))
    assert found.variance == pytest.approx(SAFETY * ((1 + most / own) ** 3 - 1), rel=1e-9)
    assert found.bias_px > 0
    inside = task1.model_copy(update={"camera": task1.camera.model_copy(update={"lens": lens, "distance": 8.0})})
    assert effect.influence(Pictures.of(inside, np.array([[60.0, 30.0]]), LIGHTS[:1])).variance == np.inf
    assert effect.absent(Pictures.of(task1, SENSORS, LIGHTS)) == "the aperture is a pinhole"


def test_blur_of_the_lens(task1):
    """A point's variance is as (s^2 + s_e^2)^3."""
    found = EFFECTS["lens_blur"].influence(Pictures.of(task1, SENSORS, LIGHTS))
    own, blur = task1.locator.scale_px**2, task1.camera.blur_px**2 + 1 / 12
    assert found.variance == pytest.approx(SAFETY * ((1 + blur / own) ** 3 - 1), rel=1e-12)


@pytest.mark.parametrize("sigma", [0.5, 3.0])
def test_fixed_pattern_does_not_depend_on_the_noise(sigma, task1):
    """4 standard deviations: those of the value at a noise of 1 grey level, times the pattern's."""
    noise = Noise(sigma=sigma, bits=8, prnu=0.01, dsnu=0.6)
    scene = task1.model_copy(update={"noise": noise})
    plain = task1.model_copy(update={"noise": Noise(sigma=1.0)})
    unit = variance_model("calibrated")(Pictures.of(plain, SENSORS, LIGHTS)).variance.max()
    signals = sides(Pictures.of(plain, SENSORS, LIGHTS)).levels
    pattern = 0.6**2 + (0.01 * signals.max()) ** 2
    found = EFFECTS["fixed_pattern"].influence(Pictures.of(scene, SENSORS, LIGHTS))
    assert found.bias_px == pytest.approx(4 * np.sqrt(unit * pattern), rel=1e-9)
    assert found.variance == 0


def test_what_may_be_left_out():
    """At most the tolerance of both; a tolerance is at least 0 and finite; what is no number is not left out."""
    tolerance = EffectTolerance(0.01, 0.1)
    assert not tolerance.exceeded_by(Influence(0.01, 0.1))
    assert tolerance.exceeded_by(Influence(0.0101, 0.0))
    assert tolerance.exceeded_by(Influence(0.0, 0.101))
    assert EffectTolerance(0.0, 0.0).exceeded_by(Influence(1e-300, 0.0))
    for bad in (-1e-9, float("nan"), float("inf")):
        with pytest.raises(InvalidInput, match="tolerance bias_px must be at least 0"):
            EffectTolerance(bias_px=bad)
        with pytest.raises(InvalidInput, match="tolerance variance must be at least 0"):
            EffectTolerance(variance=bad)
    assert largest(np.array([0.1, 0.3]), np.array([0.2, 0.1])) == (SAFETY * 0.3, SAFETY * 0.2)
    assert largest(np.array([0.1, np.nan]), np.array([np.inf, 0.1])) == (np.inf, np.inf)
