"""What a hostile trial once tried, each as a case: one line, no traceback, no hang, no memory."""

import json
import os
import re
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
import zlib
from pathlib import Path

import numpy as np
import pytest
import trimesh

import measure
import planner
import render
import scenes
import validation
from scenes import InvalidInput, Noise
from scenes.files.door import read_toml
from scenes.load import BUNDLED
from scenes.parts import mesh
from tests import commands
from validation import comparison, picture_file
from validation.batch import campaign
from validation.batch.stages import Stages
from validation.batch.stopped import Interrupted
from validation.batch.store import RunFile
from validation.cli.ending import ending
from validation.report import export

pytestmark = pytest.mark.render

PICTURE = np.pad(np.full((80, 130), 180.0), ((80, 80), (60, 66)), constant_values=20.0)


def ice(*arguments, cwd=None, env=None, timeout=60):
    """In a process of its own only where its environment is."""
    if env is None:
        return commands.ice(*arguments, cwd=cwd)
    command = [sys.executable, "-m", "validation.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=env, timeout=timeout)


def one_line(done, status=2):
    """The one line of a refusal."""
    assert done.returncode == status, (done.returncode, done.stdout[-300:], done.stderr[-300:])
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
    assert len(done.stderr) < 1300
    return done.stderr


# Files


@pytest.mark.parametrize("name", ["pipe.toml", "pipe.png", "pipe.npy", "pipe.stl"])
@pytest.mark.parametrize("kind", ["pipe", "zero", "link", "directory", "sparse"])
def test_only_regular_files_of_a_limited_size_are_read(kind, name, tmp_path):
    """A pipe nobody writes to, the zero device, a link to it, a directory and 8 GiB of nothing, at once."""
    path = tmp_path / name
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "directory":
        path.mkdir()
    elif kind == "sparse":
        with path.open("wb") as file:
            file.truncate(8 << 30)
    else:
        path.symlink_to("/dev/zero")
    readers = {".toml": campaign.load, ".png": picture_file.read, ".npy": picture_file.read, ".stl": mesh.read}
    began = time.process_time()
    with pytest.raises(InvalidInput, match=r"named pipe|a device|directory|must be at most .* bytes long, got more"):
        readers[path.suffix](path)
    if path.suffix == ".toml":
        with pytest.raises(InvalidInput, match="must be"):
            measure.load_lens(path)
    assert time.process_time() - began < 1


@pytest.mark.parametrize("read", [campaign.load, measure.load_lens, scenes.load])
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a = " + "[" * 5000 + "]" * 5000, "valid TOML, got more than 32 levels"),
        ("a = " + "[" * 40 + "]" * 40, "valid TOML, got more than 32 levels"),
        ("a = " + "9" * 5000, "valid TOML, got"),
        ("a = " + "9" * 400, "valid TOML, got a whole number of 400 digits"),
        ("[" + ".".join("a" * 100_000) + "]", "valid TOML, got a key of more than 32 parts"),
        (".".join("a" * 100_000) + " = 1", "valid TOML, got a key of more than 32 parts"),
        ("a = { " + ' . "a"' * 50 + " = 1 }", "valid TOML, got"),
        ("a = '\xff'", "valid TOML, got 'utf-8' codec"),
        ("#" * (1 << 21), "at most 1048576 bytes long, got more"),
    ],
)
def test_texts_of_limited_depth_and_numbers(text, reason, read, tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes(text.encode("latin-1"))
    began = time.process_time()
    with pytest.raises(InvalidInput, match=f"a.toml must be {reason}"):
        read(path)
    assert time.process_time() - began < 1


def test_a_deep_but_allowed_document_is_read(tmp_path):
    """The limit is where it says: 31 lists in a table."""
    path = tmp_path / "a.toml"
    path.write_text("a = " + "[" * 31 + "]" * 31)
    assert read_toml(path)
    path.write_text(".".join("abcdefghijklmnopqrstuvwxyzABCDE") + " = 9223372036854775807")
    assert read_toml(path)


def test_messages_are_one_line_of_limited_length(tmp_path):
    assert str(InvalidInput("a\nb\x1b[31m\udcff")) == r"a\nb\x1b[31m\udcff"
    assert len(str(InvalidInput("x" * 10**6))) <= 600
    assert len(str(InvalidInput("\n" * 10**6))) <= 1300
    path = tmp_path / "grid.toml"
    path.write_text(
        'scenes=["task1"]\n[grid]\nsensor_polar=[200]\nsensor_azimuth=[0]\nlight_polar=[0]\nlight_azimuth=[1]'
    )
    with pytest.raises(InvalidInput, match=r"grid.toml: grid.sensor_polar\[0\] must be at most 180, got 200"):
        campaign.load(path)


# The way out


def test_an_error_of_the_program_is_one_line_a_log_and_status_3(tmp_path):
    """A division by zero, planted in the loader."""
    code = "import scenes; scenes.load = lambda *_: 1 / 0; import sys; sys.argv = ['ice', 'plan', 'task1']; "
    code += "from validation.cli.main import main; main()"
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, timeout=60)
    line = one_line(done, 3)
    (log,) = tmp_path.glob("ice-*.log")
    assert line == f"internal error: ZeroDivisionError: division by zero (traceback in {log})\n"
    assert "Traceback (most recent call last)" in log.read_text()


