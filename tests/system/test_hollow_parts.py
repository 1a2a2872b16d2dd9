"""Random hollow parts (`python -m tests.proofs hollow`): the drawing's values, and which of them a person sees."""

import numpy as np
import pytest

import planner
from scenes import Picture, Pose
from tests.proofs import hollow

pytest.importorskip("OCP")
pytestmark = pytest.mark.render


def test_what_a_part_is_drawn_with_is_what_its_scene_says_and_what_is_visible_is_predicted(tmp_path):
    """From the riser's side the tread is hidden by nothing; from the other one its foot is, and nothing else."""
    part = hollow.drawn(np.random.default_rng(5))
    scene, true = hollow.scene_of(part, hollow.made(part, tmp_path / "part.step"))
    light = (Pose(40.0, 100.0),)
    facing, averted = (Picture(scene, Pose(45.0, azimuth), light) for azimuth in (20.0, 200.0))
    told = planner.predict(facing.scene, facing.sensor, facing.light).measurands
    assert {each.name: each.value_object for each in told} == pytest.approx(true, abs=1e-6)
    for picture, hidden in ((facing, set()), (averted, {"tread"})):
        seen = dict(zip(true, hollow.visible(picture), strict=True))
        statuses = {each.name: each.status for each in planner.predict(*picture_of(picture)).measurands}
        assert {name for name, status in statuses.items() if status == "not_visible"} == hidden
        assert not hidden & {name for name, is_seen in seen.items() if is_seen}
        assert sum(seen.values()) >= 4


def picture_of(picture):
    return picture.scene, picture.sensor, picture.light


def test_rays_meet_triangles():
    """Against the plane z = 0 within a triangle, from above, beside it, and away from it."""
    triangle = np.array([[[0.0, 0, 0], [4, 0, 0], [0, 4, 0]]])
    starts = np.array([[1.0, 1, 3], [3, 3, 3], [1, 1, 3], [1, 1, -3]])
    ways = np.array([[0.0, 0, -1], [0, 0, -1], [0, 0, 1], [0, 0, 1]])
    assert hollow.hit(starts, ways, triangle).tolist() == [True, False, False, True]
