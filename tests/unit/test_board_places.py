"""A board's place and size as part of a plan: what is allowed, what is best, what is written."""

import json
from itertools import product

import numpy as np
import pytest

import planner
import scenes
from imaging.models import variance_model
from imaging.pictures import Pictures
from imaging.placed import placed
from planner import board_places
from planner.board_places import place_board, with_board
from planner.search.objective import minimised
from scenes import InvalidInput
from scenes.placement import limits
from tests import printed
from tests.commands import ice
from tests.docs.pages import DOCS, keys
from tests.docs.pages import told as told_of
from validation.planned_scene import write_board

POSES = (20, 270), (20, 90)


@pytest.fixture(scope="module")
def few():
    """A search of one size of squares, two shapes, and a coarse grid."""
    with pytest.MonkeyPatch.context() as patched:
        for name, value in (("_SCALES", (1.1,)), ("_COUNTS", (4, 6)), ("_PLACES", 9), ("_HALVINGS", 2)):
            patched.setattr(board_places, name, value)
        return place_board(scenes.load("board_block"), *POSES)


def _value(picture, board):
    return float(minimised(variance_model("calibrated")(Pictures.of(with_board(picture, board))), "object"))


def test_the_best_is_what_a_plan_of_its_scene_says(few):
    assert few.best.objective == pytest.approx(_value(few.picture, few.best.board), rel=1e-6)
    assert few.best.objective < few.before.objective
    assert few.best.budget["length"].U < few.before.budget["length"].U
    assert few.before.board == scenes.load("board_block").placement.board


def test_it_is_seen_whole_and_clear_of_the_part_wherever_both_may_lie(few):
    """By other code than the search's: pictures of the displaced part."""
    reach = limits(few.picture.scene.uncertainty)[:3]
    places = [np.array([*shift, 0, 0, 0]) * np.array([*reach, 1, 1, 1]) for shift in product((-1, 1), repeat=3)]
    assert all(printed.is_whole(placed(few.picture, each)) for each in places)
    assert printed.is_clear(few.picture)
    beside = few.best.board.tried(corner=tuple(np.array(few.best.board.corner) + [0, 12, 0]))
    away = few.picture.with_scene(few.picture.scene.tried(placement=few.picture.scene.placement.tried(board=beside)))
    assert not all(printed.is_whole(placed(away, each)) for each in places)  # negative control


def test_no_board_of_that_size_at_random_is_better(few):
    rng, best = np.random.default_rng(3), few.best
    reach = limits(few.picture.scene.uncertainty)[:3]
    places = [np.array([*shift, 0, 0, 0]) * np.array([*reach, 1, 1, 1]) for shift in product((-1, 1), repeat=3)]
    values = []
    while len(values) < 4:
        corner = np.array(best.board.corner) + [*rng.uniform(-8, 8, 2), 0]
        there = best.board.tried(corner=tuple(corner.tolist()))
        tried = few.picture.scene.tried(placement=few.picture.scene.placement.tried(board=there))
        picture = few.picture.with_scene(tried)
        if printed.is_clear(picture) and all(printed.is_whole(placed(picture, each)) for each in places):
            values.append(_value(few.picture, there))
    assert min(values) > 0.999 * best.objective  # the last step of the search is a sixth of a square


def test_the_whole_search_finds_a_larger_and_better_one():
    """Of board_block, whose own board could stand better and be larger; 0.0071, 0.0069, 0.0034 mm found."""
    found = place_board(scenes.load("board_block"), *POSES)
    before, moved, best = (each.budget["length"].U for each in (found.before, found.moved, found.best))
    assert best < 0.6 * before
    assert best < moved < before
    assert found.best.board.count > found.moved.board.count == 18


def test_how_well_the_pitch_is_known_goes_with_it(few):
    told = {each.key: each.u for each in few.picture.scene.uncertain}
    assert few.best.board.pitch == pytest.approx(1.1 * 5.5)
    assert told["placement.board.pitch"] == pytest.approx(1.1 * 0.0001)


def test_what_is_found_stands_in_the_file(few, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(scenes.find("board_block").read_text("utf-8"), "utf-8")
    write_board(path, few)
    scene = scenes.load(path)
    np.testing.assert_allclose(scene.placement.board.corner, few.best.board.corner, atol=1e-6)
    assert scene.placement.board.shape == few.best.board.shape
    assert scene.placement.board.pitch == pytest.approx(few.best.board.pitch)
    assert [each.u for each in scene.uncertain if each.key.endswith("pitch")] == pytest.approx([1.1 * 0.0001])
    assert scene.settings[0].sensor == few.picture.sensor
    assert "# inner corners" in path.read_text("utf-8")


def test_what_cannot_be_is_told_in_a_line(few):
    with pytest.raises(InvalidInput, match=r"placement\.from must be board to place one, got 'known'"):
        planner.place_board(scenes.load("task1"), (30, 135), (15, 315))
    narrow = few.picture.scene.with_(uncertainty={"part_shift": 40.0})
    with pytest.raises(InvalidInput, match=r"placement\.board must have room beside the part in the picture"):
        planner.place_board(narrow, *POSES)
    done = ice("plan", "task1", "--place-board")
    assert done.returncode == 2
    assert "--place-board must be given with placement.from = 'board', got 'known'" in done.stderr
    done = ice("plan", "board_block", "--place-board", "--views", "2")
    assert done.returncode == 2
    assert "--views must be left out with --place-board, got 2" in done.stderr


def test_the_command_says_where_it_should_stand(few):
    """The same search by the command, for people and as JSON."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(planner.board_places, "place_board", lambda *poses, **how: few)
        asked = ("plan", "board_block", "--place-board", "--sensor", "20,270", "--light", "20,90")
        told, facts = ice(*asked).stdout, json.loads(ice(*asked, "--json").stdout)
    assert "as the scene says" in told
    assert "6 x 4" in told or "6 x 6" in told or "4 x 4" in told
    before, best = facts["boards"]  # none of the scene's size was tried
    assert best["board"]["shape"] == list(few.best.board.shape)
    assert [row["U"] for row in best["measurands"]] == [each.U for each in few.best.budget]
    assert before["name"] == "as the scene says"
    assert facts["light"] == [20, 90]
    assert set(keys(facts)) == told_of(DOCS / "json.md", "ice plan --place-board")[0]