def test_an_interruption_that_a_library_turned_into_another_error_counts():
    """As compiled modules do that are interrupted while they are loaded."""
    error = ImportError("initialization failed")
    error.__cause__ = Interrupted("terminated", 143)
    assert ending(error) == ("stopped: terminated", 143)


@pytest.fixture(scope="module")
def start_up():
    """Seconds by the clock until the command line is imported, on this machine as busy as it is."""
    began = time.perf_counter()
    subprocess.run([sys.executable, "-c", "import validation.cli.main"], check=True)
    return time.perf_counter() - began


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("wait", [0.15, 0.4, 0.8, 1.4])
def test_an_interruption_at_start_up_is_one_line(number, wait, start_up):
    """At any moment after Python's own start; then also while the renderer's libraries are loaded."""
    process = subprocess.Popen(
        [sys.executable, "-m", "validation.cli", "plan", "task1", "--step", "0.5"],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    time.sleep(wait)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    early = wait < 4 * start_up and (process.returncode == -number or ("Traceback" in said and ", in main" not in said))
    *progress, last = said.splitlines() or [""]
    assert early or last in ("stopped: interrupted", "stopped: terminated"), said
    assert all(line.startswith("task1: ") for line in progress) or early, said
    assert early or process.returncode == 128 + number


LOST = """
import os, signal, sys, time
from validation.cli import main

def interrupt():
    os.kill(os.getpid(), signal.SIGTERM)
    sum(range(1000))

class Destroyed:
    def __del__(self):
        interrupt()

def swallowed(_):
    Destroyed()
    time.sleep(30)
    return 0

class Held:
    def __del__(self):
        print("ends late" if sys.is_finalizing() else "ends in time")

def plain(_):
    held = Held()
    interrupt()

def renamed(_):
    said = ""
    try:
        interrupt()
    except BaseException as error:
        said = str(error)
    raise RuntimeError("no schema, for " + said)

main._run = {}
main.main()
"""


@pytest.mark.parametrize("fate", ["swallowed", "renamed"])
def test_an_interruption_that_other_code_loses_ends_the_command(fate):
    """Swallowed by a destructor, or made another error that keeps its text alone, as a schema's builder does."""
    done = subprocess.run([sys.executable, "-c", LOST.format(fate)], capture_output=True, text=True, timeout=60)
    assert (fate == "swallowed") == ("Exception ignored" in done.stderr)
    assert (done.returncode, done.stderr.splitlines()[-1]) == (143, "stopped: terminated")


def test_an_interruption_keeps_nothing_until_python_ends():
    """An executor that ends only then complains, for its modules are gone."""
    done = subprocess.run([sys.executable, "-c", LOST.format("plain")], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (143, "ends in time\n", "stopped: terminated\n")


def test_broken_images_say_one_line(tmp_path):
    """libpng's own line does not come as well."""
    path = tmp_path / "a.png"
    picture_file.write(path, np.full((20, 20), 7.0))
    data = bytearray(path.read_bytes())
    data[60:64] = b"\0\0\0\0"
    path.write_bytes(data)
    assert "must be a readable image" in one_line(ice("measure", path))


# Runs


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    """Task1 with one setting and a camera of 64 x 60 px."""
    head, _, settings = (BUNDLED / "task1.toml").read_text().partition("[[settings]]")
    for large, small in (("= 256", "= 64"), ("= 240", "= 60"), ("= 800.0", "= 200.0"), ('["task1_part1"]', "[]")):
        head = head.replace(large, small)
    path = tmp_path_factory.mktemp("tiny") / "tiny.toml"
    path.write_text(head + "[[settings]]" + settings.split("[[settings]]")[4])
    return path


@pytest.fixture(scope="module")
def finished(tiny, tmp_path_factory):
    out = tmp_path_factory.mktemp("finished")
    found = validation.run(scenes.load(tiny), renders=20, seed=1, out=out, workers=1)
    export.write_json(found, out / "result.json")
    return out


def test_a_run_that_measured_nothing_is_reported(tiny, tmp_path):
    """Noise of 2000 grey levels: no image can be measured, and that is what is said, by the report too."""
    path = tmp_path / "dark.toml"
    path.write_text(tiny.read_text().replace("sigma = 2.4", "sigma = 2000.0"))
    done = ice("-q", "validate", path, "--renders", 5, "--workers", 1, "--out", tmp_path / "out", "--json")
    assert (done.returncode, done.stderr) == (1, "")
    assert json.loads(done.stdout)["verdict"].startswith("contradict: none of 1 rows could be measured")
    again = ice("report", tmp_path / "out")
    assert again.returncode == 0, again.stderr
    assert (tmp_path / "out" / "report.html").read_text().count('<svg role="img"') >= 4


def test_a_sensor_without_noise_has_no_variance_to_judge(tiny, tmp_path):
    """Predicted variances of 0 are stored, read, and judged by nobody."""
    silent = tmp_path / "silent.toml"
    silent.write_text(tiny.read_text().replace("sigma = 2.4", "sigma = 0.0").replace("bits = 8", ""))
    found = validation.run(scenes.load(silent), renders=3, seed=1, out=tmp_path / "out", workers=1)
    assert found.rows[0].calibrated == 0
    assert found.rows[0].main.ratio is None
    assert not found.verdict.agrees


def test_a_sweep_over_text_is_reported_and_injects_nothing(tiny, tmp_path):
    """Titles that are HTML, Markdown, a formula and a path."""
    titles = ["<script>alert(1)</script>", "=cmd|' /C calc'!A0", "](javascript:alert(1)) ../../x"]
    path = tmp_path / "texts.toml"
    path.write_text(
        f'title = "{titles[0]}"\nscenes = ["{tiny}"]\n[sweep]\ntask.kind = ["distance"]\ntitle = {titles!r}'.replace(
            "\"=cmd|' /C calc'!A0\"", "\"=cmd|' /C calc'!A0\""
        )
    )
    done = ice("-q", "validate", path, "--renders", 3, "--workers", 1, "--out", tmp_path / "out")
    assert done.returncode in (0, 1), done.stderr
    assert ice("report", tmp_path / "out").returncode == 0
    for report in ("report.md", "report.html"):
        assert "<script" not in (tmp_path / "out" / report).read_text()
    assert "](javascript" not in (tmp_path / "out" / "report.md").read_text()
    cells = (tmp_path / "out" / "table.csv").read_text()
    assert ",=cmd" not in cells
    assert "'=cmd" in cells
    written = [file for file in tmp_path.rglob("*") if file.is_file() and tmp_path / "out" not in file.parents]
    assert written == [path]


@pytest.mark.parametrize("name", ["../../evil", "/evil", "a/b", "", ".", "..", "a\\b", "a\0b", "x" * 101, "a\nb", " a"])
def test_a_name_is_a_file_name(name, task1):
    with pytest.raises(ValueError, match="name"):
        scenes.Scene.model_validate(task1.model_dump() | {"name": name})


# Campaigns


@pytest.mark.parametrize(
    ("axis", "reason"),
    [
        ("{from = 0, to = inf, step = 1}", "a range must be"),
        ("{from = 0, to = 1, step = 1e-300}", "at most 1000 values"),
        ("{from = 0, to = 1, step = 0}", "a range must be"),
        ("{from = 0, to = 1, count = 2.5}", "a range must be"),
        ("{from = 0, to = 1e8, step = 1}", "at most 1000 values, got 1e\\+08"),
        ("{from = 0, to = 10, count = 1e8}", "at most 1000 values"),
        (f"{{from = 0, to = {'9' * 400}, step = 1}}", "a whole number of 400 digits"),
        ("{from = 1, to = 70, count = 178}", "settings must be at most 4000000 in all, got 1e\\+09"),
    ],
)
def test_campaigns_too_large_are_refused_before_memory_is_used(axis, reason, tmp_path):
    path = tmp_path / "large.toml"
    axes = "\n".join(f"{name} = {axis}" for name in ("sensor_polar", "sensor_azimuth", "light_polar", "light_azimuth"))
    path.write_text(f'scenes = ["task1"]\n[grid]\n{axes}')
    with pytest.raises(InvalidInput, match=f"large.toml.*{reason}"):
        campaign.load(path)


def test_a_million_settings_take_no_memory(tmp_path):
    """They are made when they are asked for; what is kept of each is a number."""
    path = tmp_path / "million.toml"
    axes = ("sensor_polar", 60, 100), ("sensor_azimuth", 350, 100), ("light_polar", 60, 10), ("light_azimuth", 350, 10)
    lines = [f"{name} = {{from = 1, to = {to}, count = {count}}}" for name, to, count in axes]
    path.write_text('scenes = ["task1"]\n[grid]\n' + "\n".join(lines))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    loaded = campaign.load(path)
    stages = Stages([[1000] * len(loaded)])
    assert len(loaded) == 10**6
    for index in range(0, 10**6, 1009):
        assert loaded.case(index).index == index
        assert sum(stages.sizes(index).values()) == 1000
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200 * 1024  # KiB; the whole: below 1 GiB


# Run directories

DAMAGE = {
    "no identity": "DELETE FROM run",
    "bad identity": "UPDATE run SET value = '[' WHERE key = 'identity'",
    "deep identity": "UPDATE run SET value = printf('%.*c', 100000, '[') WHERE key = 'identity'",
    "other identity": "UPDATE run SET value = '{}' WHERE key = 'identity'",
    "bad wall": "UPDATE run SET value = '\"x\"' WHERE key = 'wall'",
    "bad effects": "UPDATE run SET value = '[1]' WHERE key = 'effects'",
    "no predictions": "DELETE FROM propagated",
    "a prediction of text": "UPDATE propagated SET variance_px2 = 'x'",
    "an unknown status": "UPDATE propagated SET status = 'fine'",
    "no setting": "DELETE FROM setting",
    "bad predictions": "UPDATE setting SET predicted = '{\"paper\": 1}'",
    "short distances": "UPDATE distance SET values_px = x'0102'",
    "no distances": "DELETE FROM distance",
    "infinite distances": "UPDATE distance SET values_px = zeroblob(0)",
    "distances of text": "UPDATE distance SET values_px = 'x'",
    "chunks of text": "UPDATE chunk SET count = 'x'",
    "large chunks": "UPDATE chunk SET count = 9223372036854775807",
    "bad seconds": "UPDATE chunk SET seconds = '{\"a\": -1}'",
    "no chunks": "DELETE FROM chunk",
    "failures of text": "INSERT INTO failure VALUES (0, 0, 'gradient', 0, 'x', 'ok')",
    "a table lost": "DROP TABLE failure",
    "a table more": "CREATE TABLE more (a)",
    "a column more": "ALTER TABLE chunk ADD COLUMN more",
    "a trigger": "CREATE TRIGGER t AFTER INSERT ON run BEGIN DELETE FROM chunk; END",
    "old version": "PRAGMA user_version = 0",
    "no size": "UPDATE setting SET height = -1",
    "a size of text": "UPDATE setting SET width = 'x'",
    "a large size": "UPDATE setting SET width = 1000000000",
    "another size": "UPDATE setting SET width = 63",
    "no image": "UPDATE setting SET image = x'00'",
}


REFUSED = "DIR must be a run directory|must be an undamaged run file|must have measured"


def damaged(finished, tmp_path, statement=None):
    copy = tmp_path / "damaged"
    shutil.copytree(finished, copy)
    if statement:
        db = sqlite3.connect(copy / "run.sqlite")
        db.executescript(statement)
        db.close()
    return copy


def report(directory):
    """Everything that a report reads."""
    store = RunFile.reopen(directory)
    try:
        found = validation.batch.result.collect(store.campaign(), store)
        store.fact("effects")
        for row in found.rows:
            store.image(row.index)
    finally:
        store.close()


def test_the_undamaged_directory_is_read(finished):
    report(finished)


@pytest.mark.parametrize("what", DAMAGE)
def test_a_damaged_run_file_is_one_line(what, finished, tmp_path):
    with pytest.raises(InvalidInput, match=REFUSED):
        report(damaged(finished, tmp_path, DAMAGE[what]))


def test_flipped_bytes_and_cut_files_are_read_or_refused(finished, tmp_path):
    """60 times; what SQLite does not notice must still be numbers, or be refused."""
    whole, rng, refused = (finished / "run.sqlite").read_bytes(), np.random.default_rng(1), 0
    copy = damaged(finished, tmp_path)
    for _ in range(60):
        data = bytearray(whole)
        for place in rng.integers(len(data), size=20):
            data[place] ^= int(rng.integers(1, 256))
        (copy / "run.sqlite").write_bytes(data[: rng.integers(1, len(data))] if rng.random() < 0.3 else data)
        try:
            report(copy)
        except InvalidInput:
            refused += 1
    assert refused > 30


def test_a_zlib_bomb_is_not_unpacked(finished, tmp_path):
    """512 MiB of zeros in 2 MB; no more of them than the image has pixels."""
    packer = zlib.compressobj(1)
    bomb = b"".join(packer.compress(bytes(1 << 24)) for _ in range(32)) + packer.flush()
    copy = damaged(finished, tmp_path)
    db = sqlite3.connect(copy / "run.sqlite")
    with db:
        db.execute("UPDATE setting SET image = ?", (bomb,))
    db.close()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InvalidInput, match="must be an undamaged run file, got one where this is wrong: the image"):
        report(copy)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100 * 1024


@pytest.mark.parametrize("name", ["run.sqlite", "run.sqlite-wal", "run.lock"])
def test_a_pipe_in_a_run_directory_is_not_waited_for(name, finished, tiny, tmp_path):
    copy = damaged(finished, tmp_path)
    (copy / name).unlink(missing_ok=True)
    os.mkfifo(copy / name)
    with pytest.raises(InvalidInput, match=f"{name} is no file"):
        report(copy)
    with pytest.raises(InvalidInput, match=f"{name} is no file"):
        validation.run(scenes.load(tiny), renders=20, seed=1, out=copy, workers=1)


@pytest.mark.parametrize("what", ["no identity", "a table lost", "old version", "short distances", "bad identity"])
def test_a_foreign_directory_is_not_taken_for_ones_own(what, finished, tiny, tmp_path):
    copy = damaged(finished, tmp_path, DAMAGE[what])
    with pytest.raises(InvalidInput, match="must be"):
        validation.run(scenes.load(tiny), renders=20, seed=1, out=copy, workers=1)
    made = validation.run(scenes.load(tiny), renders=20, seed=1, out=copy, workers=1, fresh=True)
    assert made.rows[0].main.n == 20


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("n", "20"), ("n", -1), ("n", None), ("failed", 21), ("failed", 10**30), ("empirical", -1.0),
        ("empirical", "x"),
        ("bias", None), ("bias", [1]), ("sensor", [1]), ("sensor", ["a", "b"]), ("light", None), ("classic", None),
        ("classic", [1]), ("method", 1), ("parameters", [1]), ("scene", 5),
    ],
)  # fmt: skip
def test_compare_believes_no_result(key, value, finished, tmp_path):
    document = json.loads((finished / "result.json").read_text())
    document["settings"][0][key] = value
    (tmp_path / "result.json").write_text(json.dumps(document))
    with pytest.raises(InvalidInput, match=r"must be a run directory or its result.json, got: "):
        comparison.read(tmp_path)


