"""The renderer without libLLVM: rays of single fine pixels as a mosaic, the paper's reflectance as textures."""

import sys
from functools import cache, partial

import drjit as dr
import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

import measure
import render
import scenes
from imaging.light.irradiance import bands
from measure.features.layout import layout_of
from measure.features.shape import prepared
from render import build, mosaic, variant
from render.adaptive import crossed
from render.parts import Part
from render.quality import Quality
from scenes import Picture
from tests.oracle import block_image

pytestmark = pytest.mark.render
COMPILED = variant.choose()
PLAIN = frozenset({"attached_shadow", "fall_off", "lens_blur"})


def scalar(scene, setting, quality=Quality(), **options):
    return render.image(scene, setting.sensor, setting.light, quality, variant.SCALAR, **options)


@cache
def loaded(name):
    return scenes.load(name)


@cache
def exact(name, index):
    """Image of a bundled scene's setting without the renderer."""
    scene, setting = loaded(name), loaded(name).settings[index]
    gloss = None if scene.material.is_diffuse else partial(scene.material.reflected, bands(scene))
    return block_image(scene, tuple(setting.sensor), tuple(setting.light), gloss)


def offsets(scene, setting, image):
    """Offset of each fitted line at the middle of its edge, px."""
    tool = prepared(layout_of(Picture.of(scene, setting.sensor)), "gradient", 12.0)
    found = tool.estimate(image[None])
    return (found.level + found.slope * [frame.length / 2 for frame in tool.calipers])[0]


def distance(scene, setting, image):
    return float(measure.distance(image, scene, setting.sensor, setting.light).value_px)


def line_errors(quality):
    """Of four lines of one setting a sensor of Task1, px."""
    scene, found = loaded("task1"), []
    for i in range(1, 16, 4):
        setting = scene.settings[i]
        images = scalar(scene, setting, quality), exact("task1", i)
        found.append(np.subtract(*(offsets(scene, setting, image) for image in images)))
    return np.array(found)


def test_lines_lie_where_the_exact_images_have_them():
    """16 lines: 0.0015 px at most, 0.0005 px rms, no bias; with 9 rays they do not."""
    errors = line_errors(Quality())
    assert np.abs(errors).max() < 0.0015  # margin: chance of 64 rays, the largest of 16
    assert np.sqrt((errors**2).mean()) < 0.0005  # margin: chance of 64 rays; with 9 it is 0.0013
    assert abs(errors.mean()) < 3 * 0.0003 / 4
    # margin: twice the limit of what is right
    assert np.sqrt((line_errors(Quality(edge_samples=9)) ** 2).mean()) > 0.0006


@pytest.mark.parametrize("index", [0, 1])
def test_glossy_faces_and_distances_are_exact(index):
    """Faces within 1e-4 of the brightest, the distance within 0.001 px; a roughness 2 % off is seen."""
    scene, truth = loaded("glossy_metal"), exact("glossy_metal", index)
    quality = Quality(samples=16, edge_samples=256)  # 64 rays leave 0.0013 px of the distance to chance
    setting = scene.settings[index]
    picture, rougher = scalar(scene, setting, quality), scalar(changed(scene, roughness=0.306), setting, quality)
    flat = maximum_filter(truth, 9) - minimum_filter(truth, 9) < 0.05 * truth.max()
    assert (flat & (truth > 30)).sum() > 1000
    worst, control = (np.abs(image - truth)[flat].max() / truth.max() for image in (picture, rougher))
    assert worst < 1e-4 < control
    assert abs(distance(scene, setting, picture) - distance(scene, setting, truth)) < 0.001


def changed(scene, **values):
    return scene.model_copy(update={"material": scene.material.model_copy(update=values)})


@pytest.mark.skipif(COMPILED.startswith("scalar"), reason="no compiled variant to compare with")
@pytest.mark.parametrize("index", [0, 2])
def test_polarised_distance_is_the_compiled_variants(index):
    """Within 0.001 px with as many rays at edges; without the analyser the image is another one."""
    scene = loaded("polarised")
    setting = scene.settings[index]
    quality = Quality(edge_samples=256)
    ours, theirs = (render.image(scene, *poses(setting), quality, name) for name in (variant.SCALAR, COMPILED))
    assert abs(distance(scene, setting, ours) - distance(scene, setting, theirs)) < 0.001
    assert np.abs(ours - theirs).max() < 3e-3 * theirs.max()
    without = scene.model_copy(update={"camera": scene.camera.model_copy(update={"analyser_deg": None})})
    assert np.abs(scalar(without, setting) - theirs).max() > 0.3 * theirs.max()


def poses(setting):
    return setting.sensor, setting.light


def quarter(name, **parts):
    """A scene seen by a quarter of the pixels each way."""
    scene = scenes.load(name)
    parts["camera"] = {"width": 64, "height": 60, "focal_px": scene.camera.focal_px / 4, **parts.get("camera", {})}
    return scene.model_copy(
        update={part: getattr(scene, part).model_copy(update=values) for part, values in parts.items()}
    )


TURNED = {"camera": {"analyser_deg": 60.0}}
CONTROLS = {
    "glossy_metal": ({}, ("material", {"roughness": 0.3003})),
    "polarised": (TURNED, ("camera", {"analyser_deg": 60.1})),
}


