"""What commands say of rare things: pictures of drawn stations, a distance, a board, wrapped names, a log's line."""

import contextlib
import logging
import math
import statistics
from types import SimpleNamespace

import numpy as np
import pytest

import measure
import planner
import scenes
from render.phenomena.base import Influence
from scenes import Pose
from tests.commands import ice
from validation import budgets, coverage, effects_check, plan_check, vary_check
from validation.cli import measure as measure_cli
from validation.cli import photograph, plan, verbosity
from validation.cli import predict as predict_cli
from validation.report import camera_table, figures, guide, table, views_figure
from validation.statistics import LEVEL


class Rows:
    """Two budgets, of 10 +- 0.5 and 20 +- 3."""

    measurands = (
        SimpleNamespace(name="slot", unit="mm", value=10.0, U=0.5, u=0.25, p=0.95),
        SimpleNamespace(name="lean", unit="degrees", value=20.0, U=3.0, u=1.5, p=0.95),
    )
    statuses = ("ok", "ok")

    def __iter__(self):
        return iter(self.measurands)


def test_pictures_of_drawn_stations(monkeypatch):
    """A sample's standard deviation of those that were measured, and how many of these hold the true value."""
    values = np.array([[10.1, 19.0], [10.5, np.nan], [9.4, 26.0], [10.2, 21.0], [np.nan, 23.0]])
    states = np.array([["ok", "ok"], ["clutter", "short"], ["ok", "ok"], ["ok", "clutter"], ["short", "clutter"]])
    asked = []

    def pictured(rng, count, estimator, report):
        asked.append((rng.bit_generator.seed_seq.entropy, count, estimator))
        return values, states

    monkeypatch.setattr(coverage, "Chain", lambda found: SimpleNamespace(pictured=pictured))
    told = budgets.pictured(Rows(), 5, 17, "canny")
    assert asked == [(17, 5, "canny")]
    slot, lean = told["measurands"]
    assert (slot["name"], slot["unit"], lean["name"], lean["unit"]) == ("slot", "mm", "lean", "degrees")
    assert (slot["value"], slot["u"]) == pytest.approx((10.05, statistics.stdev([10.1, 10.5, 9.4, 10.2])))
    assert (slot["held"], slot["n"], slot["failed"], slot["warned"]) == (0.75, 4, 1, 2)
    assert (lean["value"], lean["u"]) == pytest.approx((22.25, statistics.stdev([19.0, 26.0, 21.0, 23.0])))
    assert (lean["held"], lean["n"], lean["failed"], lean["warned"]) == (0.75, 4, 1, 3)
    first, second = budgets.said_of_pictures(told)
    assert first == (
        f"slot: 4 of 5 pictures of drawn stations measured, u = {slot['u']:.3g},"
        " value +- U holds the true value in 75.0 %"
    )
    assert second.startswith("lean: 4 of 5 ")


@pytest.mark.parametrize(
    ("verdict", "said"),
    [("agree", "agrees within 0.05 (JCGM 101, clause 8)"), ("differ", "differs (skewed); state Monte Carlo's interval"),
     ("open", "undecided (skewed); state Monte Carlo's interval")],
)  # fmt: skip
def test_monte_carlo_in_words(verdict, said):
    row = {"draws": 3000, "u": 0.1234, "interval": [9.5, 10.25], "verdict": verdict, "reason": "skewed",
           "tolerance": 0.05}  # fmt: skip
    assert budgets.said_of_draws(row) == f"Monte Carlo (3000 draws) u = 0.123, interval 9.5 to 10.25: {said}"


def distance(value=90.25):
    return SimpleNamespace(
        value_px=np.float64(value), variance_px2=np.float64(0.09), status=np.str_("ok"), p_value=np.float64(0.031),
        corners=np.array([[1.0, 2.0], [3.0, 5.0]]), edge_names=("a-b", "c-d"), edge_status=np.array(["ok", "short"]),
        edge_contrast=np.array([52.4, 31.7]), used=np.array([41, 7]), rejected=np.array([2, 3]),
    )  # fmt: skip


