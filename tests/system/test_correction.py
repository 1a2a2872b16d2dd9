"""A bias that is simulated and taken off, against exact images that share nothing with the renderer."""

import dataclasses
import json
import math

import numpy as np
import pytest
from scipy import sparse

import measure
import planner
import render
from imaging.models import inputs
from measure import Images
from scenes import Floor, ImageTexture, InvalidInput, Picture, Pose, load
from scenes.status import corrected
from tests.oracle import block_image
from validation import kept, picture_file, simulation
from validation.remeasured import Method
from validation.report import budget_table
from validation.simulation import corrections

ESTIMATORS = ("gradient", "isophote", "canny", "strip", "arrangement")


CROWDED = ((39.6, 185.1), (30.8, 89.1)), ((29.0, 24.7), (10.5, 47.9)), ((33.6, 342.3), (16.6, 290.2))
"""The first random poses at which the classic locator is off by 0.5 sigma or more, and all estimators measure."""


@pytest.fixture(scope="module")
def crowded(small_task1):
    """(picture, exact image, other renders) there."""
    found = []
    for sensor, light in CROWDED:
        picture = Picture.of(small_task1, sensor, light)
        exact = block_image(small_task1, sensor, light)
        told = measure.propagate(exact, picture).measurands
        assert abs(told.bias[0]) > 0.5 * np.sqrt(told.covariance[0, 0])
        renders = tuple(render.image(picture, quality=render.Quality(seed=seed)) for seed in (1, 2))
        found.append((picture, exact, renders))
    return found


@pytest.mark.render
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_what_is_left_of_an_exact_image_is_what_it_is_told_with(crowded, estimator):
    """By every estimator; the correction's own noise is all that is left, and half or twice of it leaves more."""
    left, raw, told = [], [], []
    for picture, exact, renders in crowded:
        off = measure.correction(Images(renders), picture, estimator)
        found = measure.measure(exact, picture, correction=off)
        true = _length(picture)
        left.append((found.value[0] - true) / off.sigma[0])
        raw.append(off.bias[0] / off.sigma[0])
        told.append(off.u_bias[0] / off.sigma[0])
    left, raw, told = map(np.array, (left, raw, told))
    assert np.abs(left).max() < 0.15  # margin: half of what `ok` allows, five times the renders' noise
    if estimator in ("gradient", "canny"):
        assert np.abs(raw).max() > 0.5
        assert np.abs(left + raw / 2).max() > 0.25  # a correction of half, or of twice as much, is seen
    assert told.max() < 0.2  # margin: the renders' noise, 0.03 to 0.06 of sigma, by chance


def _length(picture):
    """The true distance of the task's two corners, from the block's own vertices."""
    task, solid = picture.scene.task, picture.scene.solid
    ends = [solid.vertices[solid.vertex_names.index(corner.vertex)] for corner in (task.start, task.end)]
    return float(np.linalg.norm(ends[1] - ends[0]))


@pytest.mark.render
def test_a_value_is_decided_only_once_its_bias_is_off(crowded):
    """`clutter` is undecided; corrected it passes, its status ok; with a doubt beyond noise and tolerance it stays."""
    picture, exact, renders = crowded[0]
    plain = measure.measure(exact, picture, estimator="gradient")
    assert plain.status.tolist() == ["clutter"]
    assert plain.bias.tolist() == [0.0]
    assert np.isnan([plain.u_bias, plain.u]).all()
    off = measure.correction(Images(renders), picture)
    found = measure.measure(exact, picture, correction=off)
    assert found.status.tolist() == ["ok"]
    assert found.u == pytest.approx(np.sqrt(found.sigma**2 + off.u_bias**2))
    assert found.first.value_px == pytest.approx(plain.first.value_px - off.bias_image[0])
    doubtful = Images(renders, known={"light_place": (2 * off.sigma, 2 * off.sigma)})
    found = measure.measure(exact, picture, correction=measure.correction(doubtful, picture))
    assert found.status.tolist() == ["clutter"]
    assert found.u_bias == pytest.approx(np.hypot(2 * off.sigma, off.u_bias))


