"""Small pieces against closed forms, where no two axes, ends or signs are alike."""

import itertools
import math
import statistics
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

import planner
import render
import scenes
from imaging.light.bore import _form_factors, bores
from imaging.light.emitters import nodes
from imaging.light.revolved import rings_of
from imaging.models import bias
from measure.estimators.profile import profile_kernel, top_kernel
from planner.combining import combined
from planner.search.exhaustive import separable
from planner.search.objective import Aim
from render import curved
from render.phenomena import transport
from scenes import Backlight, Bar, Disc, InvalidInput, Light, Ring, Turned
from scenes.arrays import poses
from scenes.parts import step, step_kernel
from scenes.parts.surfaces import Cone
from validation import views_check
from validation.report import map_figure

LIGHTS = [
    Light(distance=90.0, radius=3.0), Disc(kind="disc", distance=90.0, radius=4.0),
    Bar(kind="bar", distance=90.0, length=12.0, width=5.0, turn_deg=25.0),
    Ring(kind="ring", distance=90.0, inner_radius=2.0, outer_radius=5.0),
    Backlight(kind="backlight", distance=90.0, half_side=7.0),
]  # fmt: skip


@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: light.kind)
def test_a_light_is_as_large_as_its_nodes_reach(light):
    """Gauss nodes go nearly to the rim, and not beyond: half of the largest extent."""
    far = np.linalg.norm(nodes(light, 10.0, 24).places, axis=1).max()
    # margin: a bound that holds by its kind: Gauss nodes lie within
    assert 0.96 * light.half_size < far <= light.half_size * (1 + 1e-12)


def test_a_bar_s_length_is_to_the_right_and_its_width_down():
    """Second moments of a turned rectangle: length^2 / 12 along, width^2 / 12 across."""
    bar = nodes(LIGHTS[2], 10.0, 10)
    turn = math.radians(25.0)
    along, across = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)])
    x, weight = np.polynomial.legendre.leggauss(10)
    weights = np.outer(weight, weight).ravel() / 4
    assert weights @ (bar.places[:, :2] @ along) ** 2 == pytest.approx(12**2 / 12, rel=1e-9)
    assert weights @ (bar.places[:, :2] @ across) ** 2 == pytest.approx(5**2 / 12, rel=1e-9)
    assert bar.area == pytest.approx(60.0)
    assert len(x) == 10


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_turned_part_has_the_volume_of_its_frusta(axis):
    """A cone, a shoulder, a cylinder; 1 % for the facets. Its ends are flat, where the profile says."""
    profile = ((1.0, 2.0), (4.0, 3.5), (4.0, 2.5), (9.0, 2.5))
    solid = Turned(kind="turned", axis=axis, profile=profile).solid
    frusta = [math.pi * (b[0] - a[0]) / 3 * (a[1] ** 2 + a[1] * b[1] + b[1] ** 2)
              for a, b in itertools.pairwise(profile)]  # fmt: skip
    corners = solid.triangles
    volume = np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    # margin: of 48 corners to a circle: (2 pi / 48)^2 / 6 = 0.0029
    assert volume == pytest.approx(sum(frusta), rel=0.01)
    k = "xyz".index(axis)
    assert solid.vertices[:, k].min() == pytest.approx(1.0)
    assert solid.vertices[:, k].max() == pytest.approx(9.0)
    flat = np.abs(solid.normals[:, k]) > 1 - 1e-9
    assert sorted(np.round(np.abs(solid.offsets[flat]), 6).tolist()) == [1.0, 4.0, 9.0]


@pytest.mark.parametrize("way", [-1, 1])
def test_a_crossing_far_from_its_edge_is_none_on_either_side(task1, monkeypatch, way):
    """Further off than the locator's window: the bias is not known."""
    plain = bias._zero

    def zero(*arguments):
        moved, slope = plain(*arguments)
        return moved + way * 1.01 * task1.locator.window_px, slope

    known = planner.predict(task1, (30, 135), (15, 315)).bias_image
    monkeypatch.setattr(bias, "_zero", zero)
    turned = task1.model_copy(update={"title": f"not known from before {way}"})
    assert np.isfinite(known)
    assert not np.isfinite(planner.predict(turned, (30, 135), (15, 315)).bias_image)


