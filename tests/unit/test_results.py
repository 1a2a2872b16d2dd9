"""What results show of themselves: one line, a table in a notebook, rows, a data frame."""

import math
import re
import sys

import numpy as np
import pytest

import measure
import planner
import scenes
from planner.uncertainty import Input, budget

POSES = (30, 135), (15, 315)


@pytest.fixture(scope="module")
def results(task1):
    """One of each kind; the picture is no render, for what is shown of it does not matter."""
    dark = np.zeros((2, task1.camera.height, task1.camera.width))
    plate = planner.predict(scenes.load("plate"), (30, 80), (35, 335))
    known = scenes.Uncertainty(sensor_distance=0.1)
    return {
        "Prediction": plate,
        "Plan": planner.plan(task1, step_deg=30),
        "Measurement": measure.distance(dark, task1, *POSES),
        "Measurements": measure.measure(dark, task1, *POSES, "gradient"),
        "SceneBudget": planner.budget(task1.model_copy(update={"uncertainty": known}), *POSES),
        "Map": planner.pose_map(task1, sensor=POSES[0], space=planner.ViewingSpace(30), biased=False),
        "Views": planner.plan_views(task1, 2, step_deg=30, refined=False),
        "Budget": budget("<b>", "um", 200.0, [Input("repeats", 0.0, 3.0)], {"repeats": 1.0}),
    }


def test_one_line(results):
    for kind, found in results.items():
        text = repr(found)
        assert text.startswith(f"{kind}(")
        assert "\n" not in text
        assert len(text) < 160


def test_the_line_has_the_key_numbers(task1, results):
    found = planner.predict(task1, *POSES)
    sigma = math.sqrt(found.variance_object)
    assert repr(found) == f"Prediction(calibrated: distance {found.value_object:.4f} +- {sigma:.4f} cm, ok)"
    assert "hole to corner" in repr(results["Prediction"])
    assert repr(results["Budget"]) == "Budget(<b> 200.0 +- 5.9 um, k = 1.96, 1 sources)"
    plan = results["Plan"]
    assert f"sensor ({plan.sensor.polar_deg:.1f}, {plan.sensor.azimuth_deg:.1f})" in repr(plan)
    assert repr(results["Measurement"]) == "Measurement(2 images, 0 ok)"


def test_tables_escape_what_they_show(results):
    shown = results["Budget"]._repr_html_()
    assert "<b>" not in shown
    assert "&lt;b&gt;" in shown
    assert shown.count("<tr>") == 2


def test_a_notebook_shows_fifty_rows(task1):
    dark = np.zeros((60, task1.camera.height, task1.camera.width))
    shown = measure.distance(dark, task1, *POSES)._repr_html_()
    assert shown.count("<tr>") == 51
    assert "and 10 rows more" in shown


def test_rows(results):
    counts = {kind: len(found.as_rows()) for kind, found in results.items()}
    assert counts == {**counts, "Prediction": 5, "Measurement": 2, "Measurements": 2, "Budget": 1}
    assert counts["Plan"] == len(results["Plan"].candidates)
    for found in results.values():
        for row in found.as_rows():
            assert all(not isinstance(v, float) or math.isfinite(v) for v in row.values())
    first = results["Prediction"].as_rows()[0]
    told = results["Prediction"].measurands[0]
    assert first["sigma"] == pytest.approx(math.sqrt(told.variance_object))
    assert first["plus"] == told.tolerance.plus


def test_rows_say_of_which_scene_and_from_where_they_are(results):
    """Each row with its own poses; None where nobody said where the light is."""
    for kind in ("Measurement", "Measurements", "SceneBudget"):
        for row in results[kind].as_rows():
            assert list(row.values())[:5] == ["task1", 30.0, 135.0, 15.0, 315.0]
    columns = ["scene", "sensor_polar", "sensor_azimuth", "light_polar", "light_azimuth"]
    for kind in ("Prediction", "Plan", "Measurement", "Measurements", "SceneBudget", "Map"):
        assert all(list(row)[:5] == columns for row in results[kind].as_rows())
    assert list(results["Prediction"].as_rows()[3].values())[:5] == ["plate", 30.0, 80.0, 35.0, 335.0]
    there = results["Map"]
    rows = there.as_rows()
    assert [(row["light_polar"], row["light_azimuth"]) for row in rows] == list(map(tuple, there.space.poses))
    assert {(row["sensor_polar"], row["sensor_azimuth"]) for row in rows} == {POSES[0]}


def test_lights_that_nobody_told_of_are_none(task1):
    one, two = (scenes.Picture.of(scenes.load(name), POSES[0]).row for name in ("task1", "two_lights"))
    assert (one["light_polar"], one["light_azimuth"]) == (None, None)
    assert two["lights"] is None


def test_to_frame_without_pandas(results, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(scenes.InvalidInput, match=r"pandas must be installed for to_frame \(.*\), got none"):
        results["Plan"].to_frame()


def test_to_frame(results):
    pandas = pytest.importorskip("pandas", reason="the extra `frames`, which `make test` installs")
    for found in results.values():
        frame = found.to_frame()
        assert isinstance(frame, pandas.DataFrame)
        assert frame.shape == (len(found.as_rows()), len(found.as_rows()[0]))
    assert results["Measurement"].to_frame()["value_px"].dtype == float
    views = results["Views"].to_frame()
    assert views.groupby("pictures").size().to_dict() == {1: 1, 2: 2}
    assert views["sigma"].iloc[0] == views["sigma_alone"].iloc[0] > views["sigma"].iloc[1]
    last = results["Views"].sets[-1].views[-1]
    assert list(views.iloc[-1][["sensor_polar", "sensor_azimuth", "light_polar", "light_azimuth", "name"]]) == [
        *last.sensor, *last.light, "distance",
    ]  # fmt: skip


def test_a_notebook_shows_pictures_once_validation_is_there(results, task1, monkeypatch):
    """Of scene, picture and each result with a picture, its SVG; without `validation` the rows alone."""
    import validation

    assert validation._drawn in scenes.results.DRAW
    picture = scenes.Picture.of(task1, *POSES)
    pictured = [task1, picture, *(results[kind] for kind in ("Prediction", "Plan", "Measurement", "SceneBudget"))]
    for found in pictured:
        shown = found._repr_html_()
        assert shown.count('<svg role="img"') == 1
        assert "<table>" in shown
    assert "What is measured, drawn from the model. 1 distance: no tolerance given" in picture._repr_html_()
    assert results["Views"]._repr_html_().count('<svg role="img"') == 3  # from above, and both pictures
    assert "<svg" not in results["Budget"]._repr_html_()
    assert "<svg" not in picture.unlit()._repr_html_()
    one, two = (re.findall(r'id="(n\d+)-', picture._repr_html_())[0] for _ in range(2))
    assert one != two
    monkeypatch.setattr(scenes.results, "DRAW", [])
    assert all("<svg" not in found._repr_html_() for found in pictured)


def test_a_scene_that_asks_for_nothing_is_shown(task1):
    shown = task1.model_copy(update={"task": None, "title": "<i>x</i>"})._repr_html_()
    assert "&lt;i&gt;x&lt;/i&gt;" in shown
    assert "<i>" not in shown
