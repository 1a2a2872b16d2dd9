"""A folder of parts' files through every command: new, show, plan, render, measure, validate; a table at the end.

Each command runs as a user would start it, in a process of its own, with its time and memory. What has been done stands
in a log and is not done again.
"""

from __future__ import annotations

import json
import math
import os
import re
import resource
import subprocess
import sys
import tempfile
import threading
import zlib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from scipy.stats import chi2

from scenes.parts import mesh, step

KINDS = (*mesh.FORMATS, *step.FORMATS)
MOST_SECONDS = 200  # of a command's processor
PATIENCE = 6  # times that on the wall, for a machine that does other things, too
COMMANDS = ("new", "show", "plan", "render", "measure", "validate")
VALIDATED = 3  # measurands
FAR = 4.0  # standard deviations that a value may be from the part's own
SIDAK = 0.01  # of all rows together
OFF = 0.3  # standard deviations that the mean of what is ok may be off, beside its own uncertainty
_VALUE = ("name", "status", "value", "nominal", "sigma", "u_bias")
_VALIDATED = ("name", "status", "value", "predicted", "n", "failed", "ratio", "bias", "u_bias", "render_noise")


@dataclass(frozen=True)
class Step:
    """A command on a part.

    Attributes
    ----------
    command : str
    status : int
        Its exit status; -24 or -9 where it ran out of time.
    seconds : float
        Of its processor.
    mebibytes : float
        Most that it held.
    told : str
        Its result in short, or the line by which it refused.
    rows : list of dict
        Of measurands that were measured or validated: what is said of each.
    """

    command: str
    status: int
    seconds: float
    mebibytes: float
    told: str
    rows: list[dict[str, Any]] = field(default_factory=list)


@dataclass(frozen=True)
class Asked:
    """What is done with each part.

    Attributes
    ----------
    until : str
        The last command.
    skipped : tuple of str
        Of ``show``, ``render`` and ``measure`` what is left out, for what follows does not need it.
    renders : int
        Of the first measurands.
    seconds : int
        Most of a command's processor.
    """

    until: str = COMMANDS[-1]
    skipped: tuple[str, ...] = ()
    renders: int = 200
    seconds: int = MOST_SECONDS


def run(seconds: int, command: str, *arguments: object) -> tuple[Step, dict[str, Any]]:
    """An ``ice`` command, and the document that it prints; empty where it prints none."""
    line = [sys.executable, "-P", "-m", "validation.cli.main", "-q", command, *map(str, arguments), "--json"]
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        process = subprocess.Popen(line, stdout=out, stderr=err)
        resource.prlimit(process.pid, resource.RLIMIT_CPU, (seconds, seconds + 1))
        watch = threading.Timer(PATIENCE * seconds, process.kill)
        watch.start()
        _, status, usage = os.wait4(process.pid, 0)
        watch.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)  # or it would be waited for again
        texts = [stream.seek(0) or stream.read() for stream in (out, err)]
    try:
        document = json.loads(texts[0])
    except ValueError:
        document = {}
    told = (texts[1].strip().splitlines() or [""])[-1]
    seconds, size = usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024
    return Step(command, process.returncode, seconds, size, told), document


def steps(part: Path, folder: Path, asked: Asked) -> Iterator[Step]:
    """All of a part, as far as it goes; each when it is asked for."""
    scene, ice = folder / "part.toml", partial(run, asked.seconds)
    made, facts = ice("new", part, "-o", scene)
    wanted = facts.get("measurands", [])
    yield _told(made, f"{sum(each['status'] in ('ok', 'glanced') for each in wanted)} of {len(wanted)} good")
    if made.status:
        return
    if "show" not in asked.skipped:
        yield ice("show", scene, "-o", folder / "names.png")[0]
    if not wanted:
        return
    planned, plan = ice("plan", scene, "--step", 15, "--no-check")
    yield _told(planned, f"worst {_worst(plan)}")
    if planned.status:
        return
    poses = [f"--{role}={','.join(map(repr, plan[role]))}" for role in ("sensor", "light")]
    yield from _one_picture(scene, poses, noise_seed(part.name), asked)
    few = folder / "few.toml"
    few.write_text(_only(scene.read_text("utf-8"), plan), "utf-8")
    judged, verdict = ice(
        "validate", few, "--renders", asked.renders, "--out", folder / "run", "--estimators", "gradient"
    )
    found = [row for setting in verdict.get("settings", []) for row in setting["measurands"]]
    told = verdict.get("verdict", "").split(";")[0]
    yield replace(_told(judged, told), rows=[{key: row.get(key) for key in _VALIDATED} for row in found])