def test_patches_of_a_bore_see_each_other_by_their_angle():
    """cos cos / (pi r^2) of two places of a cylinder's wall, by their vectors; a quarter turn and another depth."""
    radius = 0.7
    between, *_ = _form_factors(radius)
    factors = np.fft.ifft(between, axis=0).real
    around, deep = factors.shape[:2]
    area = radius * 2 * math.pi / around / deep
    for turn, row, column in ((around // 2, 3, 3), (around // 4, 1, deep - 2), (around // 3, 0, 2)):
        angle = 2 * math.pi * turn / around
        here = np.array([radius, 0.0, (row + 0.5) / deep])
        there = np.array([radius * math.cos(angle), radius * math.sin(angle), (column + 0.5) / deep])
        way = there - here
        far = np.linalg.norm(way)
        cosines = (way @ [-1.0, 0, 0] / far) * (way @ [math.cos(angle), math.sin(angle), 0] / far)
        assert factors[turn, row, column] == pytest.approx(cosines / (math.pi * far**2) * area, rel=0.02)
    assert factors[around // 2, 1, deep - 2] > 1.2 * factors[around // 8, 1, deep - 2]


def test_the_renderer_s_cone_lies_on_the_cone(monkeypatch):
    """Every corner on it, its two ends at their heights, its triangles outwards."""
    cone = Cone((1.0, 2.0, 3.0), (0.0, 0.6, 0.8), 2.0, (-1.0, 2.5), half_angle_deg=15.0)
    monkeypatch.setattr(curved, "mesh", lambda _, corners, bsdf, normals: (corners, normals))
    corners, normals = curved._cone(None, cone, {})
    flat = corners.reshape(-1, 3)
    assert np.abs(cone.values(flat)).max() < 1e-12
    heights = (flat - cone.point) @ cone.axis
    assert {round(float(h), 9) for h in heights} == {-1.0, 2.5}
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ti,ti->t", facing, normals.reshape(corners.shape)[:, 0]) > 0).all()
    area = np.linalg.norm(facing, axis=1).sum() / 2
    wide, narrow = (2.0 + z * math.tan(math.radians(15.0)) for z in (2.5, -1.0))
    assert area == pytest.approx(math.pi * (wide + narrow) * 3.5 / math.cos(math.radians(15.0)), rel=1e-3)


@pytest.mark.parametrize("pair", [(-1.0, 10.0), (181.0, 10.0)])
def test_polar_angles_are_from_0_to_180(pair):
    """Azimuths may be any."""
    with pytest.raises(InvalidInput, match="must have polar angles between 0 and 180"):
        poses(np.array([[30.0, 10.0], pair]), "sensors")
    assert poses(np.array([[0.0, -400.0], [180.0, 720.0]]), "sensors").shape == (2, 2)


def test_the_last_line_of_the_kernel_says_why(tmp_path, monkeypatch):
    """It prints of its own before."""
    script = tmp_path / "kernel.py"
    said = "noise\nof a solid body, got none\n"
    script.write_text(f"import sys\nsys.stderr.write({said!r})\nsys.exit(2)\n")
    monkeypatch.setattr(step_kernel, "__file__", str(script))
    with pytest.raises(InvalidInput, match=r"object\.file must be of a solid body, got none: part\.step"):
        step._asked(step.Path("part.step"), b"", None)


def test_a_bore_is_as_long_as_its_plate_and_as_wide_as_its_polygon():
    """The widest free cylinder touches the middles of the rim's pieces: r cos(pi / n)."""
    plate = scenes.load("plate")
    (bore,) = bores(plate.solid)
    pieces = len(bore.rim.edges)
    assert bore.free_radius == pytest.approx(bore.rim.radius * math.cos(math.pi / pieces), rel=1e-6)
    assert bore.length == pytest.approx(np.ptp(plate.solid.vertices[:, 2]), rel=1e-6)
    assert len(bore.faces) == pieces


def test_walls_that_are_told_along_opposite_axes_are_the_same_part():
    """A shaft, one of its walls turned round: the same rings."""
    solid = scenes.load("shaft").solid
    plain = rings_of(solid)
    first, *others = solid.curved
    surface = first.surface
    turned = {"axis": -surface.axis, "ends": (-surface.ends[1], -surface.ends[0])}
    if surface.kind == "cone":
        turned["half_angle_deg"] = -surface.half_angle_deg
    found = rings_of(replace(solid, curved=(*others, replace(first, surface=replace(surface, **turned)))))
    there = [(each.places, each.area) for each in (plain, found)]
    assert np.sort(there[1][1]) == pytest.approx(np.sort(there[0][1]), rel=1e-9)
    middles = [np.sort(places.mean(1) @ solid.curved[0].surface.axis) for places, *_ in there]
    assert middles[1] == pytest.approx(middles[0], abs=1e-9)
    assert len(found.own) == len(plain.own)


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.1])
def test_the_kernel_of_a_place_beside_a_pixel_is_that_of_the_moved_gaussian(angle):
    """Second derivative across the edge of a Gaussian, its middle moved along the normal; scale 1.3."""
    scale, normal = 1.3, np.array([math.cos(angle), math.sin(angle)])
    kernel, radius = profile_kernel(scale, normal), math.ceil(5 * scale)
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    shifts = np.array([-0.4, 0.1, 0.6])
    for row, shift in zip(top_kernel(kernel, shifts), shifts, strict=True):
        dx, dy = x - shift * normal[0], y - shift * normal[1]
        across = (dx * normal[0] + dy * normal[1]) / scale
        wanted = np.exp(-(dx**2 + dy**2) / (2 * scale**2)) / (2 * math.pi * scale**2) * (across**2 - 1) / scale**2
        assert row.reshape(x.shape) == pytest.approx(wanted, abs=2e-4 * np.abs(wanted).max())


def test_records_of_a_plan_are_the_candidates(task1):
    found = planner.plan(task1, step_deg=30, refined=False)
    for row, each in zip(found.as_rows(), found.candidates, strict=True):
        assert (row["variance"], row["variance_object"], row["variance_image"]) == (
            each.variance, each.variance_object, each.variance_image,
        )  # fmt: skip
        assert (row["sensor_polar"], row["sensor_azimuth"]) == tuple(each.sensor)
        assert (row["light_polar"], row["light_azimuth"]) == tuple(each.light)


@pytest.mark.parametrize(
    ("pose", "place"), [((30.0, 0.0), (30, 0)), ((40.0, 90.0), (0, 40)), ((60.0, 210.0), (-30 * 3**0.5, -30))]
)
def test_a_pose_is_drawn_at_its_polar_angle_and_azimuth(pose, place):
    assert map_figure.place(*pose) == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("name", ["printed_label", "grey_floor", "two_lights"])
def test_an_influence_is_never_negative(name):
    """They are bounds of sizes: what moves the distance to the one side counts as what moves it to the other."""
    for decision in render.effects(scenes.load(name)):
        assert decision.influence.bias_px >= 0
        assert decision.influence.variance >= 0


def test_a_side_face_gives_half_of_what_a_floor_sends_and_an_upright_box_its_elevation():
    """Bounds of form factors: sine squared of the highest vertex over the face's plane."""
    box = scenes.Obstacle(corner=(3.0, -1.0, 0.0), size=(1.0, 2.0, 4.0)).solid
    points, normals = np.array([[[0.0, 0.0, 0.0]]]), np.array([[[0.0, 0, 1], [-1.0, 0, 0]]])
    found = transport._form_factor(box, points, normals)
    assert found[0, 0, 0] == pytest.approx(16 / (9 + 1 + 16))
    assert found[0, 1, 0] == 0


def test_the_renderer_s_ring_is_the_planner_s():
    """Tilted: its area, its inner rim further from the object than the outer one, its outside inwards and forwards."""
    light = Ring(kind="ring", distance=90.0, inner_radius=2.0, outer_radius=5.0, tilt_deg=35.0)
    triangles, made = light.shape()["triangles"], nodes(light, 10.0, 12)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normals, axis=1).sum() / 2
    assert area == pytest.approx(made.area, rel=1e-3)
    assert area == pytest.approx(math.pi * 21 / math.cos(math.radians(35.0)), rel=1e-3)
    far = np.linalg.norm(triangles[..., :2], axis=-1)
    slope = np.polyfit(far.ravel(), triangles[..., 2].ravel(), 1)[0]
    there = np.polyfit(np.linalg.norm(made.places[:, :2], axis=1), made.places[:, 2], 1)[0]
    assert slope == pytest.approx(math.tan(math.radians(35.0)), rel=2e-3)  # 10 degrees would be 0.7
    assert there == pytest.approx(math.tan(math.radians(35.0)), rel=1e-6)
    assert made.normals[:, 2] == pytest.approx(math.cos(math.radians(35.0)))