def test_compare_of_unequal_numbers_of_images(finished, tmp_path):
    """The same variance from 20 and from 2000 images: p-values of F and Welch with those numbers, by SciPy."""
    from scipy import stats

    before = comparison.read(finished)
    after = json.loads(json.dumps(before))
    row, other = before["settings"][0], after["settings"][0]
    other |= {"n": 2000, "empirical": 1.5 * row["empirical"], "bias": row["bias"] + row["empirical"] ** 0.5}
    found = comparison.compare(before, after, level=1 - 1e-12)
    changes = {c.what: c.p_value for c in found.changed if c.method == row["method"]}
    ratio = stats.f(19, 1999)
    assert changes["variance"] == pytest.approx(2 * ratio.cdf(1 / 1.5), rel=1e-9)
    standard = np.sqrt(row["empirical"] * (1 / 20 + 1.5 / 2000))
    freedom = standard**4 / (row["empirical"] ** 2 * (1 / 20**2 / 19 + (1.5 / 2000) ** 2 / 1999))
    assert changes["mean"] == pytest.approx(2 * stats.t(freedom).sf(row["empirical"] ** 0.5 / standard), rel=1e-9)


# Numbers


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("sensor_deg = 1e300", "uncertainty.sensor_deg.sd must be at most 1e+12, got 1e+300"),
        ("part_tilt_deg = {half_width = 1e300}", "uncertainty.part_tilt_deg.half_width must be at most 1e+12"),
        ("process_sd = 5e-324", "uncertainty.process_sd: number must be 0 or at least 1e-30, got 4.94066e-324"),
        ("rounding = 1e300", "uncertainty.rounding must be at most 1e+12"),
        ("light_deg = {sd = 1, dof = 1e300}", "uncertainty.light_deg.dof must be at most 1e+12"),
        (
            'covariance = {names = ["k1"], matrix = [[1e300]]}',
            "uncertainty.covariance.matrix[0][0] must be at most 1e+24",
        ),
    ],
)
def test_absurd_uncertainties_are_refused_in_one_line(line, told, tmp_path):
    text = (BUNDLED / "task1.toml").read_text()
    (tmp_path / "scene.toml").write_text(text + f"\n[uncertainty]\n{line}\n")
    with pytest.raises(InvalidInput, match=re.escape(told)):
        scenes.load(tmp_path / "scene.toml")


