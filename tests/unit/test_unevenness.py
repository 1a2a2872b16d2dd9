"""What uneven surfaces do to values of any estimator: against renders, and the gradient locator's closed form."""

import numpy as np
import pytest

import measure
import render
import scenes
from imaging.models.texture import texture_errors
from imaging.pictures import Pictures
from measure.unevenness import Unevenness
from scenes import Picture, StatisticalTexture
from validation import simulation
from validation.simulation import corrections

SENSOR, LIGHT = (30, 135), (15, 315)


def _even(picture):
    return picture.with_scene(corrections._without_textures(picture.scene))


def _propagated(picture, estimator):
    clean = render.image(picture, quality=render.Quality(everywhere=True))
    return clean, measure.propagate(clean, picture, estimator=estimator).measurands


@pytest.fixture(scope="module")
def box():
    return Picture.of(scenes.load("printed_label"), SENSOR, LIGHT)


@pytest.mark.render
def test_a_part_looks_as_its_textures_change_the_even_one(box):
    """Pixel by pixel, and by as much the value of an estimator moves that looks at whole faces."""
    even, told = _propagated(_even(box), "arrangement")
    uneven, _ = _propagated(box, "arrangement")
    found = Unevenness.about(box, told.response)
    window = np.zeros(even.shape, bool)
    window[found.window] = True
    changed = uneven - even
    assert window.any()
    assert not found.change[~window].any()
    assert np.std(changed[window]) > 0.5  # margin: there is something to be told: grey levels, of a contrast of 1.5 %
    # margin: renders of textures and of none have other rays along edges
    assert np.std((changed - found.change)[window]) < 0.15 * np.std(changed[window])
    moved = [float((told.response @ each.ravel())[0]) for each in (changed, found.change)]
    assert abs(moved[0]) > 0.5 * np.sqrt(found.variances(told.response)[0])  # margin: this part is an ordinary one
    assert moved[1] == pytest.approx(moved[0], rel=0.05)  # margin: rays; measured 1 %


@pytest.mark.render
def test_the_gradient_locator_scatters_as_its_closed_form_says_and_other_estimators_by_more(box):
    """The closed form has no image, the derivatives no formula of the locator; `arrangement` weighs faces otherwise."""
    known = texture_errors(Pictures.of(box)).variances
    _, told = _propagated(_even(box), "gradient")
    found = Unevenness.about(box, told.response)
    assert found.variances(told.response_image) == pytest.approx(known[0], rel=0.1)  # margin: of lines 2 % off
    assert found.variances(told.response) == pytest.approx(known[1], rel=0.1)  # margin: the same
    _, other = _propagated(_even(box), "arrangement")
    assert found.variances(other.response)[0] > 1.5 * known[1][0]  # margin: 1.97 as rendered, 40 parts


@pytest.mark.render
def test_circles_and_edges_before_uneven_faces_scatter_by_what_is_told():
    """Of a bore in an uneven face the closed form knows nothing: over 30 renders of parts it is as told."""
    plate = scenes.load("plate")
    texture = StatisticalTexture(kind="statistical", where="top", contrast=0.04, correlation=0.3)
    picture = Picture.of(plate, plate.settings[0].sensor, plate.settings[0].light)
    picture = picture.with_scene(plate.tried(textures=(texture,)))
    how = simulation.How(effects="cast_shadow,texture,lens_blur").rough  # each in a fraction of a second
    even = how.image(_even(picture))
    told = measure.propagate(even, _even(picture), estimator="gradient").measurands
    found = Unevenness.about(picture, told.response).variances(told.response)
    assert (found[np.isfinite(np.diag(told.covariance))] > 0).all()
    parts = (picture.with_scene(plate.tried(textures=(texture.tried(seed=i),))) for i in range(30))
    moved = np.array([told.response @ (how.image(each) - even).ravel() for each in parts])
    ratio = moved.var(0, ddof=1) / found
    assert ((ratio > 0.4) & (ratio < 2.1)).all(), ratio  # margin: chance: chi-square of 29, 1e-4 either way


@pytest.mark.render
def test_a_value_that_is_not_there_scatters_by_nothing_that_is_known(box):
    """In a picture without contrast: NaN beside an infinite variance."""
    camera = box.scene.camera
    told = measure.propagate(np.full((camera.height, camera.width), 80.0), box).measurands
    assert np.isinf(told.covariance).all()
    assert np.isnan(told.texture_variance).all()
    assert np.isnan(told.texture_variance_image).all()


def test_without_derivatives_nothing_is_looked_at(box):
    from scipy import sparse

    camera = box.scene.camera
    none = sparse.csr_array((2, camera.width * camera.height))
    found = Unevenness.about(box, none)
    assert found.variances(none).tolist() == [0.0, 0.0]
    assert not found.change.any()


def test_a_print_is_rendered_where_it_is_seen_however_far_from_an_edge(box):
    """An estimator that looks at whole faces was moved by half a standard deviation by a label in a face's middle."""
    scene = box.scene.tried(textures=box.scene.textures[:1])

    def decision(sensor):
        picture = Picture.of(scene, sensor, LIGHT)
        (found,) = (each for each in render.choose(scene, "auto", render.EffectTolerance(), picture).decisions
                    if each.effect.name == "texture")  # fmt: skip
        return found

    assert decision((55, 285)).on
    assert decision((55, 285)).influence.variance > 0.1
    assert not decision((55, 90)).on  # margin: none: the label is behind the box
