"""Faces that are not convex, and faces with holes, are rendered as they are."""

import numpy as np
import pytest

import render
import scenes
from imaging.geometry.projection import project

pytestmark = pytest.mark.render


def levels(scene, sensor, light, points):
    """Grey levels above darkness of the pixels that look at points."""
    x, y = np.rint(project(np.array(points), np.array(sensor, float), scene.camera)).astype(int).T
    return render.image(scene, sensor, light, render.Quality(1, 1, 1, 1))[y, x] - scene.noise.dark_level


def test_one_looks_through_the_plates_hole():
    plate = scenes.load("plate")
    circle = plate.solid.circle("c2")
    rim = circle.centre + 1.3 * circle.radius * np.array([1.0, 0, 0])
    hole, beside = levels(plate, (0, 0), (20, 0), [circle.centre, rim])
    assert hole == 0
    assert beside > 50


def test_the_notch_of_the_bracket_is_empty():
    bracket = scenes.load("bracket")
    profile = bracket.solid.vertices[:, [0, 2]]
    foot, upright = [profile[:, 0].max() - 1, 0, 0.7], [0.7, 0, profile[:, 1].max() - 1]
    notch = [upright[0] + 2.0, 0, 4.0]
    dark, *lit = levels(bracket, (80, 270), (70, 270), [notch, foot, upright])
    assert dark == 0
    assert min(lit) > 50  # margin: lit is 168, dark is 0


def test_a_hollow_body_is_known_to_shade_itself():
    on = {decision.effect.name: decision for decision in render.effects(scenes.load("bracket"))}
    assert on["cast_shadow"].on
    assert on["interreflection"].on
    convex = {decision.effect.name: decision for decision in render.effects(scenes.load("wedge"))}
    assert not convex["cast_shadow"].on
    assert tuple(convex["interreflection"].influence) == (0, 0)
