"""Scenes whose uncertainties, tolerances and texts are absurd or odd, as commands print them on odd streams."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np

from scenes import InvalidInput
from scenes.load import BUNDLED
from tests import commands

_NUMBERS = (
    "1e300", "1e12", "-1", "nan", "inf", "5e-324", "1e-30", "0", "1e3", "{sd = 1e12, dof = 1e12}",
    "{half_width = 1e-29}",
    '{sd = 1e12, dof = 3, distribution = "t"}', "{sd = 1, dof = 1e-3}", "{value = 1e300, sd = 1}",
)  # fmt: skip
_KEYS = (
    "sensor_deg", "sensor_roll_deg", "sensor_distance", "light_deg", "part_shift", "part_tilt_deg",
    "principal_point_px", "temperature_K", "expansion_per_K", "rounding", "rounding_deg", "process_sd",
)  # fmt: skip
_TEXTS = ("[mm]", "[/x]", "[link=x]", ":smile:", "\u2603 \u0416", "$\\foo$", "\\", "a\u202eb", "{x} {task.y}", "%s")
_COMMANDS = (
    ("predict",), ("predict", "--model", "bound"), ("show",), ("effects",), ("budget",), ("budget", "--reach", "1e-3"),
    ("budget", "--p", "0.9999"),
)  # fmt: skip


def uncertain(rng: np.random.Generator, folder: Path) -> str:
    """One command on a scene with one to three odd things; what it has printed, and its one line, are looked at."""
    words = [str(word) for word in _COMMANDS[rng.integers(len(_COMMANDS))]]
    path = folder / "uncertain.toml"
    path.write_text(_scene(rng), encoding="utf-8")
    asked = [*words, str(path), *(["--json"] if rng.random() < 0.3 else [])]
    stream = (_unicode, _ascii, _closed)[rng.integers(3)]()
    status, out, err = printed(asked, stream)
    if status not in (0, 1, 2) or "Traceback" in err or "internal error" in err:
        raise AssertionError(f"{asked}: exit status {status}: {err[:300]}")
    if "--json" in asked and status == 0 and stream is not None:
        json.loads(out, parse_constant=_refused)
    if status == 2:
        raise InvalidInput(err.strip())
    return f"exit status {status}"


def printed(arguments: list[str], stream: io.TextIOWrapper | None) -> tuple[int, str, str]:
    """Exit status of ``ice ARGUMENTS`` in this process, and what it printed; ``stream`` is its standard output."""
    err = io.StringIO()
    code = commands.status(arguments, stream, err)
    text = "" if stream is None else stream.buffer.getvalue().decode(stream.encoding)
    return code, text, err.getvalue()


def _scene(rng: np.random.Generator) -> str:
    text = (BUNDLED / "calibrated_rig.toml").read_text()
    for what in rng.integers(4, size=rng.integers(1, 4)):
        number, odd = str(rng.choice(_NUMBERS)), "'" + str(rng.choice(_TEXTS)) + "'"
        if what == 0:
            key = str(rng.choice(_KEYS))
            head, _, rest = text.partition("[uncertainty]\n")
            kept = "".join(line for line in rest.splitlines(True) if not line.startswith(f"{key} ="))
            text = f"{head}[uncertainty]\n{key} = {number}\n{kept}"
        elif what == 1:
            text = text.replace("tolerance = 0.05", f"tolerance = {number}").replace("sd = 0.1", f"sd = {number}")
        elif what == 2:
            text = text.replace('"diagonal"', odd)
        else:
            text = text.replace('"The block', odd + " # ")
    return text


def _unicode() -> io.TextIOWrapper:
    return io.TextIOWrapper(io.BytesIO(), encoding="utf-8")


def _ascii() -> io.TextIOWrapper:
    return io.TextIOWrapper(io.BytesIO(), encoding="ascii")


def _closed() -> None:
    return None


def _refused(word: str) -> None:
    raise AssertionError(f"JSON must hold no {word}")
