"""Campaigns: numbering, grids, sweeps, ranges, and one line for what is wrong."""

import pickle
import tracemalloc

import pytest

import scenes
from scenes import InvalidInput
from tests.oracle import block_image
from validation.batch import campaign
from validation.batch.campaign import Campaign, Grid
from validation.batch.work import methods, render_setting


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "many.toml"
        path.write_text(text)
        return path

    return write


def test_a_scene_is_a_campaign_of_its_settings(task1):
    loaded = campaign.load("task1")
    assert len(loaded) == 16
    for i, setting in enumerate(task1.settings):
        assert loaded.case(i).setting == setting
        assert loaded.case(i).index == i
        assert loaded.case(i).scene == task1.model_copy(update={"settings": ()})


def test_grid_and_sweep_are_all_combinations(write):
    path = write("""
        scenes = ["task1", "task1_part1"]
        [grid]
        sensor_polar = [20, 40]
        sensor_azimuth = { from = 0, to = 270, step = 90 }
        light_polar = [30]
        light_azimuth = { from = 0, to = 90, count = 3 }
        [sweep]
        noise.sigma = [1.2, 2.4]
        camera.exposure = { from = 100, to = 200, count = 3 }
        material.roughness = [0.1]
        object.size = [[12.5, 7.5, 2.5], [6, 4, 2]]
    """)
    loaded = campaign.load(path)
    assert len(loaded) == 2 * (2 * 3 * 1 * 2) * (2 * 4 * 1 * 3)
    cases = [loaded.case(i) for i in range(len(loaded))]
    every = {(c.scene.name, str(c.parameters), c.setting.sensor, c.setting.light) for c in cases}
    assert len(every) == len(loaded)
    last = cases[-1]
    assert last.scene.name == "task1_part1"
    assert last.parameters == {
        "noise.sigma": 2.4, "camera.exposure": 200.0, "material.roughness": 0.1, "object.size": [6, 4, 2]
    }  # fmt: skip
    assert (last.scene.noise.sigma, last.scene.camera.exposure, last.scene.object.size) == (2.4, 200.0, (6, 4, 2))
    assert (last.setting.sensor, last.setting.light) == (scenes.Pose(40, 270), scenes.Pose(30, 90))
    assert last.setting.paper_ice is None


def test_the_paper_printed_nothing_for_swept_scenes(task1):
    swept = Campaign(name="x", scenes=(task1,), sweep={"noise.sigma": (1.0, 2.0)})
    assert len(swept) == 32
    assert all(swept.case(i).setting.paper_ice is None for i in range(32))
    assert swept.case(17).setting.sensor == task1.settings[1].sensor


def test_scene_files_lie_beside_the_campaign(write, tmp_path):
    (tmp_path / "own.toml").write_text((scenes.load.__globals__["BUNDLED"] / "task1.toml").read_text())
    assert campaign.load(write('scenes = ["own.toml"]')).case(0).scene.name == "own"


def test_a_document_of_the_run_file_is_the_campaign_again(write):
    loaded = campaign.load(write('scenes = ["task1"]\n[sweep]\nnoise.sigma = [1, 2]'))
    again = Campaign.model_validate(loaded.model_dump(mode="json"))
    assert [again.case(i) for i in range(32)] == [loaded.case(i) for i in range(32)]


def test_memory_and_message_do_not_grow_with_the_settings(task1):
    """A campaign of a million settings takes no more memory than one of a hundred, nor does a case on the wire."""

    def made(side):
        axis = tuple(float(x) for x in range(5, 5 + side))
        tracemalloc.start()
        grid = Campaign(name="x", scenes=(task1,), grid=Grid(
            sensor_polar=axis, sensor_azimuth=axis, light_polar=axis, light_azimuth=axis))  # fmt: skip
        case = grid.case(len(grid) - 1)
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return len(grid), size, len(pickle.dumps(case))

    made(2)  # imports
    (few, small, short), (many, large, long) = made(3), made(32)
    assert (few, many) == (81, 1048576)
    assert large < small + 50_000
    assert long < short + 100


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("scenes = []", "scenes must be at least as long as 1"),
        ("scenes = 3", "scenes must be a list of names or files, got 3"),
        ('scenes = ["task9"]', "scene must be a TOML file or one of|must be a readable file"),
        ('scenes = ["task1"]\nspeed = 3', "speed must be a known key, got 3"),
        (
            'scenes = ["task1"]\n[sweep]\nnoise.sgma = [1]',
            "sweep.noise.sgma must be a key of the scene, got none in task1",
        ),
        ('scenes = ["task1"]\n[sweep]\nnoise.sigma = [1, -1]', "noise.sigma must be at least 0, got -1"),
        ('scenes = ["task1"]\n[sweep]\nnoise.sigma = { from = 1 }', "a range must be {from, to, count} or"),
        ('scenes = ["task1"]\n[sweep]\nnoise.sigma = []', "sweep.noise.sigma must be at least as long as 1"),
        ('scenes = ["task1"]\n[grid]\nsensor_polar = [1]', "grid.sensor_azimuth must be given, got nothing"),
    ],
)
def test_what_is_wrong_is_one_line_with_the_file(write, text, line):
    path = write(text)
    with pytest.raises(InvalidInput, match=line) as error:
        campaign.load(path)
    assert "\n" not in str(error.value)


def test_scene_without_settings(task1):
    with pytest.raises(Exception, match="settings must be a list of at least one sensor and light"):
        Campaign.of(task1.model_copy(update={"settings": ()}))


def test_samples_are_the_scenes_with_some_of_their_poses(task1):
    (whole,) = Campaign.of(task1).samples()
    assert whole == task1
    (some,) = Campaign.of(task1).samples(4)
    assert [setting.sensor for setting in some.settings] == [task1.settings[i].sensor for i in (0, 5, 10, 15)]


def test_a_campaign_is_measured_by_the_estimators_that_are_asked_for(task1):
    """In their order, the classic detector once a threshold; only of the classic ones a bias is predicted."""
    asked = Campaign.of(task1).measured_by(("arrangement", "canny"))
    assert [method.name for method in methods(asked.scenes[0])] == ["arrangement", "canny@12", "canny@10"]
    assert [method.name for method in methods(task1)] == ["gradient", "canny@12", "canny@10"]
    known = {
        name: render_setting(Campaign.of(task1).measured_by((name,)).case(0), "scalar_rgb", image=task1_image(task1))
        for name in ("gradient", "arrangement")
    }
    assert known["gradient"].predicted["predicted_bias"] != 0
    assert known["arrangement"].predicted["predicted_bias"] == 0
    assert known["arrangement"].predicted["measurands"][0]["predicted_bias"] == 0
    assert next(iter(known["arrangement"].propagated)) == "arrangement"


def task1_image(task1):
    """Of its first setting, by the closed form."""
    return block_image(task1, tuple(task1.settings[0].sensor), tuple(task1.settings[0].light))


@pytest.mark.parametrize("names", [("gradient", "gradient"), ("none",), ("gradient", "none")])
def test_estimators_that_are_none_are_refused(task1, names):
    with pytest.raises(InvalidInput, match=r"locator\.estimators must be different ones of .*gradient.*, got "):
        methods(Campaign.of(task1).measured_by(names).scenes[0])


def test_the_detector_alone_needs_a_threshold(task1):
    bare = task1.with_(locator={"thresholds": [], "estimators": ["canny"]})
    with pytest.raises(InvalidInput, match=r"locator\.thresholds must be given where canny is the only estimator"):
        methods(bare)
