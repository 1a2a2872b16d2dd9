"""A run of a million settings is reported in less than 1 GiB: what each setting adds, from two small runs."""

import gc
import json
import tracemalloc

import pytest

from tests.proofs.large import fabricate
from validation.batch.document import pieces
from validation.batch.result import collect
from validation.batch.store import RunFile
from validation.report import export

pytestmark = pytest.mark.render

PER_SETTING = (1024 - 200) * 2**20 / 1e6  # bytes, 864: 200 MiB are the program's; measured: 738
WRITING = 900_000  # bytes, however many settings there are; most is garbage of JSON's that is not yet collected


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    directories = [tmp_path_factory.mktemp("large") for _ in range(2)]
    return [(directory, fabricate(size, directory)) for directory, size in zip(directories, (81, 1296), strict=True)]


def memory(directory, use):
    """Largest memory of collecting a run, and what using it takes on top, bytes."""
    store = RunFile.reopen(directory)
    gc.collect()
    gc.freeze()  # else what the other tests keep decides when garbage is collected
    gc.collect()
    tracemalloc.start()
    try:
        found = collect(store.campaign(), store)
        collected = tracemalloc.get_traced_memory()[1]
        tracemalloc.reset_peak()
        before = tracemalloc.get_traced_memory()[0]
        use(found, directory)
        return collected, tracemalloc.get_traced_memory()[1] - before
    finally:
        tracemalloc.stop()
        gc.unfreeze()
        store.close()


def write(found, directory):
    export.write_csv(found, directory / "table.csv")
    export.write_json(found, directory / "result.json")


def test_memory_of_a_setting(runs):
    """And the control: rows as objects would take what writing must not."""
    (small, few), (large, many) = runs
    memory(small, write)  # what is loaded or cached once
    (first, _), (last, writing) = memory(small, write), memory(large, write)
    assert (last - first) / (many - few) < PER_SETTING
    assert writing < WRITING
    assert memory(large, lambda found, _: list(found.rows))[1] > 2 * WRITING


def test_pieces_are_the_document(runs):
    """Key by key in its order, a line each setting, with more keys, and with settings that were refused."""
    directory, size = runs[0]
    store = RunFile.reopen(directory)
    try:
        found = collect(store.campaign(), store)
    finally:
        store.close()
    assert len(found.rows) == size
    text, told = "".join(pieces(found)), found.to_json()
    assert json.dumps(json.loads(text)) == json.dumps(told)
    assert text.splitlines()[text.splitlines().index(' "settings": [') + 1 :][:size] == [
        f"  {json.dumps(each)}{',' * (number < size - 1)}" for number, each in enumerate(told["settings"])
    ]
    found.refused.update({7: 'a "settings": [] and\n "refused": []', 8: "b"})
    more = json.loads("".join(pieces(found, {"goal": [1]})))
    assert json.dumps(more) == json.dumps(found.to_json() | {"goal": [1]})
    assert json.loads("".join(pieces(found)))["refused"][0]["reason"] == found.refused[7]
