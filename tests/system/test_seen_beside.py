"""What the scene knows of the surroundings of an edge is known to every estimator."""

import pytest

import measure
import planner
import render
from scenes import Floor, Obstacle, Picture, load
from scenes.status import CLUTTER, OK, is_trusted

SENSOR, LIGHT = (30, 215.1), (22.8, 161.5)
LEVELS = render.Quality(supersample=2, samples=1, edge_samples=4, random_samples=4)


@pytest.fixture(scope="module")
def floored():
    """The plate over a floor, an obstacle beside it: its front face gets light from the floor alone, 4 px wide in the
    image, and past its lower edge lies the plate's shadow, ending 11 px from the upper one."""
    return load("plate").with_(
        floor=Floor(reflectance=0.39, height=-2.6), obstacles=[Obstacle(corner=(16.1, 0, 0), size=(1.9, 2.6, 0.3))]
    )


@pytest.mark.parametrize("estimator", ["isophote", "strip"])
def test_a_face_that_only_other_faces_light_is_seen_beside_its_edge(floored, estimator):
    """The hole's distance from the front edge came with ``ok``, 23 and 37 sigma off; now with ``clutter``, and so comes
    whatever is predicted with it."""
    picture = Picture.of(floored, SENSOR, LIGHT)
    predicted = {each.name: each.status for each in planner.predict(picture).measurands}
    found = measure.measure(render.image(picture, quality=LEVELS), picture, estimator=estimator)
    said = dict(zip(found.names, found.status.tolist(), strict=True))
    assert predicted["hole from front"] == CLUTTER
    assert not is_trusted(said["hole from front"])
    assert not [name for name in said if predicted[name] == CLUTTER and is_trusted(said[name])]
    assert said["bore"] == OK


@pytest.mark.parametrize("name", ["bracket", "grey_floor"])
@pytest.mark.parametrize("estimator", ["isophote", "strip"])
def test_bundled_scenes_with_light_between_faces(name, estimator):
    """``ok`` was said of values up to 42 sigma off (grey_floor) and 8 (bracket) where ``clutter`` is predicted."""
    picture = Picture.of(load(name), (42.2, 290.9), (30.6, 102.9))
    predicted = [each.status for each in planner.predict(picture).measurands]
    found = measure.measure(render.image(picture, quality=LEVELS), picture, estimator=estimator).status
    assert CLUTTER in predicted
    assert not any(is_trusted(state) for state, known in zip(found, predicted, strict=True) if known == CLUTTER)


def test_alone_before_darkness_an_isophote_is_ok_where_the_classic_locator_is_disturbed():
    """Negative control: before darkness nothing is seen beside an edge but what it looks at."""
    scene, said = load("wedge"), []
    for setting in scene.settings[:2]:
        picture = Picture.of(scene, setting.sensor, setting.light)
        found = measure.measure(render.image(picture, quality=LEVELS), picture, estimator="isophote").status
        predicted = [each.status for each in planner.predict(picture).measurands]
        said += [is_trusted(state) for state, known in zip(found, predicted, strict=True) if known == CLUTTER]
    assert any(said)