def noise_seed(name: str) -> int:
    """Of a part's picture: with one seed for all, a rare draw of noise would be in all of them.

    Examples
    --------
    >>> noise_seed("x-carriage.stl") != noise_seed("LCD-knob.stl")
    True
    """
    return zlib.crc32(name.encode())


def _one_picture(scene: Path, poses: list[str], seed: int, asked: Asked) -> Iterator[Step]:
    """Rendered and measured, as far as asked for."""
    picture = scene.with_suffix(".png")
    if "render" in asked.skipped:
        return
    yield run(asked.seconds, "render", scene, *poses, "--noise-seed", seed, "-o", picture)[0]
    if "measure" in asked.skipped:
        return
    measured, values = run(asked.seconds, "measure", picture, scene, *poses)
    found = values.get("measurands", [])
    yield replace(_told(measured, _measured(found)), rows=[{key: row.get(key) for key in _VALUE} for row in found])


def _told(step_: Step, told: str) -> Step:
    """A command's result in short where it has one."""
    return step_ if step_.status == 2 or step_.told.startswith("internal") or not told else replace(step_, told=told)


def _worst(plan: dict[str, Any]) -> str:
    statuses = Counter(each["status"] for each in plan.get("measurands", []))
    return ", ".join(f"{count} {status}" for status, count in statuses.items())


def _measured(rows: list[dict[str, Any]]) -> str:
    """How many values are ok, and how many of these are too far from the part's own."""
    good = [row for row in rows if row["status"] == "ok"]
    far = sum(abs(row["value"] - row["nominal"]) > FAR * row["sigma"] for row in good)
    return f"{len(good)} of {len(rows)} ok, {far} more than {FAR:g} sigma off"


def _only(text: str, plan: dict[str, Any]) -> str:
    """A scene's text with its first measurands, at the poses of a plan."""
    count = iter(range(len(text)))
    text = re.sub(
        r"^\[\[measurands\]\]\n(?:.+\n)+\n?",
        lambda found: found[0] if next(count) < VALIDATED else "",
        text,
        flags=re.M,
    )
    for role in ("sensor", "light"):
        text = re.sub(rf"^{role} = .*$", f"{role} = {plan[role]}", text, flags=re.M)
    return text


def corpus(
    folder: Annotated[Path, typer.Argument(help="Of files of parts; those within its folders, too.")],
    renders: Annotated[int, typer.Option(help="Of the first three measurands.")] = 200,
    sample: Annotated[int, typer.Option(help="Only so many files, drawn with the seed; 0: all.")] = 0,
    seed: Annotated[int, typer.Option()] = 1,
    until: Annotated[str, typer.Option(help=f"The last command: {', '.join(COMMANDS)}.")] = COMMANDS[-1],
    skip: Annotated[
        list[str] | None, typer.Option(help="show, render (and measure) or measure; several times.")
    ] = None,
    seconds: Annotated[int, typer.Option(help="Most that a command may take of its processor.")] = MOST_SECONDS,
    log: Annotated[Path, typer.Option(help="What is done; begun anew where it is not there.")] = Path("corpus.jsonl"),
    jobs: Annotated[int, typer.Option(help="Parts at a time.")] = 1,
) -> None:
    """Parts from files through new, show, plan, render, measure and validate; resumable."""
    for word in (until, *(skip or ())):
        if word not in COMMANDS:
            raise typer.BadParameter(f"--until and --skip must be of {', '.join(COMMANDS)}, got {word!r}")
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in KINDS)
    if sample:
        files = [files[k] for k in np.random.default_rng(seed).permutation(len(files))[:sample]]
    known = {row["part"] for row in map(json.loads, log.read_text("utf-8").splitlines())} if log.exists() else set()
    parts, asked = (
        {str(part.relative_to(folder)): part for part in files},
        Asked(until, tuple(skip or ()), renders, seconds),
    )
    with ThreadPoolExecutor(jobs) as pool:  # of threads: each command is a process of its own
        names = {pool.submit(_taken, part, asked): name for name, part in parts.items() if name not in known}
        for number, done in enumerate(as_completed(names), 1):
            name, rows = names[done], done.result()
            with log.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"part": name, "steps": rows}) + "\n")
            print(f"{number}/{len(names)} {name}: " + "; ".join(map(_line, rows)), flush=True)
    print(table([json.loads(line) for line in log.read_text("utf-8").splitlines()]))


