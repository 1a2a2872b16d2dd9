"""Light of pictures that are compared, by the image model instead of the renderer's rays: `render.modelled`."""

from dataclasses import replace

import numpy as np
import pytest

import render
import scenes
from imaging.light.behind import Met
from imaging.models.inputs import of_other_surfaces
from render import modelled
from render.surroundings import near_required
from scenes import Picture, Pose

FEW = render.Quality(supersample=2, samples=1, edge_samples=16, everywhere=False, alike=True)
DIRECT = ("attached_shadow", "cast_shadow", "fall_off")


def picture(name, setting):
    scene = scenes.load(name)
    each = scene.settings[setting]
    return Picture.of(scene, each.sensor, each.light)


def direct(shown):
    return render.image(shown, quality=FEW, variant="scalar_rgb", effects=DIRECT)


def grid(pixels, samples):
    """Places in fine pixels by rows and columns."""
    side = round(samples**0.5)
    return np.broadcast_to((np.indices((side, side)).reshape(2, -1).T + 0.5) / side, (len(pixels), samples, 2))


def by_rays(shown, monkeypatch):
    """The same by the renderer's rays."""
    with monkeypatch.context() as changed:
        changed.setattr(modelled.Modelled, "of", lambda *_: None)
        return direct(shown)


@pytest.mark.parametrize(("name", "setting"), [("bracket", 0), ("grey_floor", 0), ("plate", 0), ("two_lights", 0)])
def test_the_image_model_draws_direct_light_as_rays_do(name, setting, monkeypatch):
    """Where something is measured: hidden edges, cast shadows, a floor, round walls, two lights."""
    here = picture(name, setting)
    camera = here.scene.camera
    near = near_required(here, (slice(0, camera.height), slice(0, camera.width)), 1, 0.0)
    monkeypatch.setattr(modelled, "within", grid)  # where the renderer's rays go that are compared
    rendered, told = by_rays(here, monkeypatch)[near], direct(here)[near]
    assert np.ptp(rendered) > 20  # margin: seen and lit, and beside an edge: levels
    assert np.sqrt(np.square(told - rendered).mean()) < 0.13  # measured: 0.062 on `bracket`, 0.008 elsewhere
    assert told == pytest.approx(rendered, abs=2.0)  # measured: 0.96 on `bracket`, 0.13 elsewhere
    assert abs(np.median(told - rendered)) < 1e-5  # single precision: 6e-7


@pytest.mark.parametrize(("name", "setting"), [("bracket", 0), ("grey_floor", 2), ("bracket_mm", 0)])
def test_patches_tell_what_faces_send_to_each_other_as_random_rays_do(name, setting, monkeypatch):
    """Beside inner edges, on a floor in a part's shadow, in bores: in all, and what is left of darker faces."""
    here = picture(name, setting)
    here = here.with_scene(here.scene.tried(camera=_smaller(here.scene.camera)))
    camera, dimmed = here.scene.camera, next(of_other_surfaces(here))
    near = near_required(here, (slice(0, camera.height), slice(0, camera.width)), 1, 2.0)

    def between(shown):
        with_it = render.image(shown, quality=replace(FEW, random_samples=64), variant="scalar_rgb")
        return (with_it - direct(shown))[near].mean()

    told, left = between(here), between(dimmed)
    with monkeypatch.context() as changed:
        changed.setattr(modelled.Modelled, "tells_between", False)
        by_rays, less = between(here), between(dimmed)
    assert by_rays > 1.0  # levels; margin: there is some
    assert told == pytest.approx(by_rays, rel=0.1)  # measured: 0.034 on `grey_floor`, 0.017 elsewhere
    assert left / told == pytest.approx(less / by_rays, abs=0.01)


def _smaller(camera):
    """As a camera of fewer pixels sees it: the same, if it has few."""
    part = min(1.0, 320 / camera.width)
    return camera.tried(
        width=round(part * camera.width), height=round(part * camera.height), focal_px=part * camera.focal_px
    )


def test_rays_that_pictures_share_are_traced_once(monkeypatch):
    """A light elsewhere has other shadows: of its rays only those of fine pixels that were not looked at before."""
    here, asked = picture("grey_floor", 0), []
    traced = modelled.View.met

    def met(view, pixels, samples):
        asked.append((samples, set(pixels.tolist())))
        return traced(view, pixels, samples)

    monkeypatch.setattr(modelled.View, "met", met)
    modelled.forget()
    first = direct(here)
    count = len(asked)
    polar, azimuth = here.lights[0]
    other = direct(replace(here, lights=(Pose(polar + 1.0, azimuth),)))
    assert np.abs(other - first).max() > 1.0
    for k, (samples, pixels) in enumerate(asked):
        assert not any(pixels & before for many, before in asked[:k] if many == samples)
    assert sum(len(pixels) for _, pixels in asked[count:]) < 0.2 * sum(len(pixels) for _, pixels in asked[:count])
    modelled.forget()
    assert np.array_equal(direct(replace(here, lights=(Pose(polar + 1.0, azimuth),))), other)


def test_what_rays_met_is_found_again_by_the_numbers_of_pixels():
    class Numbers:
        def met(self, pixels, samples):
            faces = (10 * pixels[:, None] + np.arange(samples)).ravel()
            return Met(faces, np.repeat(faces[:, None], 3, 1))

    looked = modelled.Looked(Numbers())
    for pixels in ([2, 5, 9], [2, 5, 9], [1, 5, 7, 12], [9], [1, 2, 5, 7, 9, 12]):
        faces, points = looked.met(np.array(pixels), 4)
        assert faces.tolist() == [10 * pixel + k for pixel in pixels for k in range(4)]
        assert (points == faces[:, None]).all()


@pytest.mark.parametrize("samples", [1, 4, 9, 16, 64])
@pytest.mark.parametrize("along", [0, 1])
def test_an_edge_along_the_pixels_is_not_put_off_by_where_rays_go(along, samples):
    """A half plane whose border is parallel to rows or columns: of 400 fine pixels the part of rays that meet it is its
    area; that of a grid's, the same in all pixels, is up to half of the grid's distance off."""
    row = 3 * 977 + np.arange(400)
    places = modelled.within(row if along == 0 else 977 * np.arange(400), samples)
    assert places.shape == (400, samples, 2)
    assert (places >= 0).all()
    assert (places < 1).all()
    borders, side = np.linspace(0.03, 0.97, 48), round(samples**0.5)
    met = np.array([(places[:, :, along] < border).mean() for border in borders])
    grid = (np.arange(side) + 0.5) / side
    apart = np.abs([(grid < border).mean() - border for border in borders]).max()
    assert apart > 0.4 / side  # the control
    assert np.abs(met - borders).max() < 0.02 / side  # measured: 0.0075 of one ray


@pytest.mark.parametrize("name", ["shaft", "printed_label", "board_block", "ring_light"])
def test_what_the_image_model_does_not_tell_point_by_point_is_rendered(name):
    """Round walls, print, a board, a light of some size."""
    here = picture(name, 0)
    assert modelled.Modelled.of(here, 2, (0, 0), 2 * here.scene.camera.width) is None
