"""What is wrong with a catalogue, for a terminal."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.text import Text

from scenes.catalogue import Catalogue, Contradiction


def report(found: Catalogue, wrong: tuple[Contradiction, ...]) -> RenderableType:
    """A line a contradiction, a line an entry that lacks something, and the counts."""
    lacking = [each for each in found.entries if each.missing]
    lines = [f"{each.entry}: {each.text}" for each in wrong]
    lines += [f"{each.told}: not for `ice design`, which needs {', '.join(each.missing)}" for each in lacking]
    telecentric = sum(each.is_telecentric for each in found.lenses)
    counts = f"{len(found.sensors)} sensors, {len(found.lenses)} lenses ({telecentric} telecentric)"
    ends = f"{counts}, {len(found.lights)} lights: {len(wrong) or 'no'} contradiction{'s' * (len(wrong) != 1)}"
    return Group(*(Text(line) for line in [*lines, f"{ends}, {len(lacking)} incomplete."]))