def _taken(part: Path, asked: Asked) -> list[dict[str, Any]]:
    with tempfile.TemporaryDirectory() as place:
        return [asdict(each) for each in _upto(asked.until, steps(part, Path(place), asked))]


def _upto(last: str, made: Iterator[Step]) -> Iterator[Step]:
    for each in made:
        yield each
        if each.command == last:
            return


def _line(row: dict[str, Any]) -> str:
    return f"{row['command']} {row['seconds']:.1f} s" + (f" ({row['told']})" if row["told"] else "")


def table(rows: list[dict[str, Any]]) -> str:
    """How many parts came through each command, in which time and memory; and why the others did not."""
    lines = [f"{len(rows)} parts", f"{'command':<10}{'parts':>6}{'done':>6}{'median s':>10}{'95 % s':>8}{'MiB':>7}"]
    for command in COMMANDS:
        found = [each for row in rows for each in row["steps"] if each["command"] == command]
        if found:
            middle, late = np.quantile([each["seconds"] for each in found], [0.5, 0.95])
            done, most = sum(each["status"] == 0 for each in found), max(each["mebibytes"] for each in found)
            lines.append(f"{command:<10}{len(found):>6}{done:>6}{middle:>10.1f}{late:>8.1f}{most:>7.0f}")
    for row in rows:
        for each in row["steps"]:
            if each["status"]:
                lines.append(f"  {row['part']}: {each['command']} ended with {each['status']}: {each['told'][:160]}")
    return "\n".join([*lines, *_off(rows), *_judged(rows)])


def _off(rows: list[dict[str, Any]]) -> list[str]:
    """Of what was measured in one picture each and is ``ok``: errors in u, those of sigma and u(bias) together."""
    errors = [
        (
            (each["value"] - each["nominal"]) / math.hypot(each["sigma"], each["u_bias"] or 0.0),
            row["part"],
            each["name"],
        )
        for row in rows
        for step_ in row["steps"]
        if step_["command"] == "measure"
        for each in step_["rows"]
        if each["status"] == "ok"
    ]
    if not errors:
        return []
    farthest, part, name = max(errors, key=lambda each: abs(each[0]))
    rms = math.sqrt(sum(error**2 for error, *_ in errors) / len(errors))
    return [f"{len(errors)} values ok: errors of {rms:.2f} u (rms), {farthest:+.1f} u at most ({part}, {name})"]


def _judged(rows: list[dict[str, Any]]) -> list[str]:
    """Of what was validated and is ``ok``: whether the variance is the one that is told, how far the mean is off."""
    found = [
        (row["part"], each)
        for row in rows
        for step_ in row["steps"]
        if step_["command"] == "validate"
        for each in step_.get("rows", [])
    ]
    good = [(part, each) for part, each in found if each["status"] == "ok" and (each["ratio"] or 0) > 0]
    if not found:
        return []
    level = 1 - (1 - SIDAK) ** (1 / max(len(good), 1))
    outside = [(part, each) for part, each in good if chance(each["ratio"], each["n"]) < level]
    off = [(part, each) for part, each in good if abs(each["bias"]) > allowed(each)]
    lines = [
        f"{len(found)} measurands validated of {len({part for part, _ in found})} parts, {len(good)} ok: "
        f"{len(outside)} of these outside the Sidak {SIDAK:.0%}, {len(off)} more than {OFF:g} sigma off"
    ]
    for word, some in (("ratio", outside), ("off", off)):
        for part, each in some:
            sigma = each["bias"] / np.sqrt(each["predicted"])
            lines.append(
                f"  {word}: {part}, {each['name']}: ratio {each['ratio']:.3f} of {each['n']}, {sigma:+.2f} sigma"
            )
    return lines


def chance(ratio: float, count: int) -> float:
    """How likely a variance of ``count`` values is this far from the true one, ``ratio`` times it, or farther.

    Examples
    --------
    >>> round(chance(1.2, 200), 3), round(chance(0.8, 200), 3)
    (0.056, 0.035)
    """
    below = chi2.cdf(ratio * (count - 1), count - 1)
    return float(2 * min(below, 1 - below))


def allowed(row: dict[str, Any]) -> float:
    """How far the mean of a validated measurand may be off: `OFF` standard deviations, and three of the mean's own."""
    own = row["predicted"] / row["n"] + (row["render_noise"] or 0.0) ** 2
    return OFF * row["predicted"] ** 0.5 + 3 * own**0.5
