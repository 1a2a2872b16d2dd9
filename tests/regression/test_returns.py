"""Does each function still give what it gave, in some calls of stored cases?

End results feel little of a slip on the way: an index, a factor, an axis, a sign of what is later averaged, compared
with a limit or drawn. So the cases of ``test_numbers`` are run once more and every function that they call is looked
at: what it was given and gave, and what its own names held when it ended, as digests (``tests.regression.digest``).

``python -m tests.regression.test_returns`` stores them anew after a change that was wanted (`make reference`), a line a
function, so that a reviewer sees which have changed; with ``--choose`` it first chooses anew which cases are run. What
is stored is what agrees between runs: once more in a process, in another order, folder and home, with other hashes,
clocks and cores, of an edited program, and on the processors of ``tests.machines``; what differs there is told less
exactly, or left out. With ``--loosen`` what one more processor does not give is left out of what is stored.
"""

from __future__ import annotations

import sys

import pytest

from tests.regression.kept import STORED, by_case, different
from tests.regression.returns import recorded
from tests.regression.test_numbers import CASES

pytestmark = pytest.mark.render

_SHOWN = 12  # functions


@pytest.mark.parametrize("name", by_case(STORED))
def test_functions_give_what_was_stored(name):
    found = different(by_case(STORED)[name], recorded(CASES[name][1]))
    assert not found, "\n".join(found[:_SHOWN])


if __name__ == "__main__":
    from tests.regression import storing

    if "--loosen" in sys.argv[1:]:
        storing.loosen()
    else:
        storing.store(choose="--choose" in sys.argv[1:])