def test_a_distance_edge_by_edge():
    told = measure_cli._distance_facts(distance())
    assert told == {
        "value_px": 90.25, "variance_px2": 0.09, "status": "ok", "p_value": 0.031, "corners": [[1, 2], [3, 5]],
        "edges": [{"name": "a-b", "status": "ok", "used": 41, "rejected": 2, "contrast": 52.4},
                  {"name": "c-d", "status": "short", "used": 7, "rejected": 3, "contrast": 31.7}],
    }  # fmt: skip
    assert measure_cli._distance_text(distance(), told["edges"]).splitlines() == [
        "The distance in the image: 90.2500 +- 0.3000 px (1 sigma), ok (goodness of fit: p = 0.031)",
        "Its edges, with the samples used and the contrast in grey levels: a-b ok (41, 52), c-d short (7, 32)",
        "p: how likely so bad a fit is by chance if the picture is as the model says; "
        "below 0.0001 the status is misfit or a worse one.",
    ]


def test_a_distance_that_is_none():
    none = measure_cli._distance_facts(distance(math.nan))
    assert (none["value_px"], none["variance_px2"], none["corners"]) == (None, None, None)
    assert none["edges"][0]["used"] == 41
    said = measure_cli._distance_text(distance(math.nan), none["edges"])
    assert said.startswith("The distance in the image: not measured, ok (goodness of fit: p = 0.031)\n")
    assert photograph.fit(math.nan) == ""


def test_an_uncertainty_that_is_not_known_is_no_number():
    assert photograph._beside(0.0123, 3) == "+- 0.012"
    assert photograph._beside(math.nan, 3) == photograph._beside(math.inf, 3) == "+- unknown"


def board(corners):
    """2 rows of 3 inner corners, of which the second is not measured: sigmas of 0.01 to 0.06 px in x, half in y."""
    sigma = np.array([[1.0, 0.5], [np.nan, np.nan], [3, 1.5], [4, 2], [5, 2.5], [6, 3]]) / 100
    return SimpleNamespace(
        kind="chessboard", status="ok", noise=1.25, blur_px=0.7, p_value=0.25, corners=corners,
        covariance=np.diag(sigma.ravel() ** 2), candidate=SimpleNamespace(grid=np.zeros((2, 3, 2))),
    )  # fmt: skip


def test_a_board_in_a_photograph():
    """Columns first; the median is of 0.5, 1, 1.5, 2, 2.5, 3, 3, 4, 5 and 6 hundredths."""
    assert photograph._text(4, board(np.zeros((6, 2)))) == (
        "4. chessboard: ok, 3 x 2 inner corners, 5 measured to 0.028 px (median); --json has them; "
        "noise 1.25 grey levels, blur 0.70 px (goodness of fit: p = 0.25)"
    )
    assert photograph._board(board(None)) == "ok, 3 x 2 inner corners"


def test_names_are_wrapped():
    """Three lines: a name is added to the last one where that has room, up to its end."""
    assert views_figure._wrapped(["abc", "def", "ghi", "jkl", "mn"], 8) == "abc, def\nghi, jkl\nmn"
    assert views_figure._wrapped(["abc", "def", "ghi", "jkl", "mn"], 7) == "abc\ndef\nghi\njkl, mn"
    assert views_figure._wrapped(["longer than that", "b"], 4) == "\nlonger than that\nb"
    assert views_figure._wrapped([]) == "nothing is taken from it"


def test_an_intrinsic_has_two_digits_of_its_deviation():
    """Four decimals where it has none."""
    found = SimpleNamespace(
        names=("fx", "cy", "k1", "p1"),
        values=[1203.45678, 480.0, -0.123456789, 7.0],
        sd=[0.21, 12.0, 0.00034, 0.0],
        is_splined=False,
    )
    rows = list(zip(*(column.cells for column in camera_table.parameters(found).columns), strict=True))
    assert rows == [
        ("fx", "1203.46", "0.21", "px"), ("cy", "480", "12", "px"), ("k1", "-0.12346", "0.00034", ""),
        ("p1", "7.0000", "0", ""),
    ]  # fmt: skip
    wide = SimpleNamespace(names=("fy",), values=[1203.45678], sd=[math.inf], is_splined=False)
    assert next(iter(camera_table.parameters(wide).columns[1].cells)) == "1203.4568"