@pytest.mark.render
def test_each_source_counts_by_what_it_moves(small_task1, crowded):
    """Two images of other parts' poses as changed inputs: the root sum square of what they move the value by."""
    picture, exact, renders = crowded[0]
    moved = []
    for polar in (0.02, -0.05):
        sensor = Pose(picture.sensor.polar_deg + polar, picture.sensor.azimuth_deg)
        moved.append(block_image(small_task1, sensor, picture.lights[0]))
    values = [measure.measure(image, picture, estimator="gradient").value[0] for image in (exact, *moved)]
    changed = sparse.csr_array(np.reshape(moved, (2, -1)) - exact.ravel())
    off = measure.correction(Images((exact, renders[1]), {"pose": changed}), picture)
    expected = np.sqrt((values[1] - values[0]) ** 2 + (values[2] - values[0]) ** 2)
    assert off.sources["pose"] == pytest.approx(expected, rel=1e-6)
    assert off.u_bias[0] ** 2 == pytest.approx(expected**2 + off.sources["rendering"][0] ** 2)


def test_one_rule_for_statuses():
    """Small beside the noise or the tolerance; what is not measured in the simulation is not measured."""
    assert corrected("ok", "ok", 0.9, 1.0) == "ok"
    assert corrected("ok", "ok", 1.1, 1.0) == "clutter"
    assert corrected("clutter", "ok", 1.1, 1.0, 5.0) == "clutter"
    assert corrected("clutter", "ok", 1.1, 1.0, 6.0) == "ok"
    assert corrected("ok", "ok", float("inf"), 1.0, 1e9) == "clutter"
    assert corrected("ok", "ok", float("nan"), 1.0, 1e9) == "clutter"
    assert corrected("clutter", "ambiguous", 0.0, 1.0) == "ambiguous"
    assert corrected("compressed", "ok", 0.0, 1.0) == "compressed"
    assert corrected("not_visible", "ok", 0.0, 1.0) == "not_visible"


def test_bad_input_is_one_line(small_task1):
    known, unknown = Picture.of(small_task1, (30, 90), (15, 270)), Picture.of(small_task1, (30, 90))
    image = np.zeros((90, 96))
    with pytest.raises(InvalidInput, match="renders must be at least one noise-free image, got none"):
        measure.correction(Images(()), known)
    with pytest.raises(InvalidInput, match="light must be a pose to correct the bias, got nothing"):
        measure.correction(Images((image,)), unknown)
    with pytest.raises(InvalidInput, match=r"changed\['pose'\] must have 8640 columns, a pixel each, got \(2, 4\)"):
        measure.correction(Images((image, image), {"pose": sparse.csr_array((2, 4))}), known)


@pytest.mark.render
def test_a_correction_must_be_of_what_is_measured(crowded):
    picture, exact, renders = crowded[0]
    off = measure.correction(Images(renders), picture)
    with pytest.raises(InvalidInput, match="estimator must be that of the correction, gradient, got strip"):
        measure.measure(exact, picture, estimator="strip", correction=off)


