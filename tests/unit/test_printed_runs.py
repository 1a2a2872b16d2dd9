"""What a run prints, writes and judges is what was measured: made-up measurements, some lost, through the whole job."""

import csv
import functools
import json
import math
import statistics
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

import scenes
import validation
from scenes import Pose
from validation import comparison
from validation.batch import job, result, work
from validation.report import export, figures, page_tables, proof_figures, run_cells, table
from validation.statistics import ALLOWANCE, LEVEL, SHARES

METHODS = ("gradient", "canny@12", "canny@10")
IMAGES, SETTINGS, MEASURANDS = 240, 4, 3
FIELDS = ("empirical", "n", "failed", "ratio", "bias", "rmse", "status")


def made_up(index, rng):
    """Of one setting: predictions, values with some lost, and their statuses; no two numbers alike."""
    sigma = {name: 0.05 * (1 + 0.3 * k + index) for k, name in enumerate(METHODS)}
    sigma |= {f"gradient:{k}": 0.002 * (1 + 0.7 * k + index) for k in range(MEASURANDS)}
    true = dict.fromkeys(METHODS, 90.0 + index) | {f"gradient:{k}": 4.0 + k + 0.1 * index for k in range(MEASURANDS)}
    values, lost = {}, {}
    for j, (name, s) in enumerate(sigma.items()):
        values[name] = true[name] + 0.1 * s * (index + 1) + s * 1.02 * rng.normal(size=IMAGES)
        gone = {0: 0, 1: 1 + j % 2, 2: 2, 3: 40 + j}[index]  # of the last setting more than may be lost
        values[name][7 : 7 + gone] = np.nan
        lost[name] = {int(i): "short" if i % 3 else "low_contrast" for i in range(7, 7 + gone)}
    measurands = [
        {
            "name": f"m{k}", "kind": "width", "unit": "mm", "value": true[f"gradient:{k}"],
            "predicted_bias": 0.0001 * (k + 1) * (-1) ** k, "paper": 1e-6 * (3 + k + index),
            "calibrated": 1e-6 * (5 + 2 * k + index), "bound": 1e-6 * (1 + k + index),
        }
        for k in range(MEASURANDS)
    ]  # fmt: skip
    predicted = {
        "paper": 0.011 * (index + 1), "calibrated": 0.013 * (index + 1), "bound": 0.007 * (index + 1),
        "value_px": 90.0 + index, "predicted_bias": 0.004 * (index - 1), "measurands": measurands,
    }  # fmt: skip
    off = {
        name: {"bias": 0.05 * s * (1 + j), "u": 0.2 * s * (1 + j), "noise": 0.07 * s * (2 + j)}
        for j, (name, s) in enumerate(sigma.items())
    }
    if index % 2:  # in every other setting a simulation told biases
        predicted["corrections"] = {name: off[name] for name in METHODS}
        for k, each in enumerate(measurands):
            each["correction"] = off[f"gradient:{k}"]
    propagated = {name: (s**2, true[name], "ok") for name, s in sigma.items()}
    return SimpleNamespace(sigma=sigma, true=true, values=values, lost=lost, predicted=predicted, propagated=propagated)