@pytest.mark.parametrize("name", CONTROLS)
def test_textures_give_the_image_of_the_interpreted_reflectance(monkeypatch, name):
    """The same rays: 1e-5 of the brightest; a roughness 0.1 % off or an analyser turned by 0.1 degrees is seen."""
    parts, (part, values) = CONTROLS[name]
    scene, quality = quarter(name, **parts), Quality(samples=1, edge_samples=4)
    other = scene.model_copy(update={part: getattr(scene, part).model_copy(update=values)})
    active = PLAIN | {"specular_lobe", "polarisation", "analyser"}
    textured, control = (scalar(one, scene.settings[0], quality, effects=active) for one in (scene, other))
    monkeypatch.setattr(sys.modules["render.fine"], "textured", lambda *arguments: None)
    interpreted = scalar(scene, scene.settings[0], quality, effects=active)
    level = interpreted - scene.noise.dark_level
    inside = (minimum_filter(level, 5) > 1) & (maximum_filter(level, 5) - minimum_filter(level, 5) < 0.2 * level.max())
    assert inside.sum() > 50
    right, wrong = (np.abs(one - interpreted)[inside].max() / level.max() for one in (textured, control))
    assert right < 1e-5 < wrong  # margin: single precision, and a control that is seen
    assert np.abs(textured - interpreted).max() < 0.01 * level.max()  # a ray at an edge may meet the other face


def test_textures_are_used_where_they_can_be(monkeypatch):
    scene, described = quarter("glossy_metal", light={"radius": 0.5}), []
    monkeypatch.setattr(build.bsdf, "describe", lambda *arguments: described.append(1) or {"type": "diffuse"})
    active = PLAIN | {"specular_lobe"}
    scalar(scene, scene.settings[0], Quality(1, 1, 1), effects=active)
    assert not described
    scalar(scene, scene.settings[0], Quality(1, 1, 1), effects=active | {"light_size"})
    assert not described
    scalar(scene, scene.settings[0], Quality(1, 1, 1), effects=active | {"interreflection"})
    assert described


def macro(lens):
    """Tiles of a scene, and an image of an odd number of pixels."""
    scene, mitsuba = scenes.load("macro"), variant.use(variant.SCALAR)
    active, size = PLAIN | ({"depth_of_field"} if lens == "thinlens" else set()), (4 * 256, 4 * 240)
    crop = slice(161, 800), slice(121, 920)
    picture = Picture.of(scene, *poses(scene.settings[0]))
    made = build.description(mitsuba, Part(picture, frozenset(active)), size, crop, 16)
    made = mitsuba.load_dict(made, parallel=False)
    view = build.view(mitsuba, picture, active, size, crop, 16)
    assert view["type"] == lens
    return mosaic.Tiles(mitsuba, made, view, (161, 121)), np.array(mitsuba.render(made, seed=1), float)[:, :, 0]


@pytest.mark.parametrize("side", [1, 8])
@pytest.mark.parametrize("lens", ["perspective", "thinlens"])
def test_a_tile_shows_what_its_place_in_the_frame_shows(monkeypatch, lens, side):
    """Pixels in the middle of faces: 2e-5 of the level, where the next fine pixel is further off, either way."""
    tiles_of, whole = macro(lens)
    monkeypatch.setattr(mosaic, "_SIDES", (side,))
    flat = (maximum_filter(whole, 25) - minimum_filter(whole, 25) < 0.1 * whole.max()) & (whole > 0)
    marked = np.zeros(whole.shape, bool)
    marked[tuple(np.random.default_rng(1).permutation(np.argwhere(flat))[:60].T)] = True
    found = tiles_of.refined(whole.copy(), marked, 256, 1)
    assert ((found != whole) & marked).sum() > 50
    tiles = mosaic._held(marked, side).repeat(side, 0).repeat(side, 1)[:639, :799]
    assert not ((found != whole) & flat & ~tiles).any()
    moved = (whole, np.roll(whole, 1, 0), np.roll(whole, 1, 1))
    right, *wrong = (np.abs(found[marked] / image[marked] - 1).max() for image in moved)
    # margin: single precision against what a fine pixel's step changes: either way by half
    assert right < 2e-5 < min(wrong)


def test_crossed_pixels_that_were_not_marked_are_rendered_as_well():
    """Of an edge's pixels every third is left out: those far from their neighbours' level are found all the same."""
    tiles, fine = macro("perspective")
    marked = crossed(fine)
    some = marked & (np.arange(marked.size).reshape(marked.shape) % 3 > 0)
    assert (some != marked).sum() > 1000
    corrupted = np.where(marked & ~some, 0.0, fine)  # as if their one ray had met the dark
    found, full = (tiles.refined(corrupted.copy(), which, 64, 1) for which in (some, marked))
    bright = full > 0.5 * full.max()
    assert (bright & (corrupted == 0)).sum() > 300
    # margin: 64 rays at an edge: what was dark came back to three quarters
    assert np.abs(found - full)[bright].max() < 0.25 * full.max()
    assert np.abs(corrupted - full)[bright].max() > 0.5 * full.max()  # margin: the order is said


def test_the_image_does_not_depend_on_the_number_of_cores():
    scene, count = quarter("task1"), dr.thread_count()
    try:
        found = []
        for threads in (1, 2, 24):
            dr.set_thread_count(threads)
            found.append(scalar(scene, scene.settings[0]))
    finally:
        dr.set_thread_count(count)
    assert all((image == found[0]).all() for image in found)
    assert (scalar(scene, scene.settings[0], Quality(seed=1)) != found[0]).any()