def test_degrees_of_freedom_beyond_whole_numbers_are_as_infinitely_many():
    from planner.uncertainty import coverage_factor

    assert coverage_factor(0.95, 1e30) == pytest.approx(coverage_factor(0.95), rel=1e-9)


# Arguments


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ("validate task1 --workers 99999999999999999999", "workers must be at most 1024"),
        ("validate task1 --seed -1", "seed must be at least 0, got -1"),
        ("calibrate task1 --seed -1", "seed must be at least 0, got -1"),
        ("render task1 --sensor 30,20 --light 15,20 -o a.png --noise-seed -1", "--noise-seed must be at least 0"),
        (f"validate task1 --seed {'9' * 5000}", "--seed must be a number of fewer digits"),
        ("plan task1 --step 0", "step must be between 0.1 and 90 degrees, got 0"),
        ("plan task1 --separation 400", "min_separation_deg must be at most 180, got 400"),
        ("plan task1 --sensor 80,10 --sensor-polar 0,40 --step 20", "sensor must keep the constraints, got (80, 10)"),
        ("plan task1 --light 80,10 --light-polar 0,40 --step 20", "light must keep the constraints, got (80, 10)"),
        ("validate task1 --out FILE/x", "--out must be a writable directory"),
        ("report . --out FILE/x", "--out must be a writable directory"),
        ("cost task1 --out FILE/x", "--out must be a writable directory"),
        ("plan task1 --out FILE", "--out must be a writable directory"),
        ("plan task1 --map a.jpg", "--map must end in .png, got 'a.jpg'"),
        ("calibrate task1 -o a.txt", "--output must end in .png"),
        ("calibrate task1 -o no/a.png", "--output must be a writable file, got no/a.png (no such directory)"),
        ("hard --precision a.txt", "--precision must end in .png"),
        ("render task1 --sensor 30,20 --light 15,20 -o a.xyz", "--output must end in"),
        ("validate task1 --dask nonsense", "--dask must be an address such as tcp://127.0.0.1:8786, got 'nonsense'"),
        ("-q -v validate task1", "-q must be given without -v, got both"),
    ],
)
def test_arguments_are_refused_before_the_work(arguments, line, tmp_path):
    (tmp_path / "FILE").write_text("")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert line in one_line(ice(*arguments.split(), cwd=tmp_path))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    # margin: processor time, 1 to 2.5 s of it for loading; more than a refusal may take, whatever the machine
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 5  # of the processor
    assert [path.name for path in tmp_path.iterdir()] == ["FILE"]


