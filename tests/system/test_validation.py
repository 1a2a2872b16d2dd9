"""The batch job end to end, on a reduced Table 3: verdict, negative control, workers, resumption."""

import json
import sqlite3

import numpy as np
import pytest

import measure
import render
import scenes
import validation
from render import variant
from scenes import InvalidInput
from validation.batch import machine, work
from validation.batch.campaign import Campaign, Grid
from validation.batch.store import RunFile
from validation.batch.work import measure_chunk

pytestmark = pytest.mark.render


@pytest.fixture(scope="module")
def few(task1):
    """Four of the 16 settings, one a sensor position."""
    return task1.model_copy(update={"settings": task1.settings[1::4]})


@pytest.fixture(scope="module")
def found(few, tmp_path_factory):
    return validation.run(few, renders=500, seed=11, out=tmp_path_factory.mktemp("run"), workers=1)


def test_a_run_shows_itself(found):
    """One line, and one row a setting and measurand with the numbers of the table."""
    assert repr(found) == "Validation(task1: 4 settings, agree: measured is as predicted)"
    rows = found.as_rows()
    assert [(row["sensor_polar"], row["light_azimuth"]) for row in rows] == [
        (row.sensor[0], row.light[1]) for row in found.rows
    ]
    told = found.rows[0].measurands[0]
    assert (rows[0]["empirical"], rows[0]["ratio_low"], rows[0]["ratio_high"]) == (
        told.empirical,
        *told.ratio_interval,
    )


def test_predictions_agree(found):
    assert found.verdict.agrees
    assert found.verdict.rows == 4
    for row in found.rows:
        assert row.main.failed == 0
        assert row.main.n == 500
        assert row.bound < row.main.empirical  # margin: a bound is below every variance, by its kind
        # margin: the claim: both models agree to 3 % on Task1
        assert row.calibrated == pytest.approx(row.main.propagated, rel=0.03)
        # margin: 4 standard errors and a hundredth of a pixel
        assert abs(row.main.bias) < 0.01 + 4 * np.sqrt(row.main.empirical / row.main.n)


def test_wrong_predictions_are_rejected_by_the_same_verdict(found):
    """Negative control: predictions 1.3 x too large, 1.3 x too small, and nearly 0."""
    counts = [row.main.n for row in found.rows]
    for factor in (1.3, 1 / 1.3, 1e-6):
        ratios = [row.main.empirical / (factor * row.main.propagated) for row in found.rows]
        assert not validation.verdict(ratios, counts).agrees


def test_independent_errors_would_be_rejected(found, few):
    """What the paper assumes: edge points 1 px apart with independent errors. They are correlated over 3.5 px."""
    correlation_length = 2 * np.sqrt(np.pi) * few.locator.scale_px
    ratios = [correlation_length * row.main.empirical / row.calibrated for row in found.rows]
    assert not validation.verdict(ratios, [row.main.n for row in found.rows]).agrees


def test_json_document(found):
    document = json.loads(json.dumps(found.to_json(), allow_nan=False))
    row = document["settings"][0]
    assert {"sensor", "light", "paper_ice", "paper_real", "predicted", "empirical", "n", "failed", "ratio"} <= set(row)
    assert {"ratio_interval", "bound", "status"} <= set(row)
    assert set(row["predicted"]) == {"paper", "calibrated", "propagated"}
    assert row["ratio"] == pytest.approx(row["empirical"] / row["predicted"]["propagated"])
    assert {"scene", "seed", "settings", "correlation", "verdict", "seconds"} <= set(document)


def numbers(result):
    return [[judged.empirical for judged in (row.main, *row.classic)] for row in result.rows]


def test_any_number_of_workers_gives_the_same_numbers(few, found, tmp_path):
    again = validation.run(few, renders=500, seed=11, out=tmp_path, workers=2)
    assert numbers(again) == numbers(found)


def test_another_seed_gives_other_numbers(few, found, tmp_path):
    one = few.model_copy(update={"settings": few.settings[:1]})
    other = validation.run(one, renders=50, seed=12, out=tmp_path, workers=1)
    assert other.rows[0].main.empirical != found.rows[0].main.empirical


def test_interrupted_run_continues_with_the_same_numbers(few, found, tmp_path):
    class Stop(Exception):
        pass

    def stop_midway(_what, done, total):
        if done > total / 3:
            raise Stop

    with pytest.raises(Stop):
        validation.run(few, renders=500, seed=11, out=tmp_path, workers=1, progress=stop_midway)
    before = RunFile.reopen(tmp_path)
    assert 0 < before.images() < 2000
    before.close()
    assert numbers(validation.run(few, renders=500, seed=11, out=tmp_path, workers=1)) == numbers(found)


def test_a_run_says_on_which_machine_it_was_begun_and_where_it_was_continued(few, tmp_path, monkeypatch, caplog):
    """Another processor rounds otherwise: one line says so, once; the same with more cores says nothing."""
    one, here = few.model_copy(update={"settings": few.settings[:1]}), machine.here()
    assert here["processor"]
    assert here["blas"]
    for elsewhere in ({"cores": 1000}, {"blas": "Prescott", "embree": "SSE4.2"}, {"blas": "Prescott"}, {}):
        monkeypatch.setattr(machine, "here", lambda there=here | elsewhere: there)
        found = validation.run(one, renders=4, seed=11, out=tmp_path, workers=1)
    other, third = here | {"blas": "Prescott", "embree": "SSE4.2"}, here | {"blas": "Prescott"}
    assert found.to_json()["machines"] == [here | {"cores": 1000}, other, third]
    assert [record.getMessage() for record in caplog.records if record.levelname == "WARNING"] == [
        f"begun on {machine.named(here)}; continued on {machine.named(there)}: the same but for rounding, "
        "not to the last bit"
        for there in (other, third)
    ]


