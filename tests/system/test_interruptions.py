"""What can go wrong overnight: each leaves a run that continues with the same numbers, and one clear line."""

import gc
import json
import multiprocessing
import operator
import os
import re
import signal
import socket
import sqlite3
import struct
import subprocess
import sys
import threading
import time
from concurrent.futures import BrokenExecutor
from contextlib import suppress
from multiprocessing.queues import SimpleQueue

import psutil
import pytest

import scenes
import validation
from scenes import InvalidInput
from tests.commands import ice
from tests.proofs.kill import same
from validation.batch import cluster as clusters
from validation.batch import pool, store
from validation.batch.stopped import Interrupted
from validation.batch.store import RunFile
from validation.batch.work import CHUNK
from validation.cli.common import continued

pytestmark = pytest.mark.render

RENDERS = 2 * CHUNK + 50


@pytest.fixture(scope="module")
def small(small_toml):
    return scenes.load(small_toml)


@pytest.fixture(scope="module")
def unbroken(small, tmp_path_factory):
    """Directory of a run that nothing disturbed."""
    directory = tmp_path_factory.mktemp("unbroken")
    run(small, directory)
    return directory


def run(scene, directory, **options):
    """Also writes the final table, as the command does."""
    found = validation.run(scene, **{"renders": RENDERS, "seed": 5, "out": directory, "workers": 1, **options})
    (directory / "result.json").write_text(json.dumps(found.to_json()))
    return found


def after(images, act):
    """A progress callback that acts once, when so many images are done."""
    acts = [act]

    def progress(_what, done, _total):
        if done >= images and acts:
            acts.pop()()

    return progress


def images(directory):
    run_file = RunFile.reopen(directory)
    try:
        return run_file.images()
    finally:
        run_file.close()