def test_a_range_between_two_rings_is_its_middle():
    """A grid of 45 degrees has no ring at 50."""
    found = planner.plan(
        scenes.load("task1"), step_deg=45, constraints=planner.Constraints(sensor_polar_deg=(50, 50)), refined=False
    )
    assert found.grid_sensor.polar_deg == 50


# Arrays

ARRAYS = {
    "colour": np.zeros((240, 256, 3)), "empty": np.zeros((0, 256)), "none": None, "0-d": np.array(5.0), "text": "image",
    "strings": PICTURE.astype(str), "complex": PICTURE + 1j, "dates": PICTURE.astype("datetime64[s]"),
    "objects": PICTURE.astype(object), "masked": np.ma.masked_greater(PICTURE, 100), "ragged": [[1, 2], [3]],
    "infinite": PICTURE / np.where(PICTURE > 100, 1, np.inf) + np.inf, "too bright": PICTURE * 1e300,
}  # fmt: skip


@pytest.mark.parametrize("what", ARRAYS)
@pytest.mark.parametrize(
    "use",
    [
        lambda image: measure.distance(image, scenes.load("task1"), (30, 135)),
        lambda image: measure.propagate(image, scenes.load("task1"), (30, 135)),
        measure.measure_quadrilateral,
        lambda image: render.expose(image, Noise(sigma=1.0), np.random.default_rng(1), 1),
        lambda image: render.variance(image, Noise(sigma=1.0)),
    ],
    ids=["distance", "propagate", "measure_quadrilateral", "expose", "variance"],
)  # fmt: skip
def test_what_is_no_image_is_refused(what, use, request):
    if what == "colour" and "variance" in request.node.name:
        pytest.skip("a stack of pictures to it")
    with pytest.raises(InvalidInput, match="must be"):
        use(ARRAYS[what])


