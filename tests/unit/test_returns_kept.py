"""Digests of values, the recorder of what functions gave, and which of it is stored and compared."""

import math
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest

from render import variant
from scenes import Pose
from tests.regression import kept
from tests.regression.digest import Digest, Digester
from tests.regression.returns import Recorder, forget, recorded
from validation import statistics


@dataclass(frozen=True)
class Record:
    """A few of each kind."""

    at: tuple[float, ...] = (1.0, 2.0, 3.0)
    image: np.ndarray = None
    count: int = 3
    state: str = "ok"
    is_known: bool = True
    pose: Pose = Pose(20.0, 130.0)


def record(**changes):
    return replace(Record(image=np.arange(12.0).reshape(3, 4) ** 2), **changes)


def digest(value):
    return Digester().of(value)


IMAGE = record().image
SLIPS = {
    "a sign": {"at": (1.0, -2.0, 3.0)}, "a factor": {"at": (1.0, 2.0, 6.0)}, "an order": {"at": (2.0, 1.0, 3.0)},
    "one more": {"at": (1.0, 2.0, 3.0, 3.0)}, "no number": {"at": (1.0, math.nan, 3.0)},
    "no end": {"at": (1.0, math.inf, 3.0)}, "a millionth": {"at": (1.000003, 2.0, 3.0)},
    "a pixel": {"image": IMAGE + np.eye(3, 4)}, "an axis": {"image": IMAGE[:, ::-1]}, "a shape": {"image": IMAGE.T},
    "none": {"image": None}, "a count": {"count": 4}, "a word": {"state": "okay"}, "a truth": {"is_known": False},
    "degrees": {"pose": Pose(math.radians(20.0), 130.0)}, "an angle for another": {"pose": Pose(130.0, 20.0)},
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_another_digest(slip):
    """What is exact is compared as it is, numbers within a millionth of one of them."""
    one, other = digest(record()), digest(record(**SLIPS[slip]))
    # margin: three millionths of one of six numbers, weighted by its place
    assert one.exact != other.exact or abs(one.number - other.number) > 1e-6


def test_rounding_is_the_same_digest():
    """A relative 1e-9 of all numbers, and 1e-17 for a zero: a fifth of the least tolerance at most."""
    one = digest([record(), 0.0, [0.1, 0.2], np.array([1e9, 2.0])])
    near = record(at=(1.0 + 1e-9, 2.0, 3.0), image=IMAGE * (1 + 1e-9))
    other = digest([near, 1e-17, [0.1, 0.2 * (1 + 1e-9)], np.array([1e9, 2.0]) * (1 + 1e-9)])
    assert one.exact == other.exact
    assert abs(one.number - other.number) < 2e-7


@pytest.mark.parametrize(
    ("one", "other", "exact", "wordless"),
    [
        ("/tmp/abc/x.png: 3 px", "/home/me/x.png: 3 px", True, True),
        ("3 px", "4 px", False, True),
        ("3 px", "3 mm", False, False),
        ("of 0123456789abcdef", "of fedcba9876543210", True, True),
        ("mitsuba 3.9.1", "mitsuba 3.9.2", True, True),
        (b"one", b"another", True, True),  # files of the program are read as such
    ],
)
def test_what_is_told_of_words(one, other, exact, wordless):
    one, other = digest(one), digest(other)
    assert (one.exact == other.exact, one.wordless == other.wordless) == (exact, wordless)


def calls_of(make):
    forget()
    recorder = Recorder()
    with recorder.recording():
        make()
    return recorder.calls


def stored(make):
    """Lines of each function, as they would be stored."""
    return {function: cases["case"] for function, cases in kept.kept([{"case": calls_of(make)}]).items()}


def interval():
    return statistics.ratio_interval(1.3, 40)


def _third(freedom, level):
    tail = (1 - level) / 3
    return float(special.chdtri(freedom, 1 - tail)), float(special.chdtri(freedom, tail))  # noqa: F821


def _on_the_way(freedom, level):
    tail = level - 1
    return float(special.chdtri(freedom, 1 + tail / 2)), float(special.chdtri(freedom, -tail / 2))  # noqa: F821


QUANTILES, RATIO = "validation/statistics.py:_quantiles", "validation/statistics.py:ratio_interval"


@pytest.mark.parametrize(
    ("slip", "noticed"),
    [
        (_third, [f"{QUANTILES}: call 1, what it was given or gave", f"{RATIO}: call 1, what it was given or gave"]),
        (_on_the_way, [f"{QUANTILES}: call 1, what it held on the way"]),
    ],
)
def test_a_planted_slip_is_noticed(monkeypatch, slip, noticed):
    """In what a function gives, which another hands on; and in what no result shows."""
    before = stored(interval)
    assert kept.different(before, calls_of(interval)) == []
    function = statistics._quantiles.__wrapped__
    known = function.__code__
    names = {"co_filename": known.co_filename, "co_name": known.co_name, "co_qualname": known.co_qualname}
    monkeypatch.setattr(function, "__code__", slip.__code__.replace(**names))
    found = sorted(line.split(": stored")[0] for line in kept.different(before, calls_of(interval)))
    assert found == noticed


def test_what_is_kept_hides_no_call():
    """The first calls are the same whatever was called before."""
    first = calls_of(interval)
    interval()
    assert calls_of(interval) == first
    assert list(first) == [QUANTILES, RATIO]


def replace_line(before, function, way):
    """Without what is said in one way: it did not agree."""
    return before | {function: [kept._NO if i == way else line for i, line in enumerate(before[function])]}


def test_functions_that_are_gone_and_new_ones_and_numbers_of_calls():
    before, now = stored(interval), calls_of(interval)
    assert kept.different(before, now | {"a.py:new": now[RATIO]}) == []
    held = replace_line(before, RATIO, 1)
    assert kept.different(held, now) == []
    gone = f"{RATIO}: is not called any more (python -m tests.regression.test_returns stores anew)"
    assert kept.different(before, {QUANTILES: now[QUANTILES]}) == [gone]
    assert kept.different(before, now | {RATIO: now[RATIO] * 2})[0].startswith(f"{RATIO}: call 2, ")
    twice = stored(lambda: [interval(), interval()])
    assert kept.different(twice, now)[0].endswith("got no call")


def test_what_one_more_processor_gives_otherwise_is_left_out():
    """Of the function that differs what differs, the rest stays; nothing where all is given."""
    before, now = {f: {"case": lines} for f, lines in stored(interval).items()}, {"case": calls_of(interval)}
    assert kept.otherwise(before, now) == set()
    first, way = before[RATIO]["case"]
    digits = first.split()
    other = " ".join([*digits[:2], "00000000" + digits[2][8:]])
    assert other != first
    changed = before | {RATIO: {"case": [other, way]}}
    apart = kept.otherwise(changed, now)
    assert apart == {(RATIO, "case", kept._WAYS[0])}
    told = kept.loosened(changed, apart)
    assert told[QUANTILES] == before[QUANTILES]
    assert told.get(RATIO, {"case": ["-", "-"]}) == {"case": ["-", way]}


def test_what_has_not_changed_stays_as_it_was_stored():
    """As exactly as before; what has changed is stored as it is found."""
    before, now = {f: {"case": lines} for f, lines in stored(interval).items()}, {"case": calls_of(interval)}
    first, way = before[RATIO]["case"]
    loose = before | {RATIO: {"case": ["-", way]}}
    assert kept.still(before, loose, kept.otherwise(loose, now)) == loose
    digits = first.split()
    other = " ".join([*digits[:2], "00000000" + digits[2][8:]])
    changed = before | {RATIO: {"case": [other, "-"]}}
    assert kept.still(before, changed, kept.otherwise(changed, now))[RATIO] == {"case": [first, "-"]}
    assert kept.still(before, {}, set()) == before


def test_what_processors_give_otherwise_is_not_stored():
    """What was told apart once stays out when returns are stored anew on one processor."""
    apart = kept.entries(kept.APART)
    assert apart
    assert kept.loosened(kept.read(kept.STORED), apart) == kept.read(kept.STORED)


def test_cases_render_uncompiled_whatever_is_there(monkeypatch):
    seen = []
    monkeypatch.setenv(variant.OVERRIDE, variant.LLVM)
    variant.choose.cache_clear()
    assert variant.choose() == variant.LLVM
    recorded(lambda: seen.append(variant.choose()))
    assert seen == [variant.SCALAR]
    assert variant.choose() == variant.LLVM
    variant.choose.cache_clear()


def test_who_listened_before_listens_on():
    """As `tests.proofs.reach` does, which asks what a test calls."""
    heard = []
    sys.setprofile(lambda frame, event, _: heard.append(frame.f_code.co_name) if event == "call" else None)
    try:
        calls_of(interval)
    finally:
        sys.setprofile(None)
    assert {"ratio_interval", "_quantiles"} <= set(heard)


@pytest.mark.parametrize(
    ("runs", "line"),
    [
        ([(1, 2, 5.0), (1, 2, 5.0 + 1e-8)], "exact 1e-06 00000001:5."),
        ([(1, 2, 5.0), (9, 2, 5.0)], "wordless 1e-06 00000002:5."),
        ([(1, 2, 5.0), (1, 2, 5.0003)], "wordless 0.002 00000002:5."),
        ([(1, 2, 5.0), (9, 8, 5.0)], "- 1e-06 -:5."),
        ([(1, 2, 5.0), (1, 2, 5.009)], "wordless 0.05 00000002:5."),
        ([(1, 2, 5.0), (1, 2, 5.011)], "wordless - 00000002:-"),
        ([(1, 2, 5.0), (9, 8, 6.0)], "-"),
    ],
)
def test_what_is_stored_is_what_agrees(runs, line):
    """A fifth of each tolerance; where numbers are another machine's, so may the digits of words be."""
    assert kept.line([[Digest(*run)] for run in runs]) == line
    assert kept.line([*([Digest(*run)] for run in runs), []]) == "-"


def test_cases_are_chosen_by_what_they_show_in_a_second():
    """Each function in three cases where it gave something else, as long as there is time."""
    gave = {"a": {"f": 1, "g": 1}, "b": {"f": 2}, "same": {"f": 1}, "c": {"f": 3}, "d": {"f": 4}, "slow": {"h": 1}}
    seconds = {"a": 0.1, "b": 0.1, "same": 0.2, "c": 0.2, "d": 0.3, "slow": 9.0}
    assert kept.chosen(seconds, gave, 20.0) == ["a", "b", "c", "slow"]
    assert kept.chosen(seconds, gave, 8.0) == ["a", "b", "c"]
