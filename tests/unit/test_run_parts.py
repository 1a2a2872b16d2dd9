"""What a job commits, which images it keeps, and which machines give the same numbers."""

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest

from validation.batch import job, machine, work
from validation.batch.campaign import Campaign
from validation.batch.stages import Stages
from validation.batch.store import RunFile


class Store:
    """A run file in which two chunks of three are finished, and after the next piece of work all."""

    def __init__(self, chunks):
        self.known, self.dropped, self.added = chunks, [], []

    def add(self, index, found):
        self.added.append((index, found))

    def chunks(self, index):
        return dict.fromkeys(range(self.known), 64)

    def drop_image(self, index):
        self.dropped.append(index)


@pytest.mark.parametrize(
    ("index", "chunks", "more", "is_dropped"),
    [
        (64, 3, None, True), (63, 3, None, False), (64, 2, None, False), (70, 3, lambda _: None, False),
        (2, 2, None, False),
    ],
    ids=["beyond those kept", "one that is kept", "not finished", "more may be asked", "kept and not finished"],
)  # fmt: skip
def test_the_image_of_a_finished_setting_is_given_up(index, chunks, more, is_dropped):
    """Only where the setting is beyond the first 64, all its chunks are there, and nobody asks for more."""
    store, said = Store(chunks), []
    batch = SimpleNamespace(store=store, stages=Stages([[600] * 71]), more=more, done=10, total=900)
    batch.progress = lambda *told: said.append(told)
    found = work.TaskResult(None, dict.fromkeys((0, 2), None))
    job._Batch._commit(batch, index, found)
    assert store.added == [(index, found)]
    assert store.dropped == [index] * is_dropped
    assert said == [("images", 10 + 250 + 100, 900)]


def test_images_of_stages():
    """In all, those of the last stage."""
    stages = Stages([[3, 4], [10, 4]])
    assert (stages.total, stages.later) == (14, [[10, 4]])
    assert not stages.extend([9, 4])
    assert stages.extend([2, 260])
    assert (stages.total, stages.sizes(0), stages.sizes(1)) == (270, {0: 3, 1: 7}, {0: 4, 1: 250, 2: 6})


def test_an_image_that_is_given_up_is_gone(tmp_path):
    """That of one setting; the others stay, and all else of it."""
    store = RunFile(tmp_path / "run", {"campaign": {}, "seed": 1})
    for setting in (0, 1):
        clean = work.Clean(work.Packed.of(np.full((2, 3), 5.0 + setting)), {}, {}, {"render": 0.5})
        store.add(setting, work.TaskResult(clean, {}))
    store.drop_image(1)
    assert (store.has_image(0), store.has_image(1), store.image(1)) == (True, False, None)
    assert store.image(0).tolist() == [[5.0] * 3] * 2
    assert store.seconds() == {"render": 1.0}
    store.close()


ONE = {"processor": "P", "numpy": "AVX2", "blas": "Haswell", "embree": "AVX2", "system": "s", "cores": 2}


def test_machines_that_give_the_same_digits():
    """However many cores they have, and whatever the system."""
    assert machine.same(ONE, {**ONE, "system": "t", "cores": 64})
    for key in ("processor", "numpy", "blas", "embree"):
        assert not machine.same(ONE, {**ONE, key: "other"}), key
        assert not machine.same(ONE, {name: value for name, value in ONE.items() if name != key}), key


def test_a_machine_in_words():
    assert machine.named(ONE) == "processor P, numpy AVX2, blas Haswell, embree AVX2"
    assert machine.named({**ONE, "blas": "", "numpy": "AVX512"}) == "processor P, numpy AVX512, embree AVX2"


@pytest.mark.parametrize(("processor", "expected"), [("a chip", "a chip"), ("", "arm64")])
def test_a_machine_that_tells_nothing_of_itself_is_named_by_its_kind(processor, expected, monkeypatch):
    def unreadable(*_):
        raise OSError("no such file")

    monkeypatch.setattr(machine.Path, "read_text", unreadable)
    monkeypatch.setattr(machine.platform, "processor", lambda: processor)
    monkeypatch.setattr(machine.platform, "machine", lambda: "arm64")
    assert machine._processor() == (expected, set())


def test_a_machine_is_named_by_its_model_and_its_first_processors_instructions(monkeypatch):
    text = "model name\t: Chip 7\nflags\t\t: sse avx\n\nmodel name\t: Chip 7\nflags\t\t: sse\n"
    monkeypatch.setattr(machine.Path, "read_text", lambda *_: text)
    assert machine._processor() == ("Chip 7", {"sse", "avx"})


@pytest.mark.parametrize(("known", "done"), [({}, 3), ({"wall": 40.0}, 3), ({"wall": 40.0}, 0)])
def test_the_time_of_a_run_goes_on_from_what_it_had_taken(known, done, monkeypatch):
    """From 0 where it begins, and only where something was done; the clock goes 2.5 s meanwhile."""
    noted, clock = {}, iter([10.0, 12.5])
    store = SimpleNamespace(fact=lambda name, default: known.get(name, default), note=noted.__setitem__)
    options = SimpleNamespace(workers=3, seed=1, executor=None, dask=None)
    batch = SimpleNamespace(options=options, store=store, done=5, total=9, variant="scalar_rgb")
    batch.finish = lambda crew: setattr(batch, "done", batch.done + done)
    monkeypatch.setattr(job.time, "perf_counter", lambda: next(clock))
    job._finish(batch)
    assert noted == ({"wall": known.get("wall", 0.0) + 2.5, "workers": 3} if done else {})


@pytest.mark.parametrize(("most", "together", "submitted"), [(10_000, 1, 48), (16, 1, 48), (15, 2, 8), (5, 4, 4)])
def test_of_more_settings_than_a_scheduler_keeps_count_of_several_are_one_task(
    most, together, submitted, tmp_path, task1, monkeypatch
):
    """Task1's 16 settings of three chunks: one by one a task each, of few tasks whole settings together; all are done
    once, whatever is grouped."""
    done, count = [], []

    class Counting(ThreadPoolExecutor):
        def submit(self, fn, *args):
            count.append(len(args[0]))
            return super().submit(fn, *args)

    def perform(task):
        done.append((task.case.index, task.chunks))
        clean = work.Clean(work.Packed.of(np.zeros((2, 3))), {}, {}, {})
        chunks = {k: work.Chunk({"gradient": np.zeros(n)}, {}, {}) for k, n in task.chunks}
        return work.TaskResult(None if task.image else clean, chunks)

    monkeypatch.setattr(job, "_MOST_TASKS", most)
    monkeypatch.setattr(work, "perform", perform)
    store = RunFile(tmp_path / "run", {"campaign": {}, "seed": 1})
    options = job.RunOptions(1, tmp_path, 1, False, None)
    batch = job._Batch(Campaign.of(task1), options, 3 * work.CHUNK, "scalar_rgb", store, lambda *_: None)
    with Counting(1) as executor:
        batch._work(job.Crew(executor, lambda: 3))
    assert (max(count), len(count)) == (together, submitted)
    assert store.images() == batch.done == batch.total == 16 * 3 * work.CHUNK
    assert sorted((index, k) for index, chunks in done for k, _ in chunks) == [
        (i, k) for i in range(16) for k in range(3)
    ]
    store.close()