def test_what_is_predicted_is_what_is_measured(task1):
    """The same lines from the same pixels, one image; knowing the light does not move the ends of the lines."""
    case = Campaign.of(task1).case(10)
    clean = work.render_setting(case, variant.choose())
    image, sensor = clean.image.array(), case.setting.sensor
    response = measure.propagate(image, task1, sensor).response
    chunk = measure_chunk(case, image, 1, 0, 200)
    pictures = render.expose(
        image, task1.noise, np.random.default_rng(np.random.SeedSequence(1, spawn_key=(10, 0, 0))), 50
    )
    linear = np.einsum("nij,ij->n", pictures - image, response)
    measured = chunk.distances["gradient"][:50]
    assert np.corrcoef(linear, measured)[0, 1] > 0.999  # margin: a correlation, which is 1 at most
    noise = render.variance(image, task1.noise)
    assert clean.propagated["gradient"][0] == pytest.approx(float((noise * response**2).sum()), rel=1e-9)
    known = measure.propagate(image, task1, sensor, case.setting.light).variance_px2
    assert known == pytest.approx(clean.propagated["gradient"][0], rel=1e-12)
    # margin: 5 % is what other weights change
    assert abs(clean.propagated["canny@12"][0] / known - 1) > 0.02  # negative control: other weights on the same pixels


def test_directory_of_another_run_is_refused(few, tmp_path):
    one = few.model_copy(update={"settings": few.settings[:1]})
    validation.run(one, renders=20, seed=1, out=tmp_path, workers=1)
    refused = r"--out must be a new directory or hold this run, got .*, where {} \(--fresh starts anew\)"
    with pytest.raises(InvalidInput, match=refused.format("seed is 1, not 2")):
        validation.run(one, renders=20, seed=2, out=tmp_path, workers=1)
    noisier = one.model_copy(update={"noise": one.noise.model_copy(update={"sigma": 3.0})})
    with pytest.raises(InvalidInput, match=refused.format(r"campaign.scenes\[0\].noise.sigma is 2.4, not 3.0")):
        validation.run(noisier, renders=20, seed=1, out=tmp_path, workers=1)
    with pytest.raises(InvalidInput, match=refused.format('effects is "auto", not "floor"')):
        validation.run(one, renders=20, seed=1, out=tmp_path, workers=1, effects="floor")
    assert validation.run(one, renders=20, seed=2, out=tmp_path, workers=1, fresh=True).seed == 2


def test_every_failed_measurement_is_a_row(task1, tmp_path):
    """Exposure so low that canny's gradient threshold is reached only now and then."""
    dim = task1.model_copy(update={
        "camera": task1.camera.model_copy(update={"exposure": 40.0}), "settings": task1.settings[4:5], "same_scale": ()
    })  # fmt: skip
    result = validation.run(dim, renders=100, seed=3, out=tmp_path, workers=1)
    strict, loose = result.rows[0].classic
    assert strict.failed > 0
    assert strict.failed >= loose.failed
    db = sqlite3.connect(tmp_path / "run.sqlite")
    stored = db.execute("SELECT SUM(count) FROM failure WHERE method = ?", (strict.method,)).fetchone()[0]
    db.close()
    assert stored == strict.failed == sum(strict.failures.values())


def test_partial_noise_gives_the_numbers_of_full_frames(few):
    """The batch draws noise only where it is looked at; full frames measured directly give the same distances."""
    setting = few.settings[0]
    image = render.image(few, setting.sensor, setting.light)
    chunk = measure_chunk(Campaign.of(few).case(0), image, 11, 0, 20)
    rng = np.random.default_rng(np.random.SeedSequence(11, spawn_key=(0, 0, 0)))
    full = measure.distance(render.expose(image, few.noise, rng, 20), few, setting.sensor)
    assert (chunk.distances["gradient"] == full.value_px).all()


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ({"renders": 1}, "renders must be at least 2, got 1"),
        ({"seed": -1}, "seed must be at least 0, got -1"),
        ({"workers": 0}, "workers must be at least 1, got 0"),
    ],
)
def test_bad_arguments(few, tmp_path, arguments, line):
    with pytest.raises(InvalidInput, match=line):
        validation.run(few, out=tmp_path, **arguments)


def test_scene_without_settings(tmp_path):
    empty = scenes.load("task1").model_copy(update={"settings": ()})
    with pytest.raises(InvalidInput, match="settings must be a list of at least one"):
        validation.run(empty, out=tmp_path)


def test_setting_that_cannot_be_is_told_of_and_the_others_are_worked_on(few, tmp_path):
    """A camera 6 cm from the origin: at one of the two poses it would stand in the block."""
    grid = Grid(sensor_polar=(25, 80), sensor_azimuth=(45,), light_polar=(15,), light_azimuth=(0,))
    camera = few.camera.model_copy(update={"distance": 6.0, "focal_px": 20.0})
    near = few.model_copy(update={"camera": camera, "same_scale": ()})
    result = validation.run(
        Campaign(name="near", scenes=(near,), grid=grid), renders=20, seed=1, out=tmp_path, workers=1
    )
    assert [row.index for row in result.rows] == [0]
    assert result.refused == {1: "sensor must be outside the object, got (80, 45) at 6 cm"}
    only = grid.model_copy(update={"sensor_polar": (80.0,)})
    with pytest.raises(InvalidInput, match="sensor must be outside the object"):
        validation.run(Campaign(name="near", scenes=(near,), grid=only), renders=20, out=tmp_path / "only", workers=1)