@pytest.mark.parametrize("exposure", [205.0, 230.0, 260.0])
def test_a_search_by_bounds_finds_what_is_best_where_levels_are_cut_off(task1, exposure):
    """A near light: one end of an edge beyond the scale, the other not; against all pairs one by one."""
    near = task1.light.model_copy(update={"distance": 25.0})
    camera = task1.camera.model_copy(update={"exposure": exposure})
    scene = task1.model_copy(update={"light": near, "camera": camera})
    polar, azimuth = np.meshgrid([15.0, 40.0, 65.0], np.arange(0.0, 360.0, 40.0))
    poses_ = np.column_stack([polar.ravel(), azimuth.ravel()])
    table = separable(scene, poses_, poses_, "calibrated", Aim.of(scene.quantities, "image"))
    exact = planner.variances(scene, poses_[:, None], poses_[None], objective="image")
    below = 0
    for which in range(len(table.strength)):
        rows, columns, matrix = table.of_class(which)
        bound = table.rows(rows, matrix)
        value = exact[np.ix_(table.sensors[rows], columns)]
        there = np.isfinite(value)
        assert (bound[there] <= value[there] * (1 + 1e-6)).all()  # margin: a bound that holds by its kind
        below += int((bound[there] > 0.5 * value[there]).sum())
    assert below > 20