@pytest.mark.parametrize(
    ("value", "label"),
    [(0.5, "0.5"), (12, "12"), (True, "True"), ("a b/c:d", "a-b-c-d"), ("..x-", "x"), ("m" * 30, "m" * 20)],
)
def test_labels_of_files_hold_only_what_is_safe(value, label):
    assert figures._label(value) == label


def test_the_papers_search_is_shown_beside_ours():
    ours = [("task1", (30.0, 90.0), (15.0, 270.0), 0.5, 0.25), ("x", (1, 2), (3, 4), 0, 0.125)]
    rows = zip(*(column.cells for column in table._search(SimpleNamespace(search=ours)).columns), strict=True)
    assert list(rows) == [
        ("(30.0, 90.0)", "(15.0, 270.0)", "0.5000", "0.2500", "0.500"),
        ("(1.0, 2.0)", "(3.0, 4.0)", "0.0000", "0.1250", "-"),
    ]  # fmt: skip


@pytest.mark.parametrize(("workers", "said"), [(1, "1 worker on"), (2, "2 workers on")])
def test_the_time_of_a_run(workers, said):
    spent = {"wall": 12.34, "workers": workers, "render": 5.0, "measure": 7.25}
    found = SimpleNamespace(seconds=spent, variant="scalar_rgb")
    assert table._time(found).plain == (
        f"\nTime: 12.3 s with {said} scalar_rgb. Working seconds: render 5.0, measure 7.2."
    )
    assert found.seconds["wall"] == 12.34  # as it was


def test_an_event_and_its_facts_are_a_line():
    record = logging.LogRecord("validation", logging.INFO, "", 0, "committed", (), None)
    assert verbosity._Line().format(record) == "committed"
    record.facts = {"setting": 3, "images": 64}
    assert verbosity._Line().format(record) == "committed setting=3 images=64"


def test_the_level_of_a_verdict_is_said_in_percent():
    assert LEVEL == 0.01
    assert "a false alarm 1 % likely over all rows" in guide.verdict_terms()[0]


@pytest.mark.parametrize(("methods", "said"), [(1, "without a value."), (3, 'one number a method ("0 0 0": none).')])
def test_failures_are_told_by_method(methods, said):
    assert guide.ratio_terms("gradient", methods)[1].endswith(said)
    assert guide.ratio_terms("gradient", methods)[-1] == "The verdict is about gradient, as are bias and rmse."


