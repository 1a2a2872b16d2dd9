"""Runs of pytest from a process that has loaded everything but this project: seconds sooner than a new one each time.

``python -m tests.proofs.forked`` in a copy of the repository takes a line of JSON (arguments, processor seconds) and
answers with one (exit status of pytest, what it printed); each run is a child of its own.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import resource
import subprocess
import sys
import tempfile
import traceback
from pathlib import Path

_LOADED = (
    "cv2", "jinja2", "matplotlib.pyplot", "mitsuba", "mpmath", "numpy", "pydantic", "pytest",
    "rich.console", "rich.table", "scipy.interpolate", "scipy.ndimage", "scipy.optimize", "scipy.sparse",
    "scipy.spatial", "scipy.special", "scipy.stats", "skimage", "sqlalchemy", "trimesh", "typer.testing",
    "uncertainties",
)  # fmt: skip


class Runner:
    """The process of one copy, begun when it is first asked."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._process: subprocess.Popen[str] | None = None

    def run(self, tests: list[str], seconds: int) -> tuple[int, str]:
        """Exit status of pytest with these tests (negative where a signal ended it), and what it printed."""
        if self._process is None:
            kept = {"PYTHONPATH": str(self._root), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
            self._process = subprocess.Popen(
                [sys.executable, "-B", "-m", "tests.proofs.forked"], cwd=self._root, env={**os.environ, **kept},
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            )  # fmt: skip
        asked, answers = self._process.stdin, self._process.stdout
        if asked is None or answers is None:
            raise RuntimeError("the process must have streams, got none")
        asked.write(json.dumps([tests, seconds]) + "\n")
        asked.flush()
        code, said = json.loads(answers.readline())
        return code, said


def _child(tests: list[str], seconds: int, output: str) -> None:
    """Never comes back."""
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    code = 3
    try:
        number = os.open(output, os.O_WRONLY)
        os.dup2(number, 1)
        os.dup2(number, 2)
        import pytest

        code = int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", *tests]))
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def main() -> None:
    """Answer until the input ends."""
    for name in _LOADED:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    for line in sys.stdin:
        tests, seconds = json.loads(line)
        with tempfile.NamedTemporaryFile() as output:
            child = os.fork()
            if not child:
                _child(tests, seconds, output.name)
            code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            said = Path(output.name).read_text(encoding="utf-8", errors="replace")
        print(json.dumps([code, said[-20_000:]]), flush=True)


if __name__ == "__main__":
    main()