def test_pictures_are_combined_with_the_squares_of_their_weights():
    """Two pictures of unlike scatter and one of them lost at times; the mean error in the object, sigma not squared."""
    ok = SimpleNamespace(status="ok", name="width", unit="cm", value_object=5.0, tolerance=None)
    views = [SimpleNamespace(place=k, prediction=SimpleNamespace(measurands=(ok,))) for k in (0, 1)]
    variances = np.array([[[4e-6]], [[1e-6]]])
    both = combined(variances, np.array([["ok"], ["ok"]]), np.zeros((2, 1)))
    assert both.weights.ravel() == pytest.approx([0.2, 0.8])
    rng = np.random.default_rng(6)
    values = [5.0 + 1e-4 + v * rng.normal(size=(1, 300, 1)) for v in (2e-3, 1e-3)]
    values[1][0, 4:6] = np.nan
    off = SimpleNamespace(
        bias=np.array([3e-4]), u_bias=np.array([1e-4]), beside=np.array([2e-5]), simulated=("ok",)
    )  # fmt: skip
    shots = {k: views_check._Shot(values[k], variances[k] * (1.2, 0.9)[k], off) for k in (0, 1)}
    chosen = SimpleNamespace(views=views, combination=both)
    ((row, joined),) = views_check._rows(chosen, shots)
    wanted = 0.2 * values[0][0, :, 0] + 0.8 * values[1][0, :, 0]
    good = wanted[np.isfinite(wanted)]
    assert joined[np.isfinite(joined)] == pytest.approx(good)
    assert (row.n, row.failed, row.pictures) == (298, 2, 2)
    assert row.predicted == pytest.approx(1 / (1 / 4e-6 + 1 / 1e-6))
    assert row.propagated == pytest.approx(0.04 * 4.8e-6 + 0.64 * 0.9e-6)
    assert row.empirical == pytest.approx(statistics.variance(good.tolist()))
    assert row.ratio == pytest.approx(row.empirical / row.predicted)
    assert row.bias == pytest.approx(good.mean() - 5.0)
    assert (row.correction, row.u_bias) == (pytest.approx(3e-4), pytest.approx(1e-4))
    assert row.render_noise == pytest.approx(2e-5 * math.hypot(0.2, 0.8))
    assert (row.status, row.judged) == ("ok", True)
    freedom = 297
    ends = [row.ratio * freedom / stats.chi2.ppf(q, freedom) for q in (0.975, 0.025)]
    assert row.ratio_interval == pytest.approx(ends)
    told = views_check.judge([(row, joined)], 1.0)
    assert told.verdict.bias.largest == pytest.approx(abs(row.bias) / math.hypot(math.sqrt(row.predicted), 1e-4))
    assert told.verdict.agrees
