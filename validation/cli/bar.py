"""The progress bar of a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from validation.cli.common import Report


@contextmanager
def bar(errors: Console, title: str, unit: str, at_once: bool = False) -> Iterator[Report]:
    """A bar with rate and time left, ``at_once`` with what is done; it goes when the work is done."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(unit),
        _Rate(),
        _Left(),
    )
    with Progress(*columns, console=errors, transient=True) as shown:
        task = shown.add_task(title, total=None)

        def report(what: str, done: int, total: int) -> None:
            if shown.tasks[0].total is None:  # what an earlier session has done says nothing about the rate
                shown.reset(task, completed=done, total=total)
            shown.update(task, completed=done, total=total, description=f"{title}: {what}" if at_once else title)

        yield report


class _Rate(ProgressColumn):
    """Images a second."""

    def render(self, task: Task) -> str:
        return "" if not task.speed else f"{task.speed:.0f}/s"


class _Left(TimeRemainingColumn):
    """Time left, in words."""

    def render(self, task: Task) -> Text:
        return super().render(task) + " left"
