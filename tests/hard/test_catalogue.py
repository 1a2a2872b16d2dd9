"""Every case of the catalogue (``ice hard``): right within its stated tolerance, or refused with a reason."""

import math

import pytest

from validation.hard import Answer, Case, Reference, catalogue, run
from validation.hard.case import EPSILON, TIGHT, judge

CASES = catalogue()


@pytest.mark.parametrize("case", CASES, ids=[f"{c.area}: {c.name}, {c.measurand}" for c in CASES])
def test_right_or_refused(case):
    row = run(case)
    assert row.verdict in ("right", "refused"), row
    for number in (row.ours, row.reference, row.error, row.tolerance):
        assert number is None or not math.isnan(number)
    if row.kind == "mpmath" and row.verdict == "right":
        assert row.error <= (TIGHT if row.condition < 1e4 else 10 * row.condition * EPSILON)


def test_the_issue_is_covered():
    """The catalogue is not empty where it matters, and most of it is numbers, not refusals."""
    rows = [(case.area, case.name) for case in CASES]
    assert {area for area, _ in rows} >= {"reflectance", "planner", "limb", "fit", "measure"}
    assert len(rows) > 150
    assert len({(c.area, c.name, c.measurand) for c in CASES}) == len(CASES)


@pytest.mark.parametrize(
    ("answer", "truth", "verdict"),
    [
        (Answer(1.0), Reference.precise(1 + 1e-9, 10.0), "WRONG"),
        (Answer(1.0), Reference.precise(1 + 1e-11, 10.0), "right"),
        (Answer(1.0), Reference.precise(1 + 1e-9, 1e6), "right"),
        (Answer(math.nan), Reference.precise(1.0, 10.0), "WRONG"),
        (Answer(math.nan), Reference(None, "rule"), "WRONG"),
        (Answer(1.0, "ok"), Reference(None, "rule"), "WRONG"),
        (Answer(None, ""), Reference(None, "rule"), "WRONG"),
        (Answer(None, "short"), Reference.precise(1.0, 10.0), "WRONG"),
        (Answer(None, "short"), Reference(None, "mpmath", reason="low_contrast"), "WRONG"),
        (Answer(5.0, "low_contrast"), Reference.precise(1.0, 1e16), "refused"),
        (Answer(5.0, "ok"), Reference.precise(1.0, 1e16), "WRONG"),
    ],
)
def test_the_verdict_can_fail(answer, truth, verdict):
    error = None if answer.value is None or truth.value is None else abs(answer.value / truth.value - 1)
    assert judge(Case("fit", "", "", lambda: answer, lambda: truth), answer, truth, error) == verdict