@pytest.mark.parametrize("scale", [1e-320, 1e-40])
def test_images_of_less_than_any_scene_may_say_are_dark_without_a_warning(scale):
    """Warnings are errors here; of 1e-40 grey levels the noise was once estimated, and was none that could be made."""
    dark = (PICTURE + np.random.default_rng(1).standard_normal(PICTURE.shape)) * scale
    found = measure.distance(dark, scenes.load("task1"), (30, 135))
    assert np.isnan(found.value_px)
    with pytest.raises(InvalidInput):
        measure.measure_quadrilateral(dark)


@pytest.mark.parametrize(
    ("use", "message"),
    [
        (lambda: scenes.load(3), "scene must be a name or a path, got 3"),
        (lambda: planner.ViewingSpace("15"), "step_deg must be a finite number, got '15'"),
        (lambda: planner.ViewingSpace(15, (0, 10, 20)), "polar range must be two angles"),
        (lambda: planner.pose_map(scenes.load("task1"), sensor=(30, 135), space=15), "space must be a ViewingSpace"),
        (lambda: planner.budget(scenes.load("task1"), (30, 135), (15, 315), p="x"), "p must be a finite number"),
        (lambda: planner.budget(scenes.load("task1"), (30, 135), (15, 315), variances=[1, 2]), "variances must be one"),
        (lambda: planner.budget(scenes.load("task1"), (30, 135), (15, 315), variances=[-1]), "variances must be at"),
        (lambda: planner.predict(scenes.load("task1"), (30, 135), (15, 315), 10**5000), "model must be one of"),
        (lambda: measure.region_of_interest(scenes.load("task1"), (30, 135), estimators="canny"), "estimators must be"),
        (lambda: render.effects("task1"), "scene must be a Scene, got 'task1'"),
        (lambda: scenes.Pose(10**5000, 0), "polar_deg must be a finite number of degrees, got a whole number of too"),
    ],
)  # fmt: skip
def test_absurd_arguments_are_refused_in_one_line(use, message):
    with pytest.raises(InvalidInput, match=message):
        use()