@pytest.mark.render
def test_the_simulation_is_kept(small_task1, tmp_path, monkeypatch):
    """The second time it is read; a file that is damaged, or of another scene, is not."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    picture, method, made = Picture.of(small_task1, (30, 90), (15, 270)), Method("gradient"), []
    simulate = simulation.simulated
    monkeypatch.setattr(simulation, "simulated", lambda *given: made.append(given) or simulate(*given))
    first, second = (kept.correction(picture, method) for _ in range(2))
    assert len(made) == 1
    for name in ("bias", "bias_image", "covariance", "covariance_image", "u_bias", "u_bias_image"):
        assert getattr(second, name) == pytest.approx(getattr(first, name), rel=1e-15)
    assert second.status == first.status
    (file,) = tmp_path.rglob("*.json")
    whole = json.loads(file.read_text())
    for text in ("", "{", json.dumps(whole | {"bias": [1.0, 2.0]}), json.dumps(whole | {"simulated": ["fine"]})):
        file.write_text(text)
        kept.correction(picture, method)
    assert len(made) == 5
    brighter = picture.with_scene(small_task1.model_copy(update={"noise": small_task1.noise.tried(sigma=9.0)}))
    kept.correction(brighter, method)
    assert len(made) == 6
    assert len(list(tmp_path.rglob("*.json"))) == 2


def test_a_picture_on_the_part_that_has_changed_is_another_scene(task1, tmp_path):
    """At the same path; the same picture written once more is not."""
    place = {"origin": (3.0, 5.5, 2.5), "direction": (1, 0, 0), "width": 6.0, "height": 3.0}
    named = []
    for level in (10.0, 10.0, 12.0):
        picture_file.write(tmp_path / "a.png", np.full((8, 16), level))
        label = ImageTexture(kind="image", face="top", file=tmp_path / "a.png", **place)
        scene = task1.model_copy(update={"textures": (label,)})
        named.append(kept._digest(Picture.of(scene, (30, 90), (15, 270)), Method("gradient"), simulation.How()))
    assert named[0] == named[1] != named[2]


def test_what_is_not_signed_says_how_large_the_bias_may_be(small_task1):
    """Two of 0.03 and 0.04 cm make 0.05, twice that is 0.1; without them, or with one of any size, it is unknown."""
    picture = Picture.of(small_task1, (30, 90), (15, 270))
    doubts = {"reflectance": np.array([0.03]), "light_place": np.array([0.04])}
    found = planner.budget(picture, variances=np.array([1e-8]), doubts=doubts, statuses=("clutter",))
    assert found.u_bias == (pytest.approx(0.05),)
    assert found.measurands[0].u == pytest.approx(np.hypot(0.05, 1e-4))
    assert budget_table.signed(found, 0) == "The distance is not signed: clutter, bias up to 0.1 cm"
    plain = planner.budget(picture, statuses=("clutter",))
    unknown = planner.budget(picture, doubts={**doubts, "texture": np.array([np.inf])}, statuses=("clutter",))
    for each in (plain, unknown):
        assert budget_table.signed(each, 0) == "The distance is not signed: clutter, bias unknown"
    assert unknown.u_bias == (np.inf,)
    assert plain.u_bias[0] == next(
        r.contribution for r in plain.measurands[0].contributions if r.source == "model error"
    )
    with pytest.raises(InvalidInput, match=r"doubts.'light_place'. must be one at least 0 for each measurand, got"):
        planner.budget(picture, doubts={"light_place": np.array([-1.0])})


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_lights_stand_a_step_beside(way):
    """Both directions are a degree away and across each other, at the pole, too (spherical cosine rule by hand)."""
    for pose in (Pose(40, 30), Pose(0, 10), Pose(180, 0), Pose(179.9, 300)):
        places = [_unit(each) for each in (pose, *inputs._beside(pose, way * math.radians(1.0)))]
        here, along, across = places
        for other in (along, across):
            assert np.degrees(np.arccos(np.clip(here @ other, -1, 1))) == pytest.approx(1.0, rel=0.02)
        assert abs((along - here) @ (across - here)) < 0.02 * np.radians(1.0) ** 2


def _unit(pose):
    polar, azimuth = np.radians([pose.polar_deg, pose.azimuth_deg])
    return np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])


def test_the_renders_noise_is_told_by_all_lines(small_task1):
    """Images that are noisier copies of one: r times the camera's noise on each pixel is r sigma of each value."""
    picture = Picture.of(small_task1, (30, 90), (15, 270))
    exact, rng, share = (
        block_image(small_task1, *map(list, (picture.sensor, picture.lights[0]))),
        np.random.default_rng(3),
        0.25,
    )
    sigma = share * small_task1.noise.sigma
    told = []
    for _ in range(20):
        renders = tuple(exact + sigma * rng.normal(size=exact.shape) for _ in range(3))
        off = measure.correction(Images(renders), picture)
        sigma_image = np.sqrt(off.covariance_image[0, 0])
        told.append((off.sources["rendering"][0] / off.sigma[0], off.sources_image["rendering"][0] / sigma_image))
    told = np.sqrt(3) * np.array(told)
    # margin: 20 x 16 independent numbers tell it to 4 %, and no less than the value's own scatter counts
    assert np.median(told, axis=0) == pytest.approx([share, share], rel=0.25)
    assert told.min() > share / 2  # margin: no less than what all lines tell, to 4 %


