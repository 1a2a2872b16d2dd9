"""Parts of a run, made by machines that share nothing, are together the run of one machine."""

from itertools import combinations

import pytest

from render import Quality
from scenes import InvalidInput
from validation.batch.job import run_by
from validation.batch.merged import merged
from validation.batch.options import RunOptions
from validation.batch.result import WAITING
from validation.batch.shard import Shard
from validation.batch.work import Rendering
from validation.report import export

pytestmark = pytest.mark.render
QUICK = Rendering(Quality(supersample=1, edge_samples=4))


@pytest.fixture(scope="module")
def three(small_task1):
    return small_task1.model_copy(update={"settings": small_task1.settings[:12:5]})


def run(scene, out, shard=Shard(), seed=3):
    return run_by(RunOptions(seed, out, 1, rendering=QUICK, shard=shard), scene, 4)


@pytest.fixture(scope="module")
def parts(three, tmp_path_factory):
    """Both parts' directories, and what the first has found."""
    folder = tmp_path_factory.mktemp("parts")
    found = [run(three, folder / str(i), Shard(i, 2)) for i in (1, 2)]
    return [folder / "1", folder / "2"], found


def tables(found, folder):
    written = export.write_csv(found, folder / "table.csv"), export.write_measurands(found, folder / "measurands.csv")
    return [file.read_bytes() for file in written]


def test_parts_together_are_the_run_of_one_machine(three, parts, tmp_path):
    """Tables are equal byte by byte, the verdict word by word; what each part left undone it says."""
    directories, (first, second) = parts
    assert [len(first.rows), len(second.rows)] == [2, 1]
    assert first.refused == {1: WAITING}
    assert second.refused == dict.fromkeys((0, 2), WAITING)
    whole = run(three, tmp_path / "whole")
    _, found = merged(directories, tmp_path / "merged")
    assert tables(found, tmp_path / "merged") == tables(whole, tmp_path / "whole")
    assert found.verdict.text == whole.verdict.text
    assert not found.refused
    one, other = ({**each.to_json(), "seconds": 0} for each in (found, whole))
    assert one == other


def test_a_merged_run_goes_on_with_what_no_part_holds(three, parts, tmp_path):
    _, found = merged(parts[0][:1], tmp_path / "merged")
    assert found.refused == {1: WAITING}
    again = run(three, tmp_path / "merged")
    assert not again.refused
    assert tables(again, tmp_path)  # margin: only that they can be written


def test_parts_of_other_runs_and_the_same_part_twice_are_refused(three, parts, tmp_path):
    first, second = parts[0]
    with pytest.raises(InvalidInput, match=r"must hold other settings than .*, got 0 in both"):
        merged([first, second, first], tmp_path / "twice")
    run(three, tmp_path / "other", Shard(2, 2), seed=4)
    with pytest.raises(InvalidInput, match=r"must be of the same run as .*, got one where seed is 3, not 4"):
        merged([first, tmp_path / "other"], tmp_path / "mixed")
    with pytest.raises(InvalidInput, match="must be a run directory"):
        merged([first, tmp_path / "nothing"], tmp_path / "missing")


def test_shards_are_all_settings_each_once():
    for of in (1, 2, 3, 7):
        every = [set(Shard(i, of).settings(7)) for i in range(1, of + 1)]
        assert set().union(*every) == set(range(7))
        assert not any(one & other for one, other in combinations(every, 2))


@pytest.mark.parametrize("text", ["0/2", "3/2", "1", "1/0", "a/b", "1/2/3", "-1/2", "٢/٣"])
def test_what_is_no_shard_is_refused(text):
    with pytest.raises(InvalidInput, match="shard must be i/n"):
        Shard.parse(text)


def test_a_shard_without_settings_is_refused(three, tmp_path):
    with pytest.raises(InvalidInput, match=r"shard must be one of as many as there are settings \(3\)"):
        run(three, tmp_path / "none", Shard(4, 4))
