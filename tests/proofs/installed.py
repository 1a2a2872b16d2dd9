"""``python -m tests.proofs installed``: installed by any Python, not editable, every command answers from elsewhere."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Annotated

import typer

ROOT = Path(__file__).parents[2]
_POSES = ("--sensor", "30,135", "--light", "15,315")
_BOX = """
import trimesh, numpy, cv2
trimesh.creation.box((30, 20, 10)).export("box.stl")
squares = numpy.kron(numpy.indices((7, 9)).sum(0) % 2, numpy.ones((24, 24)))
board = cv2.copyMakeBorder((40 + 170 * squares).astype("uint8"), 60, 60, 60, 60, cv2.BORDER_CONSTANT, value=210)
for k, turn in enumerate((-0.15, 0.0, 0.2)):
    ends = numpy.float32([[0, 0], [335, 0], [335, 287], [0, 287]])
    there = ends + numpy.float32([[40 * turn, 9 * k], [20, 60 * turn], [-9 * k, 0], [30 * turn, -50 * turn]])
    seen = cv2.warpPerspective(board, cv2.getPerspectiveTransform(ends, there), (336, 288), borderValue=210)
    cv2.imwrite(f"{k}.png", seen)
"""
_COMMANDS = (
    ("scenes",), ("show", "task1"), ("effects", "task1"), ("predict", "task1", *_POSES),
    ("budget", "calibrated_rig", "--monte-carlo"), ("plan", "task1", "--step", "15", "--check", "1"),
    ("render", "task1", *_POSES, "--noise-seed", "1", "-o", "a.png"), ("measure", "a.png", "task1", *_POSES),
    ("measure", "a.png"), ("fit", "task1", "a.png", *_POSES), ("new", "box.stl"),
    ("calibrate", "task1", "--images", "10"),
    ("calibrate-camera", "0.png", "1.png", "2.png", "--square", "20", "--model", "none"),
    ("validate", "box.toml", "--renders", "20", "--workers", "2", "--out", "run"), ("report", "run"),
    ("compare", "run", "run"), ("cost", "box.toml", "--budget", "5s", "--out", "cost"), ("hard", "--area", "planner"),
)  # fmt: skip


def installed(
    python: Annotated[str, typer.Option(help="The interpreter.")] = "python3",
    extras: Annotated[str, typer.Option(help="Of the package.")] = "explore,frames",
) -> None:
    """Install into a new environment, not editable, and run every command but `explore` from another folder."""
    with tempfile.TemporaryDirectory() as folder:
        made, work = Path(folder) / "environment", Path(folder) / "work"
        work.mkdir()
        began = time.monotonic()
        subprocess.run([python, "-m", "venv", made], check=True)
        asked = [made / "bin/pip", "install", "-q", "-c", ROOT / "constraints.txt", f"{ROOT}[{extras}]"]
        subprocess.run(asked, check=True, stderr=subprocess.DEVNULL)
        environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}

        def run(*command: str | Path) -> subprocess.CompletedProcess:
            return subprocess.run(command, cwd=work, env=environment, capture_output=True, text=True)

        version = run(made / "bin/python", "-VV").stdout.strip()
        print(f"{version}: installed in {time.monotonic() - began:.0f} s", flush=True)
        assert run(made / "bin/python", "-c", _BOX).returncode == 0
        wrong = [command for command in _COMMANDS if not _answers(run(made / "bin/ice", *command, "--json"), command)]
    print(f"{len(_COMMANDS) - len(wrong)} of {len(_COMMANDS)} commands answer")
    raise typer.Exit(bool(wrong))


def _answers(done: subprocess.CompletedProcess, command: tuple[str, ...]) -> bool:
    """A JSON document and an exit status that is an answer; what is not is printed."""
    try:
        json.loads(done.stdout)
        good = done.returncode in (0, 1)
    except json.JSONDecodeError:
        good = False
    if not good:
        print(f"ice {' '.join(command)}: {done.returncode} {done.stdout[-200:]} {done.stderr[-400:]}", flush=True)
    return good