def test_light_from_the_floor_is_part_of_the_contrast():
    """Of a picture of grey_floor the predicted sigma is that of a render; 8 % too small without that light."""
    scene = load("grey_floor")
    picture = Picture.of(scene, scene.settings[0].sensor, scene.settings[0].light)
    told = measure.propagate(simulation.How().rough.image(picture), picture).measurands
    ratio = np.sqrt(planner.predict(picture).measurands[0].variance_object / told.covariance[0, 0])
    assert abs(ratio - 1) < 0.045  # margin: 0.02 with, 0.08 without; what walls send to the floor is in no formula


@pytest.mark.parametrize(
    ("rough", "fine", "tolerance", "renders", "few", "all_"),
    [(0.02, 0.0, None, 4, 4, 0), (3.0, 0.02, None, 3, 4, 3), (3.0, 3.0, None, 6, 4, 6), (3.0, 3.0, 3.0, 4, 4, 0)],
)
def test_rays_are_added_until_their_noise_does_not_matter(
    small_task1, monkeypatch, rough, fine, tolerance, renders, few, all_
):
    """Exact images with noise in the place of the renderer's: four of few rays do, or three of all, or six at most.

    A tolerance of which the noise is less than a hundredth needs no more.
    """
    ends = [corner.model_dump(mode="json") for corner in (small_task1.task.start, small_task1.task.end)]
    length = {"name": "length", "kind": "distance", "features": ends, "tolerance": tolerance}
    scene = small_task1.with_(task=None, measurands=[length], floor=Floor(reflectance=0.2, height=-3.0))
    picture, asked = Picture.of(scene, (30, 90), (15, 270)), []
    exact = block_image(small_task1, Pose(30, 90), Pose(15, 270))

    def made(how, of, effects, seed):
        is_rough = how.quality.random_samples is not None
        if of == picture and effects == "auto" and not how.quality.alike:
            asked.append(is_rough)
        noise = np.random.default_rng((seed, is_rough)).normal(size=exact.shape)
        return exact + (rough if is_rough else fine) * noise

    monkeypatch.setattr(simulation.How, "_rendered", made)
    found, _ = corrections._until_quiet(picture, Method("gradient"), simulation.How())
    assert found.renders == renders
    assert (asked.count(True), asked.count(False)) == (few, all_)


@pytest.mark.render
def test_uneven_paper_is_no_misfit_where_the_scene_tells_of_it():
    """Another box than the simulated one: no faces are as even as the model says, and its values are `ok`.

    Without the texture in the simulated pictures each is `misfit`; a box without paper is so in neither.
    """
    picture = Picture.of(load("printed_label"), (30, 135), (15, 315))
    method = Method("arrangement")
    off = simulation.simulated(picture, method)
    assert (off.simulated, off.status) == (("misfit",), ("ok",))
    paper = picture.scene.textures[1].tried(seed=77)
    box = picture.with_scene(picture.scene.tried(textures=(picture.scene.textures[0], paper)))
    images = render.expose(simulation.How().rough.image(box), box.scene.noise, np.random.default_rng(4), 10)
    found = measure.measure(images, picture, correction=off)
    assert (found.status == "ok").all()
    plain = measure.measure(images, picture, correction=dataclasses.replace(off, simulated=("ok",)))
    assert (plain.status == "misfit").all()
    even = picture.with_scene(picture.scene.tried(textures=picture.scene.textures[:1]))
    assert simulation.simulated(even, method).simulated == ("ok",)
