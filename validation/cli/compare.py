"""``ice compare``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenes import InvalidInput
from validation.cli.common import Json, commands, say

commands = commands()

_Run = typer.Argument(help="Run directory, or a result.json.")


@commands.command("compare")
def compare_command(
    before: Annotated[Path, _Run],
    after: Annotated[Path, _Run],
    level: Annotated[float, typer.Option(help="Probability of a false alarm for all settings together.")] = 0.01,
    as_json: Json = False,
) -> None:
    """Which settings changed beyond chance from one run to another? Exit status 1 if any did.

    Tests every estimator in every setting: its variance (F test), mean (Welch) and failed images (Fisher), with Sidak's
    correction for all of them.
    """
    if not 0 < level < 1:
        raise InvalidInput(f"--level must be between 0 and 1, got {level:g}")
    from validation import comparison

    found = comparison.compare(*map(comparison.read, (before, after)), level)
    lines = [found.text]
    lines += [
        f"  {c.setting} {c.method}: {c.what} {c.before:.4g} -> {c.after:.4g}, p = {c.p_value:.2g}"
        for c in found.changed
    ]
    for words, keys in (("before", found.only_before), ("after", found.only_after)):
        if keys:
            lines.append(f"  only {words}, not compared: {len(keys)}, as {keys[0]}")
    say(found.to_json(), as_json, "\n".join(lines))
    raise typer.Exit(1 if found.changed else 0)