def test_array_files(tmp_path):
    for name, array in (("five", np.zeros((4, 4, 5))), ("none", np.array(None)), ("complex", PICTURE + 1j)):
        np.save(tmp_path / f"{name}.npy", array, allow_pickle=True)
        with pytest.raises(InvalidInput, match="must be"):
            picture_file.read(tmp_path / f"{name}.npy")
    np.save(tmp_path / "colour.npy", np.zeros((4, 4, 3)))
    assert picture_file.read(tmp_path / "colour.npy").shape == (4, 4)
    np.save(tmp_path / "turned.npy", np.asfortranarray(PICTURE))
    assert (picture_file.read(tmp_path / "turned.npy") == PICTURE).all()


# Meshes


def test_meshes_have_stated_limits(tmp_path):
    """More triangles than a part may have are refused by the number in the header, and where none is there counted."""
    path = tmp_path / "huge.stl"
    path.write_bytes(bytes(80) + (5_000_000).to_bytes(4, "little") + bytes(1000))
    with pytest.raises(InvalidInput, match=r"at most 1000000 triangles, got .* with 5000000"):
        mesh.read(path)
    path = tmp_path / "huge.ply"
    path.write_text("ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nend_header\n")
    with pytest.raises(InvalidInput, match="at most 1000000 triangles"):
        mesh.read(path)
    path = tmp_path / "huge.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "f 1 2 3\n" * 1_000_001)
    with pytest.raises(InvalidInput, match=r"at most 1000000 triangles, got .* with 1000001"):
        mesh.read(path)


