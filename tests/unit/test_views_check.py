"""Which pictures of a plan of several are rendered for its check, and how often each is measured."""

from types import SimpleNamespace

import numpy as np
import pytest

from render import Quality
from scenes import Pose
from validation import views_check

A, B = (Pose(10, 20), Pose(30, 40)), (Pose(10, 20), Pose(35, 40))


def of(*keys):
    return SimpleNamespace(views=[SimpleNamespace(place=key, picture=key) for key in keys])


def test_each_picture_is_rendered_once_for_the_set_that_has_it_most_often(monkeypatch):
    """Noise of its own for each time; a picture differs by its light alone, too."""
    asked, said = [], []
    monkeypatch.setattr(views_check, "_shot", lambda *given: asked.append(given) or len(asked))
    monkeypatch.setattr(views_check, "_rows", lambda each, shots: [(len(each.views), shots)])
    monkeypatch.setattr(views_check, "judge", lambda told, seconds: told)
    found = SimpleNamespace(model="calibrated", sets=(of(A), of(A, B, A), of(B, A, B, B)))
    told = views_check.check_views(found, 50, 7, "quick", lambda *given: said.append(given))
    counts = {picture: (repeats, images) for picture, repeats, images, _, _ in asked}
    assert counts == {A: (2, 50), B: (3, 50)}
    assert [seed for *_, seed, _ in asked] == [(7, 0), (7, 1)]
    assert [count for count, _ in told] == [1, 3, 4]
    assert set(told[0][1]) == {A, B}
    assert said == [("pictures", 0, 2), ("pictures", 1, 2), ("pictures", 2, 2)]


def test_the_papers_model_is_not_checked():
    found = views_check.check_views(SimpleNamespace(model="paper"))
    assert found == views_check.ViewsCheck((), None, "the paper's model has a free scale", 0.0)


@pytest.mark.parametrize("pixels", [6, 1 << 22])
def test_a_picture_is_measured_in_batches(monkeypatch, pixels):
    """In the order of its noise: repeats of images; two at a time where a picture has half as many pixels as fit."""
    sizes = []
    known = SimpleNamespace(covariance=np.diag([4.0, 9.0]))
    clean = SimpleNamespace(size=pixels)
    picture = SimpleNamespace(scene=SimpleNamespace(noise=None))
    off, renders = SimpleNamespace(bias=np.array([0.5, np.nan])), SimpleNamespace(mean=lambda picture: clean)
    monkeypatch.setattr(views_check.simulation.How, "image", lambda how, picture: clean)
    monkeypatch.setattr(views_check.simulation, "steadied", lambda picture, image, method, how: renders)
    monkeypatch.setattr(views_check.simulation, "independent", lambda picture, methods, renders, told, how: (off,))
    propagated = SimpleNamespace(measurands=known)
    monkeypatch.setattr(views_check.measure, "propagate", lambda clean, picture, estimator: propagated)
    monkeypatch.setattr(views_check.measure, "region_of_interest", lambda picture, estimators: None)
    monkeypatch.setattr(views_check.render, "expose", lambda clean, noise, rng, count, where: count)

    def remeasured(picture, exposures):
        sizes.extend(exposures)
        return (SimpleNamespace(object=np.arange(2.0 * sum(sizes)).reshape(-1, 2)),)

    monkeypatch.setattr(views_check, "remeasured", remeasured)
    found = views_check._shot(picture, 3, 5, (1, 2), Quality())
    assert sizes == ([15] if pixels == 6 else [2] * 7 + [1])
    assert found.values.shape == (3, 5, 2)
    assert found.values[1, 0].tolist() == [9.5, 11.0]  # less what is known of the bias
    assert found.covariance is known.covariance
    assert found.off is off


def test_what_is_taken_off_is_weighted_as_the_values_are():
    """Of one picture twice and another: unsure parts add, the renderer's noise does of one render; by hand."""
    off = {
        A: SimpleNamespace(
            bias=np.array([1.0, np.nan]), u_bias=np.array([0.3, np.inf]), beside=np.array([0.2, np.inf])
        ),
        B: SimpleNamespace(bias=np.array([-2.0, 5.0]), u_bias=np.array([0.7, 0.4]), beside=np.array([0.5, 0.6])),
    }
    used = np.array([[True, False], [True, True], [True, False]])
    weights = np.array([[0.25, 0.0], [0.5, 1.0], [0.25, 0.0]])
    chosen = SimpleNamespace(views=of(A, B, A).views, combination=SimpleNamespace(used=used, weights=weights))
    found = views_check._taken_off(chosen, [SimpleNamespace(off=off[key]) for key in (A, B, A)])
    assert found["correction"] == pytest.approx([0.5 * 1 - 0.5 * 2, 5.0])
    assert found["u_bias"] == pytest.approx([0.5 * 0.3 + 0.5 * 0.7, 0.4])
    assert found["render_noise"] == pytest.approx([np.hypot(0.5 * 0.2, 0.5 * 0.5), 0.6])
