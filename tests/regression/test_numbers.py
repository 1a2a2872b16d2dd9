"""Does the library still say what it said when it was stored? Wide, shallow: every bundled scene, every model, small.

``python -m tests.regression.test_numbers`` stores it anew after a change that was wanted (`make reference`), of all
cases or of those that begin as its arguments. Poses have no symmetry; statuses and words are compared exactly.
"""

import sys
from pathlib import Path

import pytest

from tests.regression.numbers import (
    beside,
    checking,
    drawing,
    exploring,
    files,
    fitted,
    holes,
    inside,
    measuring,
    parts,
    photographed,
    planning,
    rare,
    refusing,
    reporting,
    running,
    working,
)  # fmt: skip
from tests.regression.stored import differences, read, told, uncompiled, write

pytestmark = pytest.mark.render

STORED = Path(__file__).with_name("numbers.json")
_ABOUT = (
    planning, parts, measuring, checking, working, inside, photographed, holes, rare, beside, files, reporting,
    exploring, running, refusing, fitted, drawing,
)  # fmt: skip
CASES = {name: case for about in _ABOUT for name, case in about.cases().items()}


@pytest.mark.parametrize("name", CASES)
def test_the_library_says_what_was_stored(name):
    rel, make = CASES[name]
    with uncompiled():
        made = make()
    assert list(differences(read(STORED)[name], told(made), rel)) == []


if __name__ == "__main__":
    known = read(STORED) if STORED.exists() else {}
    anew = [name for name in CASES if name.startswith(tuple(sys.argv[1:] or [""]))]
    with uncompiled():
        made = {name: told(CASES[name][1]()) for name in anew}
    write(STORED, {name: made.get(name, known.get(name)) for name in CASES})
