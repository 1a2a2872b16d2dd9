"""Plans that can be built: bodies clear of each other, reachable azimuths, one mount, no contradictions."""

import numpy as np
import pytest

import planner
from planner.constraints import Constraints
from scenes import InvalidInput


def gap(scene, sensor, light):
    """Distance between sensor and light, in the scene's unit."""
    return np.linalg.norm(scene.position("sensor", sensor) - scene.position("light", light))


def test_by_default_camera_and_lamp_do_not_stand_in_each_other(task1):
    """Spheres of a twentieth of their distances, 5 cm each: allowed exactly where centres are 10 cm apart."""
    limits = Constraints()
    poses = np.array([[40.0, 30.0 + turn] for turn in np.linspace(0, 30, 61)])
    allowed = limits.pairs(task1, poses[:1], poses)
    apart = [gap(task1, *pair) for pair in ((_pose(poses[0]), _pose(pose)) for pose in poses)]
    assert allowed.tolist() == [distance >= 10 for distance in apart]
    assert 0 < allowed.sum() < 61
    table = limits.pairs(task1, poses[:, None], poses[None])
    assert table.shape == (61, 61)
    assert table[0].tolist() == allowed.tolist()


def _pose(values):
    from scenes import Pose

    return Pose(*values.tolist())


def test_bodies_of_stated_size_and_none(task1):
    poses = np.array([[40.0, 30.0]])
    assert Constraints(camera_body=0, light_body=0).pairs(task1, poses, poses).all()
    far = np.array([[40.0, 90.0]])
    assert Constraints(camera_body=20, light_body=10).pairs(task1, poses, far).all()
    assert not Constraints(camera_body=50, light_body=20).pairs(task1, poses, far).any()
    beyond = task1.model_copy(update={"light": task1.light.model_copy(update={"distance": 120.0})})
    assert Constraints(camera_body=10, light_body=9).pairs(beyond, poses, poses).all()  # one behind the other


def test_a_plan_keeps_them(task1):
    """Also below the grid and among the candidates, and in the alternating search."""
    limits = Constraints(camera_body=15, light_body=15)
    found = planner.plan(task1, step_deg=8, constraints=limits)
    pairs = [found.poses, *((c.sensor, c.light) for c in found.candidates)]
    # margin: the plan stands where the bodies touch: equality
    assert min(gap(task1, *pair) for pair in pairs) >= 30 - 1e-9
    last = found.trace[-1]
    assert gap(task1, last.fixed_pose, last.found_pose) >= 30  # margin: a constraint, kept by its kind
    free = planner.plan(task1, step_deg=8, constraints=Constraints(camera_body=0, light_body=0))
    assert found.variance >= free.variance  # margin: a constraint never makes it better, by its kind


def test_reachable_azimuths(task1):
    poses = np.array([[30.0, azimuth] for azimuth in (340, 350, 5, 20, 21, 180)] + [[0.0, 180.0]])
    limits = Constraints(sensor_azimuth_deg=(350, 20), light_azimuth_deg=(0, 360))
    assert limits.sensors(task1, poses).tolist() == [False, True, True, True, False, False, True]
    assert limits.lights(poses).all()


@pytest.mark.parametrize(
    ("how", "line"),
    [
        ({"sensor": (30, 30), "light": (30, 31)}, r"sensor and light must keep the constraints on both"),
        (
            {"sensor": (30, 30), "light": (30, 90), "constraints": Constraints(same_mount=True)},
            r"sensor and light must keep the constraints on both .*, got \(30, 30\) and \(30, 90\)",
        ),
        ({"sensor": (30, 30), "constraints": Constraints(sensor_azimuth_deg=(40, 50))}, "sensor must keep the constr"),
    ],
)
def test_contradictions_are_refused(task1, how, line):
    with pytest.raises(InvalidInput, match=line):
        planner.plan(task1, step_deg=20, **how)


def test_constraints_that_contradict_themselves():
    with pytest.raises(InvalidInput, match="min_separation_deg must be 0 with same_mount, got 5"):
        Constraints(same_mount=True, min_separation_deg=5)
    with pytest.raises(InvalidInput, match="min_separation_deg must be at most 180, got 400"):
        Constraints(min_separation_deg=400)
    with pytest.raises(InvalidInput, match="camera_body must be a radius of at least 0, got -1"):
        Constraints(camera_body=-1)


def test_one_mount_takes_the_fixed_pose(task1):
    found = planner.plan(task1, step_deg=20, sensor=(30, 100), constraints=Constraints(same_mount=True))
    assert found.sensor == found.light
    assert list(found.sensor) == [30, 100]