def test_killed_twice(small_toml, tmp_path):
    """The proof of the README, reduced: SIGKILL at random moments, and the final tables equal bit for bit."""
    command = [sys.executable, "-m", "tests.proofs", "kill", "--times", "2", "--scene", small_toml, "--out", tmp_path]
    done = subprocess.run([*map(str, command), "--renders", "500"], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 of 2 kills hit a running process; final tables, 2000 images" in done.stdout
    assert "all equal, bit for bit" in done.stdout


def test_the_proof_sees_a_single_changed_number(unbroken, tmp_path):
    """Negative control: the last bit of one distance."""
    (tmp_path / "result.json").write_text((unbroken / "result.json").read_text())
    source, copy = (sqlite3.connect(directory / "run.sqlite") for directory in (unbroken, tmp_path))
    source.backup(copy)
    assert same(unbroken, tmp_path)[0]
    where = "WHERE setting = 2 AND chunk = 1 AND method = 'gradient'"
    (values,) = copy.execute(f"SELECT values_px FROM distance {where}").fetchone()
    with copy:
        copy.execute(f"UPDATE distance SET values_px = ? {where}", (bytes([values[0] ^ 1]) + values[1:],))
    source.close()
    copy.close()
    assert not same(unbroken, tmp_path)[0]


def test_dead_worker_process_is_replaced(small, unbroken, tmp_path):
    def kill_one():
        multiprocessing.active_children()[0].kill()

    run(small, tmp_path, workers=2, progress=after(CHUNK, kill_one))
    assert same(unbroken, tmp_path)[0]


def test_workers_that_keep_dying_stop_the_run(small, tmp_path, monkeypatch):
    monkeypatch.setattr(pool, "_begin", operator.index)  # fails in every worker
    with pytest.raises(validation.Stopped, match=r"^stopped: workers died 3 times in a row; .*; the same command cont"):
        run(small, tmp_path, workers=2)


@pytest.fixture
def cluster():
    """Two worker processes, on the loopback interface only."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0", silence_logs=50
    ) as made:
        yield made


def test_dask_worker_killed_midway(small, unbroken, tmp_path, cluster):
    """The same numbers as local processes, complete."""
    nanny = next(iter(cluster.workers.values()))
    victim = nanny.pid

    def kill_one():
        assert nanny.pid == victim
        os.kill(victim, signal.SIGKILL)

    run(small, tmp_path, dask=cluster.scheduler_address, progress=after(2 * CHUNK, kill_one))
    assert nanny.pid != victim
    assert same(unbroken, tmp_path)[0]


def test_dask_scheduler_gone(small, unbroken, tmp_path, cluster):
    with pytest.raises(validation.Stopped, match=r"^stopped: the Dask scheduler at tcp://127.0.0.1:\d+ is gone"):
        run(small, tmp_path, dask=cluster.scheduler_address, progress=after(CHUNK, cluster.close))
    assert 0 < images(tmp_path) < 4 * RENDERS
    run(small, tmp_path)
    assert same(unbroken, tmp_path)[0]


def test_no_scheduler_at_the_address():
    with (
        pytest.raises(InvalidInput, match=r"--dask must be the address of a running scheduler, got 127.0.0.1:9"),
        clusters.dask("127.0.0.1:9", patience=0.5),
    ):
        pass


@pytest.mark.parametrize("greeting", [b"", b"SSH-2.0-OpenSSH_9.6\r\n", bytes(4096)], ids=["silence", "ssh", "zeros"])
def test_a_live_port_that_is_no_scheduler(greeting, tmp_path, monkeypatch):
    """Refused before the work, by the check's own limit and not by the client's patience of 10 s."""
    monkeypatch.setattr(clusters, "_ANSWER_S", 0.5)
    stranger = socket.create_server(("127.0.0.1", 0))
    held = []

    def serve():
        with suppress(OSError):  # the test is over, and the port closed
            while True:
                held.append(stranger.accept()[0])
                held[-1].sendall(greeting)

    threading.Thread(target=serve, daemon=True).start()
    address = f"tcp://127.0.0.1:{stranger.getsockname()[1]}"
    try:
        with pytest.raises(InvalidInput, match=f"--dask must be the address of a running scheduler, got {address}"):
            validation.run(scenes.load("task1"), renders=20, out=tmp_path / "run", dask=address)
    finally:
        stranger.close()
        for connection in held:
            connection.close()
    assert len(held) <= 3  # the socket's own try and Dask's; a client would try again and again
    assert not (tmp_path / "run").exists()


def test_full_disk(small, unbroken, tmp_path, monkeypatch):
    """SQLite's own limit on the file's size gives the error that a full disk gives."""
    connect = sqlite3.connect

    def tight(path, **options):
        made = connect(path, **options)
        made.execute("PRAGMA max_page_count = 30")
        return made

    monkeypatch.setattr(store.sqlite3, "connect", tight)
    with pytest.raises(
        validation.Stopped, match=r"run.sqlite could not be written \(database or disk is full\); what is"
    ):
        run(small, tmp_path)
    monkeypatch.undo()
    assert 0 < images(tmp_path) < 4 * RENDERS
    run(small, tmp_path)
    assert same(unbroken, tmp_path)[0]


def test_locked_database(small, unbroken, tmp_path, monkeypatch):
    monkeypatch.setattr(store, "BUSY_S", 0.2)
    others = []

    def lock():
        others.append(sqlite3.connect(tmp_path / "run.sqlite"))
        others[0].execute("BEGIN IMMEDIATE")

    with pytest.raises(validation.Stopped, match=r"run.sqlite could not be written \(database is locked\)"):
        run(small, tmp_path, progress=after(CHUNK, lock))
    others[0].close()
    run(small, tmp_path)
    assert same(unbroken, tmp_path)[0]


def test_directory_in_use(small, tmp_path):
    def second():
        with pytest.raises(InvalidInput, match="--out must not be in use by another run, got"):
            run(small, tmp_path)

    run(small, tmp_path, renders=20, progress=after(20, second))


@pytest.mark.parametrize(
    ("sent", "status", "word"), [(signal.SIGTERM, 143, "terminated"), (signal.SIGINT, 130, "interrupted")]
)
def test_signals_stop_with_one_line_and_leave_no_process(small_toml, tmp_path, sent, status, word):
    command = [sys.executable, "-m", "validation.cli", "validate", small_toml, "--renders", "5000", "--workers", "2"]
    with subprocess.Popen(
        [*map(str, command), "--out", str(tmp_path), "--log-json"],
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a background job starts with it ignored
    ) as process:
        try:
            while json.loads(process.stderr.readline())["event"] != "committed":
                pass
            process.send_signal(sent)
            _, errors = process.communicate(timeout=60)  # also waits until the workers have closed the pipe
        finally:
            process.kill()
    lines = [line for line in errors.splitlines() if not line.startswith("{")]
    assert lines == [f"stopped: {word}; what is finished is kept; the same command continues the run"]
    assert process.returncode == status
    assert 0 < images(tmp_path) < 20000


def test_interrupted_while_workers_start(small_toml, tmp_path):
    """As from a terminal, to the whole group, at the first sight of a worker: they import, and would tell of it."""
    command = [sys.executable, "-m", "validation.cli", "validate", str(small_toml), "--workers", "2", "--fresh"]
    with subprocess.Popen(
        [*command, "--out", str(tmp_path)],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        try:
            while process.poll() is None and not any("spawn_main" in _words(each) for each in _children(process)):
                time.sleep(0.01)
            os.killpg(process.pid, signal.SIGINT)
            _, errors = process.communicate(timeout=60)  # also waits until the workers have closed the pipe
        finally:
            process.kill()
    assert errors == "stopped: interrupted; what is finished is kept; the same command continues the run\n"
    assert process.returncode == 130


@pytest.mark.parametrize("cause", [True, False])
def test_an_interruption_that_a_library_hides_says_that_the_run_continues(cause):
    """An executor that is broken by it raises an error of its own, while that of the signal is dealt with."""
    with pytest.raises(Interrupted) as stopped, continued(False):
        _broken(Interrupted("terminated", 143), cause)
    assert str(stopped.value) == "stopped: terminated; what is finished is kept; the same command continues the run"
    assert stopped.value.status == 143
    with pytest.raises(RuntimeError, match="broken"), continued(False):
        _broken(ValueError(), cause)


def _broken(by, cause):
    try:
        raise by
    except BaseException as error:
        raise RuntimeError("the executor is broken") from (error if cause else None)


def _children(process):
    return psutil.Process(process.pid).children()


def _words(process):
    try:
        return " ".join(process.cmdline())
    except psutil.Error:  # ended meanwhile
        return ""


def test_workers_are_deaf_from_their_first_instruction():
    """What is blocked when they are made; a signal that comes meanwhile is handled afterwards, once."""
    heard = []
    former = signal.signal(signal.SIGINT, lambda number, _frame: heard.append(number))
    try:
        with pool._undisturbed():
            inherited = subprocess.run(
                [sys.executable, "-c", "import signal; print(*signal.pthread_sigmask(signal.SIG_BLOCK, []))"],
                capture_output=True,
                text=True,
            )
            os.kill(os.getpid(), signal.SIGINT)
            assert heard == []
        assert heard == [signal.SIGINT]
    finally:
        signal.signal(signal.SIGINT, former)
    assert int(inherited.stdout) == signal.SIGINT


def test_log_json(small_toml, tmp_path):
    done = ice("validate", small_toml, "--renders", 20, "--workers", 1, "--out", tmp_path, "--log-json")
    events = [json.loads(line) for line in done.stderr.splitlines()]
    assert [event["event"] for event in events] == ["started", *["committed"] * 4, "finished"]
    assert [event["done"] for event in events[1:5]] == [20, 40, 60, 80]
    assert events[0]["total"] == 80
    assert re.match("agree: |contradict: ", events[-1]["verdict"])


def _die_sending():
    """As a worker that is killed while it writes a result: a length, and less than that."""
    results = next(each for each in gc.get_objects() if isinstance(each, SimpleQueue) and hasattr(each, "_writer"))
    os.write(results._writer.fileno(), struct.pack("!i", 5000) + b"half")
    os.kill(os.getpid(), signal.SIGKILL)


def _ask_for_a_death():
    with pool.local(2) as crew:
        crew.executor.submit(int).result()
        crew.check(None)
        dying = crew.executor.submit(_die_sending)
        for _ in range(30):
            with suppress(TimeoutError):
                dying.result(timeout=1)
            crew.check(None)


def test_a_worker_that_is_killed_while_it_sends_is_noticed():
    """The pool waits for the rest of its result, for ever: asked, the crew says that it is gone, and ends."""
    with pytest.raises(BrokenExecutor):
        _ask_for_a_death()