@functools.cache
def _scene():
    plate = scenes.load("bracket_mm")
    settings = [
        scenes.Setting(sensor=Pose(20 + i, 100 + 10 * i), light=Pose(40 + 2 * i, 250 + 7 * i), **paper)
        for i, paper in enumerate(({"paper_ice": 0.2, "paper_real": (0.3, 0.4)}, {"paper_ice": 0.5}, {}, {}))
    ]
    update = {"settings": tuple(settings), "measurands": plate.measurands[:MEASURANDS], "same_scale": ()}
    return plate.model_copy(update=update)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A job whose workers measure nothing: its result, and what they said."""
    rng = np.random.default_rng(8)
    told = [made_up(i, rng) for i in range(SETTINGS)]

    def perform(task):
        here, chunks = told[task.case.index], {}
        for number, size in task.chunks:
            some = slice(number * work.CHUNK, number * work.CHUNK + size)
            failures = {name: {i - some.start: state for i, state in lost.items()} for name, lost in here.lost.items()}
            chunks[number] = work.Chunk({n: v[some] for n, v in here.values.items()}, failures, {"measure": 0.5})
        clean = work.Clean(work.Packed.of(np.zeros((4, 6))), here.propagated, here.predicted, {"render": 0.25})
        return work.TaskResult(clean, chunks)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(job.work, "perform", perform)
        patch.setattr(job.work, "effects", lambda *_: [])
        patch.setattr(job.variants, "choose", lambda: "scalar_rgb")
        found = validation.run(_scene(), renders=IMAGES, seed=3, out=tmp_path_factory.mktemp("run"), workers=1)
    return found, told


def expected(values, propagated, true, lost, predicted_bias, off):
    """Everything that is said of one method, from its values and the bias that is taken off."""
    good = [float(v) for v in values if math.isfinite(v)]
    variance, bias = statistics.variance(good), statistics.fmean(good) - true - (off["bias"] if off else 0)
    freedom = len(good) - 1
    low, high = (variance / propagated * freedom / stats.chi2.ppf(q, freedom) for q in (0.975, 0.025))
    states = sorted(lost.values())
    return {
        "propagated": propagated, "empirical": variance, "n": len(values), "failed": len(values) - len(good),
        "failures": {state: states.count(state) for state in states}, "ratio": variance / propagated,
        "ratio_interval": [low, high], "bias": bias, "predicted_bias": 0.0 if off else predicted_bias,
        "correction": off["bias"] if off else 0.0, "u_bias": off["u"] if off else None,
        "render_noise": off["noise"] if off else 0.0,
        "rmse": math.sqrt(variance + bias**2),
        "status": "ok" if len(lost) <= 0.01 * len(values) else max(states, key=states.count),
    }  # fmt: skip


def methods_of(here):
    names = [(name, here.predicted["value_px"], here.predicted["predicted_bias"]) for name in METHODS]
    off = here.predicted.get("corrections", {})
    return [expected(here.values[n], here.sigma[n] ** 2, t, here.lost[n], b, off.get(n)) for n, t, b in names]


def measurands_of(here):
    return [
        expected(here.values[f"gradient:{k}"], here.sigma[f"gradient:{k}"] ** 2, each["value"],
                 here.lost[f"gradient:{k}"], each["predicted_bias"], each.get("correction"))
        for k, each in enumerate(here.predicted["measurands"])
    ]  # fmt: skip


def same(told, wanted):
    """Equal, numbers nearly so."""
    if isinstance(wanted, dict):
        return all(same(told[key], value) for key, value in wanted.items())
    if isinstance(wanted, list | tuple):
        return len(told) == len(wanted) and all(map(same, told, wanted))
    return told == (pytest.approx(wanted, rel=1e-9, abs=1e-15) if isinstance(wanted, float) else wanted)


def test_the_document_says_what_was_measured(run):
    """Each number by `statistics` from the values that are not lost."""
    found, told = run
    document = json.loads(json.dumps(found.to_json(), allow_nan=False))
    scale = statistics.median([0.2 / told[0].predicted["paper"], 0.5 / told[1].predicted["paper"]])
    assert document["paper_scale"] == pytest.approx(scale)
    for row, here, setting in zip(document["settings"], told, _scene().settings, strict=True):
        main, *classic = methods_of(here)
        propagated = main.pop("propagated")
        assert same(row, main)
        assert same(row["classic"], classic)
        assert [each["method"] for each in row["classic"]] == list(METHODS[1:])
        predicted = {"paper": scale * here.predicted["paper"], "calibrated": here.predicted["calibrated"]}
        assert same(row["predicted"], predicted | {"propagated": propagated})
        assert same(row, {key: here.predicted[key] for key in ("bound", "value_px")})
        assert row["sensor"] == list(setting.sensor)
        assert row["light"] == list(setting.light)
        for each, about, numbers in zip(
            row["measurands"], here.predicted["measurands"], measurands_of(here), strict=True
        ):
            numbers = {("predicted" if key == "propagated" else key): v for key, v in numbers.items()}
            for left_out in ("failures", "rmse"):
                numbers.pop(left_out)
            about = {key: value for key, value in about.items() if key not in ("predicted_bias", "correction")}
            assert same(each, numbers | about)
            u = None if numbers["u_bias"] is None else math.hypot(numbers["predicted"] ** 0.5, numbers["u_bias"])
            assert same(each, {"u": u})
    assert document["seconds"]["measure"] == pytest.approx(0.5 * SETTINGS)
    assert document["seconds"]["render"] == pytest.approx(0.25 * SETTINGS)


def test_the_verdict_is_about_the_measurands_that_were_measured(run):
    """Counts, p-values, pooled ratio and mean errors by hand; the setting with lost images is not judged."""
    found, told = run
    rows, biases, weights, ratios = [], [], [], []
    for here in told:
        together = np.array([here.values[f"gradient:{k}"] for k in range(MEASURANDS)])
        rho = np.corrcoef(together[:, np.isfinite(together).all(0)])
        share = MEASURANDS / (rho**2).sum()
        for each in measurands_of(here):
            if each["failed"] > 0.01 * IMAGES:
                continue
            n = each["n"] - each["failed"]
            law = stats.chi2(n - 1)
            x = each["ratio"] * (n - 1)
            rows.append(2 * min(law.cdf(x), law.sf(x)))
            ratios.append(each["ratio"])
            weights.append(share * (n - 1))
            u = math.hypot(math.sqrt(each["propagated"]), each["u_bias"] or 0.0)
            away = abs(each["bias"] - each["predicted_bias"]) / u
            error = math.hypot(math.sqrt(each["propagated"] / n), each["render_noise"]) / u
            tails = stats.norm.sf([(away - ALLOWANCE) / error, (away + ALLOWANCE) / error])
            biases.append((away, min(1.0, tails.sum())))
    v = found.verdict
    assert (v.rows, v.not_measured) == (len(rows), SETTINGS * MEASURANDS - len(rows)) == (9, 3)
    assert v.inside == sum(p >= 0.05 for p in rows)
    assert v.smallest_p == pytest.approx(min(rows))
    assert v.limit == pytest.approx(1 - (1 - LEVEL * SHARES["rows"]) ** (1 / 9))
    assert v.pooled.ratio == pytest.approx(np.average(ratios, weights=weights))
    freedom = int(sum(weights))
    x = v.pooled.ratio * freedom
    assert v.pooled.p_value == pytest.approx(2 * min(stats.chi2.cdf(x, freedom), stats.chi2.sf(x, freedom)))
    assert v.bias.largest == pytest.approx(max(away for away, _ in biases))
    assert v.bias.smallest_p == pytest.approx(min(p for _, p in biases))
    for name in METHODS[1:]:
        of = [methods_of(here)[METHODS.index(name)] for here in told]
        good = [each for each in of if each["failed"] <= 0.01 * IMAGES]
        told_of = found.classic_verdicts[name]
        assert (told_of.rows, told_of.not_measured) == (len(good), len(of) - len(good))
        free = [each["n"] - each["failed"] - 1 for each in good]
        assert told_of.pooled.ratio == pytest.approx(np.average([e["ratio"] for e in good], weights=free))


def test_correlations_are_of_the_columns_that_they_name(run):
    found, told = run
    measured = [methods_of(here)[0]["empirical"] for here in told]
    columns = {
        "paper": [here.predicted["paper"] for here in told],
        "calibrated": [here.predicted["calibrated"] for here in told],
        "propagated": [here.sigma["gradient"] ** 2 for here in told],
    }
    for name, column in columns.items():
        pair = found.correlation[f"{name}_with_empirical"]
        assert pair["pearson"] == pytest.approx(np.corrcoef(column, measured)[0, 1])
        assert pair["rows"] == SETTINGS


def of_terminal(made, title):
    """Headings and rows of the table whose title begins so; of headings on two lines the second."""
    shown = next(t for t in made.renderables if str(getattr(t, "title", "")).strip().startswith(title))
    return [str(c.header).split("\n")[-1] for c in shown.columns], list(
        zip(*(c.cells for c in shown.columns), strict=True)
    )


def interval(each):
    low, high = each["ratio_interval"]
    return f"{each['ratio']:.3f} [{low:.3f}, {high:.3f}]{' ' if low <= 1 <= high else '*'}"


def poses(index):
    setting = _scene().settings[index]
    return [f"({pose.polar_deg:.1f}, {pose.azimuth_deg:.1f})" for pose in (setting.sensor, setting.light)]


def shifts(main):
    off = main["predicted_bias"] if main["u_bias"] is None else main["correction"]
    return [f"{off:+.4f}", f"{main['bias']:+.4f}", f"{main['rmse']:.4f}"]


def variances_of(here):
    numbers = [here.predicted["calibrated"], here.sigma["gradient"] ** 2]
    numbers += [each["empirical"] for each in methods_of(here)] + [here.predicted["bound"]]
    return [f"{v / 1e-4:#.3g}" for v in numbers]


def units_of(here):
    for about, each in zip(here.predicted["measurands"], measurands_of(here), strict=True):
        sigmas = (about["calibrated"], each["propagated"], each["empirical"])
        yield [about["name"], f"{about['value']:.6g}", "mm", *(f"{v**0.5:.3g}" for v in sigmas), interval(each),
               f"{each['bias']:+.2g}", "-" if each["u_bias"] is None else f"{each['u_bias']:.2g}",
               each["status"]]  # fmt: skip


def test_the_terminal_s_tables_are_the_document_s_numbers(run):
    """Cell by cell under its heading: variances, ratios, and measurands in their unit."""
    found, told = run
    made = table.report(found)
    headings, rows = of_terminal(made, "Table 3: variance")
    scale = found.paper_scale
    assert headings == ["sensor", "light", "ICE", "ICE", "paper", "12.0", "10.0", "calibrated", "propagated",
                        *METHODS, "bound"]  # fmt: skip
    real = [["0.200", "0.300", "0.400"], ["0.500", "-", "-"], ["-"] * 3, ["-"] * 3]
    for index, (row, here) in enumerate(zip(rows, told, strict=True)):
        ours = scale * here.predicted["paper"]
        against = f"{ours / float(real[index][0]):.3f}" if index < 2 else "-"
        printed = [real[index][0], f"{ours:.3f}", against, *real[index][1:]]
        assert list(row) == [*poses(index), *printed, *variances_of(here)]
    headings, rows = of_terminal(made, "Measured / propagated")
    assert headings == ["sensor", "light", *METHODS, "n", "failed", "off", "left", "rmse px", "status"]
    for index, (row, here) in enumerate(zip(rows, told, strict=True)):
        main, *others = all_ = methods_of(here)
        lost = " ".join(str(each["failed"]) for each in all_)
        cells = [*map(interval, all_), str(IMAGES), lost, *shifts(main), main["status"]]
        assert list(row) == [*poses(index), *cells]
        assert len(others) == 2
    headings, rows = of_terminal(made, "All measurands")
    assert headings == ["sensor", "light", "measurand", "value", "unit", "calibrated", "propagated", "measured",
                        "ratio", "left", "u(bias)", "status"]  # fmt: skip
    wanted = [[*poses(i), *cells] for i, here in enumerate(told) for cells in units_of(here)]
    assert list(map(list, rows)) == wanted


def test_the_report_s_tables_are_the_document_s_numbers(run):
    found, told = run
    ratios, variances, units = page_tables.ratios(found), page_tables.variances(found), page_tables.units(found)
    assert ratios.columns[3:] == ["gradient: measured / predicted [95 %]", "images", "failed", "bias, px: taken off",
                                  "left", "rmse, px", "status"]  # fmt: skip
    for index, here in enumerate(told):
        main = methods_of(here)[0]
        lost = " ".join(str(each["failed"]) for each in methods_of(here))
        cells = [interval(main), str(IMAGES), lost, *shifts(main), main["status"]]
        assert ratios.rows[index] == [str(index + 1), *poses(index), *cells]
        assert variances.rows[index][-len(METHODS) - 3 :] == variances_of(here)
    assert variances.columns[-len(METHODS) - 3 :] == ["calibrated", "propagated", "measured: gradient",
                                                     *METHODS[1:], "Cramer-Rao bound"]  # fmt: skip
    assert units.rows == [[str(i + 1), *poses(i), *cells] for i, here in enumerate(told) for cells in units_of(here)]
    lines = page_tables.estimators(found)
    for row, (name, v) in zip(lines.rows, [("gradient", found.verdict), *found.classic_verdicts.items()], strict=True):
        told_of = dict(zip(lines.columns, row, strict=False))
        assert told_of["estimator"].startswith(name)
        assert told_of["rows inside 95 %"] == f"{v.inside} of {v.rows}"
        assert row[2:4] == [f"{v.smallest_p:.2g}", f"{v.limit:.2g}"]
        assert row[4].startswith(f"{v.pooled.ratio:.3f} [{v.pooled.interval[0]:.3f}, {v.pooled.interval[1]:.3f}]")
        assert row[5:7] == [f"{v.pooled.p_value:.2g}", f"{v.pooled.limit:.2g}"]
        assert row[7:10] == [f"{v.bias.largest:.2f}", f"{v.bias.smallest_p:.2g}", f"{v.bias.limit:.2g}"]
        assert told_of["not measured"] == str(v.not_measured)


def test_the_csv_of_measurands_is_the_document_s(run, tmp_path):
    found, told = run
    with export.write_measurands(found, tmp_path / "m.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    wanted = [(i, about, each) for i, here in enumerate(told)
              for about, each in zip(here.predicted["measurands"], measurands_of(here), strict=True)]  # fmt: skip
    for line, (index, about, each) in zip(lines, wanted, strict=True):
        setting = _scene().settings[index]
        about = {key: value for key, value in about.items() if key != "correction"}
        numbers = about | {
            "correction": each["correction"], "predicted_bias": each["predicted_bias"],
            "index": index, "sensor_polar": setting.sensor.polar_deg, "sensor_azimuth": setting.sensor.azimuth_deg,
            "light_polar": setting.light.polar_deg, "light_azimuth": setting.light.azimuth_deg, "n": each["n"],
            "predicted": each["propagated"], "empirical": each["empirical"], "failed": each["failed"],
            "ratio": each["ratio"], "ratio_low": each["ratio_interval"][0], "ratio_high": each["ratio_interval"][1],
            "bias": each["bias"],
        }  # fmt: skip
        for key, value in numbers.items():
            assert line[key] == value if isinstance(value, str) else float(line[key]) == pytest.approx(value), key
        assert line["status"] == each["status"]


def test_the_csv_of_settings_is_the_document_s(run, tmp_path):
    """Poses, what is predicted, and every method's numbers, each under its own name."""
    found, told = run
    with export.write_csv(found, tmp_path / "t.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    scale = statistics.median([0.2 / told[0].predicted["paper"], 0.5 / told[1].predicted["paper"]])
    for line, here, setting in zip(lines, told, _scene().settings, strict=True):
        wanted = {
            "sensor_polar": setting.sensor.polar_deg, "sensor_azimuth": setting.sensor.azimuth_deg,
            "light_polar": setting.light.polar_deg, "light_azimuth": setting.light.azimuth_deg,
            "paper_ice": setting.paper_ice, "our_ice": scale * here.predicted["paper"],
            "paper_real_12": (setting.paper_real or (None, None))[0],
            "paper_real_10": (setting.paper_real or (None, None))[1],
            "calibrated": here.predicted["calibrated"], "bound": here.predicted["bound"],
        }  # fmt: skip
        for name, each in zip(METHODS, methods_of(here), strict=True):
            low, high = each["ratio_interval"]
            numbers = {
                "propagated": each["propagated"], "empirical": each["empirical"], "n": each["n"],
                "failed": each["failed"], "ratio": each["ratio"], "ratio_low": low, "ratio_high": high,
                "bias_px": each["bias"], "predicted_bias_px": each["predicted_bias"], "rmse_px": each["rmse"],
                "correction_px": each["correction"], "u_bias_px": each["u_bias"],
            }  # fmt: skip
            wanted |= {f"{name}_{key}": value for key, value in numbers.items()}
            assert line[f"{name}_status"] == each["status"]
        for key, value in wanted.items():
            assert (line[key] == "") if value is None else float(line[key]) == pytest.approx(value), key


def test_of_many_settings_those_farthest_from_their_prediction_are_shown(run, monkeypatch):
    """By the logarithm of the ratio: 1/2 is as far as 2."""
    found, told = run
    monkeypatch.setattr(result, "SHOWN", 2)
    found = replace(found)  # looked through anew
    away = [abs(math.log(methods_of(here)[0]["ratio"])) for here in told]
    assert [row.index for row in run_cells.far(found)[0]] == sorted(range(SETTINGS), key=lambda i: -away[i])[:2]


def counted_by_hand(values):
    """Of standardised values how many lie in each quarter of a sigma, those beyond 5 in the outermost."""
    counts = [0] * 40
    for z in values:
        counts[min(max(math.floor((z + 5) * 4), 0), 39)] += 1
    return counts


def test_standardised_values_are_counted_requirement_by_requirement(run):
    """Each setting's values less their mean over the predicted sigma of that requirement, one far off among them."""
    found, told = run
    kept = {(i, name): values for i, here in enumerate(told) for name, values in here.values.items()}
    kept[0, "gradient:0"] = np.append(kept[0, "gradient:0"], told[0].true["gradient:0"] + 1.0)
    store = SimpleNamespace(distances=lambda index, method: kept[index, method])
    made = proof_figures.standardised(found, store)
    assert list(made) == [f"m{k}" for k in range(MEASURANDS)]
    for k in range(MEASURANDS):
        every = []
        for i, here in enumerate(told):
            values = [v for v in kept[i, f"gradient:{k}"] if math.isfinite(v)]
            every += [(v - statistics.fmean(values)) / here.sigma[f"gradient:{k}"] for v in values]
        assert made[f"m{k}"].tolist() == counted_by_hand(every)
    assert made["m0"][-1] >= 1


def test_two_values_are_enough_to_stand_off_their_mean(run):
    """One stands off itself by nothing: it is not counted."""
    found, told = run
    some = {0: 2, 1: 1, 2: 0, 3: 3}
    kept = {i: here.values["gradient:1"][np.isfinite(here.values["gradient:1"])][: some[i]]
            for i, here in enumerate(told)}  # fmt: skip
    made = proof_figures.standardised(found, SimpleNamespace(distances=lambda index, method: kept[index]))
    assert made["m1"].sum() == 5


def test_lines_of_the_forest_are_the_documents_rows(run):
    """Ratio, interval, bias and its standard error of each requirement and setting, by requirement."""
    found, told = run
    lines = proof_figures.lines_of(found, {"m1": 0.25})
    assert [(line.name, line.setting) for line in lines] == [
        (f"m{k}", i + 1) for k in range(MEASURANDS) for i in range(SETTINGS)
    ]
    for line in lines:
        wanted = measurands_of(told[line.setting - 1])[line.number - 1]
        good = wanted["n"] - wanted["failed"]
        assert [line.low, line.high] == pytest.approx(wanted["ratio_interval"])
        assert (line.ratio, line.bias) == (pytest.approx(wanted["ratio"]), pytest.approx(wanted["bias"]))
        assert line.error == pytest.approx(math.hypot(math.sqrt(wanted["empirical"] / good), wanted["render_noise"]))
        assert line.half == (0.25 if line.name == "m1" else None)
        inside = wanted["ratio_interval"][0] <= 1 <= wanted["ratio_interval"][1]
        assert line.grade == ("open" if wanted["status"] != "ok" else "inside" if inside else "outside")


def test_the_figure_shows_variances_and_their_intervals(run, monkeypatch):
    """Points at (predicted, measured), bars from the one end of the interval to the other."""
    found, told = run
    drawn = []
    monkeypatch.setattr(figures, "save", lambda figure, path: drawn.append(figure) or path)
    figures._agreement(found, None)
    for axis, factor in zip(drawn[0].axes, (None, 1.0), strict=True):
        points = axis.containers[0].lines[0].get_xydata()
        bars = axis.containers[0].lines[2][0].get_segments()
        for point, bar, here in zip(points, bars, told, strict=True):
            main = methods_of(here)[0]
            scale = factor or main["propagated"]
            assert point == pytest.approx([main["propagated"], scale * main["ratio"]])
            assert bar[:, 1] == pytest.approx([scale * end for end in main["ratio_interval"]])
    crosses = drawn[0].axes[0].lines
    calibrated = next(line for line in crosses if str(line.get_label()).startswith("calibrated"))
    assert calibrated.get_xdata() == pytest.approx([here.predicted["calibrated"] for here in told])
    bound = next(line for line in crosses if str(line.get_label()).startswith("Cramer"))
    assert bound.get_xdata() == pytest.approx([here.predicted["bound"] for here in told])
    equal = next(line for line in crosses if str(line.get_label()).startswith("predicted ="))
    ends = [
        0.9 * min(here.predicted["bound"] for here in told),
        1.2 * max(here.sigma["gradient"] ** 2 for here in told),
    ]
    assert equal.get_xdata().tolist() == equal.get_ydata().tolist() == pytest.approx(ends)
    figures.plt.close(drawn[0])


def test_two_runs_are_compared_by_what_is_not_lost(run):
    """F, Welch and Fisher of the same numbers, one of the runs with a doubled variance, another mean, more lost."""
    before = run[0].to_json()
    after = json.loads(json.dumps(before))
    for row in after["settings"]:
        for judged in (row, *row["classic"]):
            judged["empirical"], judged["bias"] = 2 * judged["empirical"], judged["bias"] + 0.05
            judged["failed"] += 30
    told = comparison.compare(before, after, level=0.999999)
    assert (told.settings, told.tests) == (SETTINGS, SETTINGS * len(METHODS) * 3)
    by = {(c.setting, c.method, c.what): c for c in told.changed}
    assert len(by) > 20
    for row, other in zip(before["settings"], after["settings"], strict=True):
        name = f"bracket_mm sensor ({row['sensor'][0]:g}, {row['sensor'][1]:g}) light ({row['light'][0]:g}, "
        name += f"{row['light'][1]:g})"
        for a, b in zip((row, *row["classic"]), (other, *other["classic"]), strict=True):
            n, m = a["n"] - a["failed"], b["n"] - b["failed"]
            x, s, t = a["empirical"] / b["empirical"], a["empirical"] / n, b["empirical"] / m
            law = stats.f(n - 1, m - 1)
            welch = stats.t((s + t) ** 2 / (s**2 / (n - 1) + t**2 / (m - 1)))
            wanted = {
                "variance": (a["empirical"], b["empirical"], 2 * min(law.cdf(x), law.sf(x))),
                "mean": (a["bias"], b["bias"], 2 * welch.sf(abs(a["bias"] - b["bias"]) / math.sqrt(s + t))),
                "failed": (a["failed"], b["failed"], stats.fisher_exact([[a["failed"], n], [b["failed"], m]]).pvalue),
            }
            for what, (old, new, p) in wanted.items():
                found = by.get((name, a["method"], what))
                assert found is not None, (name, what)
                assert (found.before, found.after, found.p_value) == pytest.approx((old, new, p), rel=1e-6)


def test_of_a_run_that_was_killed_early_no_time_is_known(run):
    """What was measured until then is told all the same."""
    found, told = run
    scene = _scene()
    store = SimpleNamespace(
        identity=lambda: {"seed": 3, "variant": "scalar_rgb"}, fact=lambda name, default: default,
        seconds=lambda: {"render": 1.5}, predicted=lambda i: told[i].predicted if i != 1 else None,
        trouble=lambda i: None, propagated=lambda i, name: told[i].propagated[name],
        distances=lambda i, name: told[i].values[name], failures=lambda i, name: {},
    )  # fmt: skip
    early = result.collect(result.Campaign.of(scene), store)
    assert early.seconds == {"wall": 0.0, "workers": 0, "render": 1.5}
    assert early.machines == ()
    assert early.refused == {1: "not yet worked on"}
    assert [row.index for row in early.rows] == [0, 2, 3]
    assert [row.main.ratio for row in early.rows] == [found.rows[i].main.ratio for i in (0, 2, 3)]
