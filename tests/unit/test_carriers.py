"""What carries sensors errs as told: against poses composed of rotations, drawn errors of one picture and of three."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import planner
from imaging.bundles.bundle import Bundle
from imaging.bundles.unknowns import Freedom
from imaging.geometry.lens import image_centre
from imaging.models import variance_model
from imaging.pictures import Pictures
from measure.believed import believed
from planner.budgeting.features import Features
from planner.budgeting.sources import sources
from planner.budgeting.station import Station
from scenes import InvalidInput, Picture
from tests import placements as parts
from tests.bundles import camera, project

LIGHT, SENSORS = (22.0, 60.0), ((28.0, 300.0), (28.0, 60.0), (28.0, 200.0))
RIG = {
    "part_shift": None,
    "part_tilt_deg": None,
    "hand_eye": {"shift": [0.05, 0.04, 0.1], "turn_deg": [0.02, 0.015, 0.04]},
    "stage": {"along": [0, 1, 0], "scale": 2e-4, "positioning": 0.03, "straightness": 0.02},
    "turntable": {"zero_deg": 300.0, "axis_shift": 0.05, "axis_tilt_deg": 0.02, "angle_deg": 0.01},
}
KNOWN = {"from": "known", "datums": [], "datum_sd": None}


@pytest.fixture(scope="module")
def tri(tmp_path_factory):
    scene = parts.scene(tmp_path_factory.mktemp("carriers"), "roof", placement=KNOWN, uncertainty=RIG)
    return [Picture.of(scene, sensor, LIGHT) for sensor in SENSORS]


def errors_of(scene):
    return [each for carrier in scene.uncertainty.carriers for each in carrier.errors]


def seen(scene, pose, points, off):
    """Images (n, 2) of points, px from the middle, by errors of names ``off``: hand, stage and table one upon another.

    The table's part is turned in the room, before a sensor that stays; the others move the sensor.
    """
    place, axes, focal = camera(scene, pose, np.zeros(4))
    pivot = np.array(scene.camera.look_at)
    place = place + np.array([off["stage.straightness.1"], 0.0, off["stage.straightness.2"]]) * _signs()
    place = place + np.array([0.0, off["stage.positioning"] + off["stage.scale"] * place[1], 0.0])
    shift, turn = (
        np.array([off[f"hand_eye.{n}.{a}"] for a in ("right", "down", "forward")]) for n in ("shift", "turn_deg")
    )
    place = place + axes.T @ shift
    axes = axes @ Rotation.from_rotvec(axes.T @ turn, degrees=True).as_matrix().T
    angle = pose[1] - 300.0
    home = Rotation.from_euler("z", angle, degrees=True)
    lean = Rotation.from_rotvec([off["turntable.axis_tilt_deg.x"], off["turntable.axis_tilt_deg.y"], 0], degrees=True)
    table = lean * Rotation.from_euler("z", -angle - off["turntable.angle_deg"], degrees=True) * lean.inv()
    through = pivot + [off["turntable.axis_shift.x"], off["turntable.axis_shift.y"], 0]
    there = home.apply(table.apply(points - through) + through - pivot) + pivot  # in the room, turned with the sensor
    return project(there, place, axes, focal)


def _signs():
    """Of the two directions across the stage, which are any."""
    across = np.linalg.svd(np.array([[0.0, 1.0, 0.0]]))[2][1:]
    return np.array([across[0] @ [1, 0, 0] + across[0] @ [0, 0, 1], 1.0, across[1] @ [1, 0, 0] + across[1] @ [0, 0, 1]])


def test_each_error_moves_a_picture_as_poses_that_are_composed(tri):
    """Images of all vertices, by steps of each error of what they do: to 1e-3 of the largest."""
    for pose, picture in zip(SENSORS, tri, strict=True):
        scene, points = picture.scene, picture.scene.solid.vertices
        here, names = Station.nominal(Pictures.of(picture)), [each.name for each in errors_of(picture.scene)]
        known = {each.name: each for each in sources(scene)}
        assert set(names) <= set(known)
        for name in names:
            step = 0.1 * known[name].told.u
            images = [seen(scene, pose, points, dict.fromkeys(names, 0.0) | {name: sign * step}) for sign in (1, -1)]
            ours = [
                known[name].moved(here, sign * step).record(points) - image_centre(scene.camera) for sign in (1, -1)
            ]
            expected, found = images[0] - images[1], ours[0] - ours[1]
            largest = np.abs(expected).max()
            assert np.abs(found - expected).max() < 1e-3 * largest + 1e-9, name
            assert largest > 1e-4 or (pose == SENSORS[0] and "axis" in name), name


def drawn(rng, scene, count, *, apart=False):
    """Errors of each of some pictures; ``apart``: what they share drawn anew for each, too."""
    each = errors_of(scene)
    shared = {e.name: e.u * rng.standard_normal() for e in each}
    return [
        {e.name: e.u * rng.standard_normal() if e.own or apart else shared[e.name] for e in each} for _ in range(count)
    ]


@pytest.mark.parametrize("sensors", ["uncertain", "known"])
def test_drawn_carriers_scatter_three_pictures_as_told(tri, sensors):
    """Errors in the adjustment, or in the budget alone where sensors count as known: 100 drawn sets, exact projection.

    Negative controls: noise alone; what pictures share drawn anew for each (known: uncertain ones are weighed by it).
    """
    rng, scene, count = np.random.default_rng(3), tri[0].scene, 100
    bundle = Bundle.of(tri, Freedom(sensors))
    noise = [variance_model("calibrated")(Pictures.of(each)).of_features for each in tri]
    adjusted = bundle.adjusted(noise)
    roots = [np.linalg.cholesky(each) for each in noise]
    ends = np.array([list(scene.solid.edge(name).ends) for name in bundle.seen[0].names])

    def variances(*, apart):
        found = []
        for _ in range(count):
            each, off = drawn(rng, scene, 3, apart=apart), []
            for pose, view, errors, root in zip(SENSORS, bundle.seen, each, roots, strict=True):
                image = seen(scene, pose, scene.solid.vertices, errors)[ends]
                lines = view.line_errors(image[:, 0], image[:, 1] - image[:, 0])
                off.append(lines + root @ rng.standard_normal(len(root)))
            found.append(bundle.values(adjusted.solved(off)[0]))
        return np.var(found, 0)

    rows = [{r.source: r.contribution for r in each.contributions} for each in planner.bundle_budget(tri, sensors)]
    u2 = np.array([sum(c**2 for name, c in each.items() if name != "model error") for each in rows])
    told, chance = variances(apart=False), 4 * np.sqrt(2 / count)
    assert (np.abs(told / u2 - 1) < chance).all()
    assert (told / np.diag(adjusted.covariance) > 1 + chance).all()
    assert sensors == "uncertain" or (np.abs(variances(apart=True) / u2 - 1) > chance).any()


def test_a_budget_of_one_picture_has_them_and_drawn_stations_scatter_so(tri):
    """300 stations with all errors drawn, their lines measured by who believes the scene; negative control: those of
    the turntable left out."""
    rng, count, picture = np.random.default_rng(5), 300, tri[1]
    names = {each.name for each in errors_of(picture.scene)}
    given = [each for each in sources(picture.scene) if each.name in names]
    features, made = Features(Pictures.of(picture)), []
    for _ in range(count):
        station = Station.nominal(features.pictures)
        for each in given:
            station = each.moved(station, each.told.u * rng.standard_normal())
        made.append(station)
    scatter, chance = believed(picture, features.errors(made)).var(0), 4 * np.sqrt(2 / count)
    for told, variance in zip(planner.budget(picture), scatter, strict=True):
        rows = {row.source: row.contribution for row in told.contributions}
        assert names <= set(rows)
        assert abs(variance / sum(rows[name] ** 2 for name in names) - 1) < chance
        rest = sum(rows[name] ** 2 for name in names if not name.startswith("turntable"))
        assert variance / rest - 1 > chance


def test_a_covariance_stands_for_its_standard_deviations(tri):
    sd = np.array([*RIG["hand_eye"]["shift"], *RIG["hand_eye"]["turn_deg"]])
    as_matrix = RIG | {"hand_eye": {"covariance": np.diag(sd**2).tolist()}}
    other = tri[1].with_scene(
        tri[1].scene.with_(uncertainty=as_matrix | {"hand_eye": None}).with_(uncertainty=as_matrix)
    )
    for one, two in zip(planner.budget(tri[1]), planner.budget(other), strict=True):
        assert one.u == pytest.approx(two.u, rel=1e-6)


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"hand_eye": {"shift": -1.0}}, "hand_eye"),
        (
            {"hand_eye": {"shift": 0.1, "covariance": np.eye(6).tolist()}},
            "must be without shift and turn_deg, got both",
        ),
        ({"hand_eye": {"covariance": (-np.eye(6)).tolist()}}, "must have no negative variance, got -1"),
        ({"stage": {"along": [0, 0, 0]}}, "stage.along must be a direction"),
        ({"turntable": {"angle_deg": -1}}, "angle_deg"),
    ],
)
def test_what_cannot_be_is_told_in_a_line(tri, table, says):
    with pytest.raises(InvalidInput, match=says):
        tri[0].scene.with_(uncertainty={"hand_eye": None}).with_(uncertainty=table)