@pytest.mark.parametrize("first", ["solid", "solid a box", "  SOLID A BOX", "solid\ta box"])
def test_a_text_of_triangles_tells_no_number_of_them(first, tmp_path):
    """STL as text: what stands where other files have their number of triangles is a word."""
    path, text = tmp_path / "box.stl", trimesh.creation.box((1, 2, 3)).export(file_type="stl_ascii")
    path.write_text(first + "\n" + text.split("\n", 1)[1])
    assert len(mesh.read(path).faces) == 6


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj"])
def test_sizes_of_1e12_and_empty_meshes_are_one_line(suffix, tmp_path):
    path = tmp_path / f"a.{suffix}"
    trimesh.creation.box((1e12, 1e12, 1e12)).export(path)
    with pytest.raises(InvalidInput, match=r"object.file must have coordinates up to 1e\+09, got"):
        mesh.read(path)
    if suffix == "obj":  # in full digits
        path.write_text("v 1000000000.5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        with pytest.raises(InvalidInput, match=r"object.file must have coordinates up to 1e\+09, got"):
            mesh.read(path)
    path.write_bytes(b"")
    with pytest.raises(InvalidInput, match=r"object\.file must"):
        mesh.read(path)


def test_a_texture_beside_a_mesh_is_not_looked_for(tmp_path):
    path = tmp_path / "a.obj"
    text = trimesh.creation.box((1, 2, 3)).export(file_type="obj")
    path.write_text("mtllib /dev/zero\nmtllib no.mtl\nusemtl x\n" + text)
    assert len(mesh.read(path).faces) == 6


# The command line's habits


def test_version_help_and_completion():
    assert ice("--version").stdout.startswith("ice 0.")
    bare = ice()
    assert (bare.returncode, bare.stderr) == (0, "")
    assert "validate" in bare.stdout
    assert "Exit status" in bare.stdout
    assert ice("--help").stdout == bare.stdout
    complete = {**os.environ, "_PYTHON_M_VALIDATION_CLI_COMPLETE": "complete_bash"}
    assert ice("--help", env=complete).returncode == 0
    assert "--install-completion" in bare.stdout


@pytest.mark.parametrize("arguments", [(), ("--version",), ("plan", "--help"), ("validate", "nothing"), ("nosuch",)])
def test_help_and_errors_do_not_wait_for_the_renderer(arguments):
    """Nor for the packages that take seconds to load; NumPy they need."""
    told = ice(*arguments, env={**os.environ, "PYTHONPROFILEIMPORTTIME": "1"}).stderr
    loaded = {line.rpartition("|")[2].strip() for line in told.splitlines() if line.startswith("import time:")}
    assert "numpy" in loaded
    assert loaded.isdisjoint(
        {"mitsuba", "drjit", "scipy", "cv2", "matplotlib", "trimesh", "planner", "measure", "render"}
    )


def test_progress_when_piped(monkeypatch, capsys):
    """A line at most every ten seconds, none with -q."""
    from validation.cli import common, verbosity

    now = [0.0]
    monkeypatch.setattr(common.time, "monotonic", lambda: now[0])
    with common.progress("night") as shown:
        for second in range(0, 31):
            now[0] = float(second)
            shown("images", second, 30)
    assert capsys.readouterr().err.splitlines() == [f"night: {n} of 30 images" for n in (10, 20, 30)]
    monkeypatch.setattr(verbosity, "_quiet", True)
    with common.progress("night") as shown:
        now[0] += 60
        shown("images", 30, 30)
    assert capsys.readouterr().err == ""


def test_quiet_and_verbose_may_stand_anywhere(tiny, tmp_path):
    options = ("validate", tiny, "--renders", 3, "--workers", 1, "--fresh", "--json")
    quiet = ice(*options, "--out", tmp_path / "a", "-q")
    assert quiet.stderr == ""
    told = ice("validate", "-v", *options[1:], "--out", tmp_path / "b")
    assert "started seed=1995" in told.stderr
    assert json.loads(told.stdout)["settings"] == json.loads(quiet.stdout)["settings"]


def test_no_traceback_ever(tmp_path):
    """Strange paths: with a newline, a byte that is no UTF-8, of 5000 letters, empty."""
    for name in ("a\nb.toml", b"\xff.toml".decode("utf-8", "surrogateescape"), "x" * 5000, ""):
        one_line(ice("validate", Path(name) if name else ""))
