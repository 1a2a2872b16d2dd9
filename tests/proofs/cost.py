"""Is what was asked for reached? Runs with several accuracies and budgets: ``python -m tests.proofs.cost task1``."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Annotated

import typer

from render import Quality
from validation.batch import campaign
from validation.batch.job import run
from validation.batch.options import RunOptions
from validation.cost.goal import Goal, reach, seconds
from validation.cost.interval import images

_ACCURACIES = [0.2, 0.1, 0.05, 0.02]
_BUDGETS = ["20s", "60s", "180s"]
_COLUMNS = "asked for", "half-width", "images", "seconds", "predicted s", "reached / asked", "best by hand s"
_SWEPT = (4, 16, 64)  # rays of a fine pixel at an edge, hand-tuned
_PLENTY = 1.15  # ratio of the widest setting, which whoever tunes by hand has to find, too


def main(
    scene: Annotated[str, typer.Argument(help="A bundled scene or a TOML file.")] = "task1",
    accuracy: Annotated[list[float], typer.Option(help="To be asked for; may be repeated.")] = _ACCURACIES,
    budget: Annotated[list[str], typer.Option(help="To be asked for; may be repeated.")] = _BUDGETS,
    hand: Annotated[bool, typer.Option(help="Also time fixed parameters, the rays swept, for each accuracy.")] = True,
) -> None:
    """Print asked-for and reached half-widths and seconds."""
    print(f"{scene}\n" + "".join(f"{name:>16}" for name in _COLUMNS), flush=True)
    for value in accuracy:
        _accuracy(scene, value, hand)
    for text in budget:
        _budget(scene, text)


def _accuracy(scene: str, value: float, hand: bool) -> None:
    loaded = campaign.load(scene)
    with tempfile.TemporaryDirectory() as folder:
        _, found = reach(loaded, Goal(value), RunOptions(out=Path(folder)))
    took = f"{_by_hand(loaded, value):.1f}" if hand else "-"
    _print(
        f"{value:g}", f"{found.widest:.4f}", _count(found.images), f"{found.seconds:.1f}",
        f"{found.choice.seconds + found.model.seconds:.1f}", f"{found.widest / value:.3f}", took,
    )  # fmt: skip


def _budget(scene: str, text: str) -> None:
    """As a user does: the whole command, start and pictures included."""
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "validation.cli",
            "validate",
            scene,
            "--budget",
            text,
            "--out",
            folder,
            "--json",
        ]
        done = subprocess.run(command, capture_output=True, check=False, text=True)
    if not done.stdout:
        print(f"{text:>16}  {done.stderr.strip()}", flush=True)
        return
    found = json.loads(done.stdout)["goal"]
    took = time.perf_counter() - began
    _print(
        text, f"{found['half_width']:.4f}", _count(found["images"]), f"{took:.1f}",
        f"{found['predicted']['seconds']:.1f}", f"{took / seconds(text):.3f}", "-",
    )  # fmt: skip


def _by_hand(loaded: campaign.Campaign, accuracy: float) -> float:
    """Seconds of the fastest of fixed parameters that reach the accuracy."""
    took = []
    for count in _SWEPT:
        began = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            run(loaded, images(accuracy / _PLENTY), 1, folder, quality=Quality(edge_samples=count))
        took.append(time.perf_counter() - began)
    return min(took)


def _print(*cells: str) -> None:
    print("".join(f"{cell:>16}" for cell in cells), flush=True)


def _count(images: tuple[int, ...]) -> str:
    return f"{min(images)}-{max(images)}"


if __name__ == "__main__":
    typer.run(main)