def test_a_plan_is_checked_by_ten_renders_where_they_are_small():
    """Up to a million pixels; else it is asked for."""
    sizes = ((plan._QUICK_PIXELS // 7, 7), (plan._QUICK_PIXELS // 7, 8))
    cameras = [SimpleNamespace(camera=SimpleNamespace(width=width, height=height)) for width, height in sizes]
    assert [plan._renders(scene) for scene in cameras] == [10, 0]


@pytest.mark.parametrize("count", [1, 2])
def test_each_picture_of_a_set_is_drawn(monkeypatch, tmp_path, count):
    """Below one another, titled with what is taken from it."""
    asked, kept = [], []

    def seen(axis, scene, sensor, light, points):
        asked.append((sensor, light, points.shape))
        axis.set_title(f"from {sensor.polar_deg:g}")

    monkeypatch.setattr(views_figure, "draw_seen", seen)
    monkeypatch.setattr(views_figure, "save", lambda figure, path: kept.append(figure) or path)
    picture = SimpleNamespace(scene=None)
    views = [SimpleNamespace(sensor=Pose(10 + k, 20), light=Pose(30, 40 + k), picture=picture) for k in range(count)]
    used = np.array([[True, False, True], [False, False, False]])[:count]
    last = SimpleNamespace(views=views, combination=SimpleNamespace(used=used))
    scene = SimpleNamespace(quantities=[SimpleNamespace(name=name) for name in ("slot", "lean", "step")])
    found = SimpleNamespace(sets=(None, last), scene=scene)
    assert views_figure.draw(found, tmp_path / "new") == [tmp_path / "new" / "views.png"]
    assert asked == [(Pose(10 + k, 20), Pose(30, 40 + k), (0, 2)) for k in range(count)]
    titles = [axis.get_title() for axis in kept[0].axes]
    assert titles == ["no. 1: from 10\nslot, step", "no. 2: from 11\nnothing is taken from it"][:count]


def test_pictures_of_a_run_that_would_have_one_name_are_numbered():
    """Sensors that differ by less than is said in a name; poses of the light are panels of one picture."""

    class Campaign:
        scenes = (1,)

        def __len__(self):
            return 5

        def case(self, i):
            sensor = Pose(30 + 1e-9 * (0, 1, 2, 0, 5)[i], 90)
            return SimpleNamespace(
                scene=SimpleNamespace(name="s"), setting=SimpleNamespace(sensor=sensor), parameters={}
            )

    named = figures._panels(Campaign(), SimpleNamespace(has_image=lambda i: i != 4))
    assert {name: len(cases) for name, cases in named.items()} == {
        "sensor_30_90": 2, "sensor_30_90__2": 1, "sensor_30_90__3": 1,
    }  # fmt: skip


def test_a_picture_is_cut_8_px_around_the_object(monkeypatch):
    picture = np.arange(100.0 * 200).reshape(100, 200)
    for rows, columns, cut in (
        (slice(20, 30), slice(40, 60), picture[12:38, 32:68]), (slice(3, 30), slice(5, 190), picture[:38, :198])
    ):  # fmt: skip
        monkeypatch.setattr(figures, "window", lambda _, part=(rows, columns): part)
        assert np.array_equal(figures._covered(SimpleNamespace(picture=None), picture), cut)


def test_effects_are_compared_over_five_seeds(monkeypatch):
    """Variance and distance of each; the fastest render's time."""
    asked, clock = [], iter([0.0, 9.0, 10.0, 12.0, 20.0, 21.5, 30.0, 33.0, 40.0, 44.0])

    def image(scene, sensor, light, quality, effects):
        asked.append((sensor, light, quality.seed, effects))
        return quality.seed

    monkeypatch.setattr(effects_check.render, "image", image)
    monkeypatch.setattr(effects_check.time, "perf_counter", lambda: next(clock))
    monkeypatch.setattr(measure, "propagate", lambda image, scene, sensor: SimpleNamespace(
        value_px=90.0 + image, variance_px2=0.5 * image))  # fmt: skip
    runs = effects_check._Runs(None, SimpleNamespace(sensor="s", light="l"), "all", effects_check.render.Quality())
    assert asked == [("s", "l", seed, "all") for seed in range(5)]
    assert runs.values.tolist() == [90.0, 91.0, 92.0, 93.0, 94.0]
    assert runs.variances.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert runs.seconds == 1.5


def test_what_an_effect_changes_is_known_to_the_scatter_over_seeds():
    """Student's t of 0.1 % with four degrees of freedom, 8.610, and single precision beside it."""
    base = SimpleNamespace(values=np.full(5, 90.0), variances=np.full(5, 2.0), seconds=0.5)
    off, grown = np.array([0.1, 0.3, 0.2, 0.6, 0.4]), np.array([0.02, 0.01, 0.05, 0.03, 0.04])
    runs = SimpleNamespace(values=90.0 + off, variances=2.0 * (1 + grown), seconds=0.75)
    row = effects_check._row(None, "blur", None, base, runs)
    assert (row.bias_px, row.variance) == pytest.approx((0.32, 0.03))
    wide = [8.610302 / math.sqrt(5) * statistics.stdev(each) for each in (off, grown)]
    assert (row.resolution_px, row.resolution_variance) == pytest.approx((wide[0] + 2e-4, wide[1] + 1e-3), rel=1e-6)
    assert (row.seconds, row.seconds_auto) == (0.75, 0.5)


def test_edges_that_cannot_be_relied_on_are_told_of():
    """Of each picture those alone whose status says so, with their lengths and contrasts; of many pictures some."""
    plate = scenes.load("plate")
    found = planner.predict(plate, (15, 85), (40, 265))
    (edge,) = (each for each in found.edges if each.status != "ok")
    (line,) = predict_cli.doubtful_edges([found, planner.predict(plate, (20, 55), (30, 205))])
    assert line == (
        f"sensor (15.0, 85.0), light (40.0, 265.0): {edge.name} clutter, {edge.length_px:.3g} px long, "
        f"contrast {edge.contrast:.3g} grey levels."
    )
    assert predict_cli.doubtful_edges([found] * 10)[-1] == "and 2 more places"


@pytest.mark.parametrize(("holds", "code"), [((), 0), ((True, True), 0), ((True, False), 1), ((False, True), 1)])
def test_an_effect_beyond_its_bound_is_exit_status_1(holds, code, monkeypatch):
    rows = [
        effects_check.Switched(
            scenes.Setting(sensor=(20, 100), light=(40, 250)), "floor", Influence(0.01, 0.2),
            0.005 if good else 0.5, 0.1, 0.003, 0.04, 3.0, 1.5,
        )
        for good in holds
    ]  # fmt: skip
    monkeypatch.setattr(effects_check, "check", lambda *_, **__: rows)
    assert [row.holds for row in rows] == list(holds)
    assert ice("effects", "task1", *["--check"] * bool(rows), "--json").returncode == code


@pytest.mark.parametrize("count", [30, 33])
def test_of_many_shapes_the_others_are_counted(count):
    """Below the thirty best, in the first of the table's columns."""
    shape = SimpleNamespace(
        kind="ellipse", centre=(10.0, 20.0), sizes=(8.0, 5.0), support=0.9, contrast=12.0, score=3.0
    )  # fmt: skip
    found = photograph.table(SimpleNamespace(found=(), candidates=[shape] * count))
    assert len(found.columns) == 7
    cells = list(found.columns[0].cells)
    assert cells[30:] == (["and 3 more"] if count > 30 else [])


def test_what_takes_long_in_a_plan_says_at_once_that_it_works(monkeypatch, task1):
    """The search, the check of the best and the check of what was varied."""
    said = []

    @contextlib.contextmanager
    def shown(title, unit, at_once=False):
        said.append((unit, at_once))
        yield None

    monkeypatch.setattr(plan, "progress", shown)
    monkeypatch.setattr(planner, "plan", lambda *_, **__: "plan")
    monkeypatch.setattr(plan_check, "check_plan", lambda *_, **__: "checked")
    monkeypatch.setattr(vary_check, "check_varied", lambda *_, **__: "varied")
    assert plan._plan(task1, "distance", {})[0] == "plan"
    found = SimpleNamespace(scene=task1)
    assert (plan._check(found, 3, asked=False), plan._check_varied(found)) == ("checked", "varied")
    assert said == [("steps", True), ("settings", True), ("plans", True)]


@pytest.mark.parametrize("name", ["py.warnings", "trimesh"])
def test_what_libraries_log_is_no_line(name, monkeypatch, capsys):
    """A PLY file that names a texture had its reader's traceback on standard error, and was read."""
    log = logging.getLogger(name)
    for owner, key, value in ((log, "handlers", []), (log, "propagate", True), (logging.root, "handlers", [])):
        monkeypatch.setattr(owner, key, value)
    monkeypatch.setattr(logging, "captureWarnings", lambda _: None)
    verbosity.hush()
    log.warning("unable to load image!")
    assert capsys.readouterr().err == ""
