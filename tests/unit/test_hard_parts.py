"""The references of the hard cases: a point's place and its camera, against the planner's own projection."""

from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from matplotlib.figure import Figure

import planner
from imaging.geometry.projection import project_ideal
from scenes import Pose
from scenes.parts.surfaces import Cylinder, Quadric, Sphere, Torus
from validation.hard import limb_cases, precise, precise_models, render_cases
from validation.hard.case import Answer, run
from validation.report import precision_figure

SENSOR, LIGHT = (37.0, 112.0), (21.0, 301.0)


def test_a_point_is_imaged_from_the_cameras_distance(task1):
    """Not from the light's, which is another one; px from the image's middle."""
    camera = task1.camera.model_copy(update={"distance": 83.0})
    inputs = precise.Inputs.of(task1.model_copy(update={"camera": camera}), SENSOR, LIGHT)
    middle = (np.array([camera.width, camera.height]) - 1) / 2
    seen = project_ideal(task1.solid.vertices, np.array(SENSOR), camera) - middle
    found = [[float(x) for x in precise.image_of(v, inputs, precise.mpf(camera.focal_px))] for v in inputs.vertices]
    assert np.array(found) == pytest.approx(seen, rel=1e-9, abs=1e-9)
    assert [float(x) for x in inputs.distances] == [83.0, 100.0]
    assert Pose(*map(float, inputs.sensor)) == Pose(*SENSOR)


@pytest.mark.parametrize(("camera", "light"), [(83.0, 61.0), (61.0, 140.0)])
def test_sensor_and_light_stand_at_their_own_distances(task1, camera, light):
    """The paper's model at 50 digits and the planner's, where the two are not as far away."""
    told = task1.model_dump()
    scene = task1.with_(camera={**told["camera"], "distance": camera}, light={"distance": light})
    exact = precise_models.paper(scene, precise.Inputs.of(scene, SENSOR, LIGHT))
    assert planner.predict(scene, SENSOR, LIGHT, "paper").variance_px2 == pytest.approx(float(exact), rel=1e-9)


def test_the_poses_that_are_held_are_those_of_the_titles():
    """Of the figure about single precision: one moves, the other is held where its panel says."""
    asked, drawn = [], []

    def error(scene, sensors, lights):
        asked.append((sensors, lights))
        return np.full(len(sensors), 1e-7)

    keep = mock.patch.object(Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    with keep, mock.patch.object(precision_figure, "error_of_single", error):
        precision_figure.draw(Path("x.png"), 30.0)
    (sensors, held), (still, lights) = asked
    assert np.unique(held, axis=0).tolist() == [[15.0, 315.0]]
    assert np.unique(still, axis=0).tolist() == [[30.0, 135.0]]
    assert sensors.tolist() == lights.tolist() == precision_figure.ViewingSpace(30.0, (0, 90)).poses.tolist()
    titles = [axes.get_title() for axes in drawn[0].axes[:2]]
    assert [title.split("\n")[0] for title in titles] == [
        "sensor moves, light (15, 315)", "light moves, sensor (30, 135)"
    ]  # fmt: skip


def test_contrast_is_low_where_the_planner_says_so(task1):
    """Below five sigma of an edge's root mean square contrast: the same noise divides the reference's answers."""

    def noisy(sigma):
        return task1.model_copy(update={"noise": task1.noise.model_copy(update={"sigma": sigma, "bits": None})})

    def is_low(sigma):
        return planner.predict(noisy(sigma), SENSOR, LIGHT).status == "low_contrast"

    low, high = 0.01, 1000.0
    assert is_low(high)
    assert not is_low(low)
    while high / low > 1.001:
        middle = np.sqrt(low * high)
        low, high = (low, middle) if is_low(middle) else (middle, high)
    answers = []
    for sigma in (0.99 * low, 1.01 * high):  # the reference's rule is of 8 nodes here
        inputs = precise.Inputs.of(noisy(sigma), SENSOR, LIGHT)
        answers.append(precise_models.calibrated(noisy(sigma), inputs, adaptive=False))
    assert answers[1] == "low_contrast"
    assert float(answers[0]) == pytest.approx(planner.predict(noisy(0.99 * low), SENSOR, LIGHT).variance_px2, rel=1e-3)


def test_conditions_in_closed_form():
    """Sum of |x df/dx| / |f|: the exponents of a product; what is zero has no part in it."""
    inputs = precise.Inputs(*((precise.mpf(a), precise.mpf(b)) for a, b in ((3, 0), (5, 7), (11, 13))), ((1, 2, 3),))

    def product(at):
        return at.sensor[0] ** 3 / at.light[1] * at.distances[0] ** 2 * precise.mpf(at.vertices[0][2])

    assert precise.condition(product, inputs) == pytest.approx(3 + 1 + 2 + 1, rel=1e-9)
    assert precise.condition(lambda at: "not_visible", inputs) == np.inf
    assert precise.condition(lambda at: precise.mpf(0), inputs) == np.inf
    numbers = [precise.mpf(2), precise.mpf(0), precise.mpf(3)]
    assert precise.condition_of(lambda x: x[0] ** 4 / x[2] + x[1], numbers) == pytest.approx(5, rel=1e-9)
    told = precise.reference(lambda x: x[0] ** 2 * x[1], [1.5, 2.0])
    assert (told.value, told.condition) == (4.5, pytest.approx(3, rel=1e-9))


def test_limbs_that_are_round_are_of_balls():
    """By all of two coordinates; of a rod and a torus, and of a rod as an equation, across alone."""
    axis = np.array([1.0, 0.0, 0.0])
    rod = Quadric(np.diag([0.0, 1, 1]), (0, 0, 0), -4.0)
    assert limb_cases._is_ball(Sphere(np.zeros(3), 2.0))
    assert limb_cases._is_ball(Quadric(np.eye(3), (0, 0, 0), -4.0))
    others = (rod, Cylinder(np.zeros(3), axis, 2.0, (-1, 1)), Torus(np.zeros(3), axis, 2.0, 0.5))
    assert not any(map(limb_cases._is_ball, others))


def test_levels_are_judged_to_a_few_thousandths():
    """One per mille off is right, half a per cent is not."""
    found = [case for case in render_cases.cases() if case.measurand == "grey level"]
    assert len(found) == 2
    for case in found:
        exact = case.reference().value
        told = [
            run(replace(case, ours=lambda f=f, exact=exact: Answer(exact * f))).verdict for f in (0.999, 1.001, 1.005)
        ]
        assert told == ["right", "right", "WRONG"]
