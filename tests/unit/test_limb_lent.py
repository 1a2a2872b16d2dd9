"""Bounds of the light that a floor and obstacles send to a limb, at places of their own."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import scenes
from imaging.features.limb_lent import _MOST, unlent
from scenes import Floor, Obstacle

PLACES = np.array([[0.0, 0.0, 5.0], [1.0, -2.0, 3.0], [np.nan] * 3])


def scene(**changes):
    """Matt things of half of the light."""
    ball = scenes.load("ball")
    return ball.model_copy(update={"material": ball.material.tried(diffuse_reflectance=0.5), **changes})


def told(known, normals) -> list[bool]:
    """At the same three places, of which the last is not seen; two pictures of it."""
    outline = SimpleNamespace(points=np.stack([PLACES] * 2), normals=np.stack([np.array(normals, float)] * 2))
    found = unlent(SimpleNamespace(scene=known), outline)
    assert found.shape == (2, 3)
    assert (found[0] == found[1]).all()
    return found[0].tolist()


def slanted(z: float) -> list[float]:
    return [math.sqrt(1 - z * z) * 0.6, math.sqrt(1 - z * z) * 0.8, z]


def test_nothing_lends_where_nothing_is():
    assert told(scene(), [slanted(-0.9), slanted(0.3), [np.nan] * 3]) == [True] * 3


@pytest.mark.parametrize("reflectance", [0.02, 0.4])
def test_a_floor_lends_by_the_part_of_it_that_a_place_faces(reflectance):
    """(1 - n_z) / 2 of what it sends on: the limit's normals, a little below and above."""
    limit = 1 - 2 * _MOST / reflectance
    normals = [slanted(limit + 1e-4), slanted(limit - 1e-4), [np.nan] * 3]
    hidden = reflectance / 2 <= _MOST  # of a place without a normal
    assert told(scene(floor=Floor(reflectance=reflectance)), normals) == [True, False, hidden]


@pytest.mark.parametrize("analyser", [None, 0.0])
def test_an_obstacle_lends_by_the_sine_of_its_highest_corner(analyser):
    """Over the tangent plane; an analyser passes half. Two of them add up."""
    white = 0.5 if analyser is None else 0.25
    known = scene()
    known = known.model_copy(update={"camera": known.camera.model_copy(update={"analyser_deg": analyser})})
    box = Obstacle(corner=(8.0, -1.0, 0.0), size=(1.0, 2.0, 4.0))
    corners = np.array([[x, y, z] for x in (8, 9) for y in (-1, 1) for z in (0, 4)], float)
    sine = math.sqrt(_MOST / white)
    normals = []
    for place, more in zip(PLACES[:2], (-1e-4, 1e-4), strict=True):
        away = (corners - place) / np.linalg.norm(corners - place, axis=1)[:, None]
        low, high = 0.0, math.pi / 2  # a normal that turns from up towards x: the corners rise over its plane
        for _ in range(60):
            angle = (low + high) / 2
            above = (away @ [math.sin(angle), 0, math.cos(angle)]).max() > sine + more
            low, high = (low, angle) if above else (angle, high)
        normals.append([math.sin(low), 0.0, math.cos(low)])
    normals.append([np.nan] * 3)
    assert told(known.model_copy(update={"obstacles": (box,)}), normals) == [True, False, True]
    other = Obstacle(corner=(-9.0, 2.0, 0.0), size=(1.0, 1.0, 20.0))
    assert told(known.model_copy(update={"obstacles": (box, other)}), normals)[:2] == [False, False]
