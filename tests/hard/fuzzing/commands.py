"""The command line: every command and option, with values of all kinds, in this process."""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np

from scenes import InvalidInput
from validation.cli.application import app
from validation.cli.ending import ending

_BAD = (
    "", "x", "-1", "0", "nan", "inf", "-inf", "1e400", "9" * 20, "9" * 5000, "\u0000", "é\n", "../../x", "/dev/zero",
    "/dev/null",
    "/no/such/place/file.png", "30,nan", "30", "1,2,3", "a,b", "200,0", "=1", "--", "None", "1e-320", "[1]", "ok.png",
)  # fmt: skip
_POSE = ("30,135", "0,0", "90,0", "180,0", "45,225")
_COMMANDS: dict[str, tuple[list[str], dict[str, tuple[str, ...]]]] = {
    # arguments that are cheap; options, with values that are good
    "validate": (["SCENE", "--renders", "2", "--workers", "1", "--out", "OUT", "--fresh"], {
        "--renders": ("2", "3"), "--seed": ("1", str(2**63 - 1)), "--workers": ("1",), "--out": ("OUT",),
        "--dask": ("nonsense", "http://[", "tcp://x"), "--accuracy": ("nan", "2"), "--budget": ("0s", "x"),
        "--effects": ("auto", "all,", "x"), "--leave-out-px": ("1",), "--leave-out-variance": ("1",), "--json": (),
        "--photos": ("OUT", "FILE", "."), "--exact-poses": (),
    }),
    "plan": (["SCENE", "--no-check", "--step", "45"], {
        "--objective": ("object", "image"), "--search": ("alternating",), "--model": ("paper", "bound"),
        "--edges": ("best",), "--step": ("45", "60", "0", "91"), "--sensor": _POSE, "--light": _POSE, "--start": _POSE,
        "--sensor-polar": ("50,50", "10,20", "20,10"), "--light-polar": ("0,90",), "--min-edge": ("5", "1e9"),
        "--min-clearance": ("1",), "--separation": ("20", "400"), "--tolerance": ("noise=0.1", "noise=2", "x=1"),
        "--check": ("0", "10000"), "--map": ("OUT/map.jpg", "OUT"), "--out": ("FILE/x",), "--json": (),
        "--light-out-of-view": (), "--same-mount": (), "--shares": ("given", "best"), "--views": ("1", "2", "13"),
        "--views-share": ("sensor",), "--vary": ("analyser", "band", "analyser,polarisation"), "--hold": ("white",),
    }),
    "render": (["SCENE", "--sensor", "30,135", "--light", "15,315", "-o", "OUT.png"], {
        "--sensor": _POSE, "--light": _POSE, "-o": ("OUT.npy", "OUT.tif", "OUT.gif", "FILE/x.png"),
        "--noise-seed": ("1", str(2**63 - 1)), "--effects": ("fall_off",), "--leave-out-px": ("1",), "--json": (),
    }),
    "measure": (["IMAGE"], {
        "--near": ("5,6", "1e9,1", "x"), "--mtf": ("OUT.png", "OUT.gif"),
        "--box": ("1,2,50,60", "9,9,1,1"), "--kind": ("tag", "dog"), "--all": (),
        "--most": ("0", "3"), "-o": ("OUT.png", "OUT.gif", "FILE/x.png"), "--lens": ("SCENE",), "--json": (),
        "--estimator": ("gradient", "nobody"),
    }),
    "measure ": (["IMAGE", "SCENE", "--sensor", "30,135"], {
        "--sensor": _POSE, "--light": _POSE, "--estimator": ("gradient", "strip", "nobody"),
        "--threshold": ("1e9", "5"),
        "--lens": ("SCENE", "IMAGE"), "--json": (),
    }),
    "fit": (["SCENE", "IMAGE", "--sensor", "30,135", "--light", "15,315"], {
        "--sensor": _POSE, "--light": _POSE, "--free": ("focal", "k1", "focal,k1", ","), "--noise": ("given", "x"),
        "-o": ("OUT.toml", "FILE/x.toml"), "--residuals": ("OUT.png",), "--json": (),
    }),
    "predict": (["SCENE"], {
        "--sensor": _POSE, "--light": _POSE, "--model": ("paper", "bound", "x"), "--json": (),
    }),
    "effects": (["SCENE"], {
        "--effects": ("auto", "all", "floor"), "--leave-out-px": ("1", "0"), "--leave-out-variance": ("1",),
        "--json": (),
    }),
    "compare": (["RUN", "RUN"], {"--level": ("0.5", "1"), "--json": ()}),
    "merge": (["RUN", "DAMAGED", "-o", "OUT"], {"--fresh": (), "--json": ()}),
    "report": (["DAMAGED"], {"--out": ("FILE/x",), "--json": (), "--parquet": ()}),
    "calibrate": (["SCENE", "--images", "1"], {"--seed": ("1",), "-o": ("OUT.png",)}),
    "cost": (["SCENE", "--seed", "-1"], {"--out": ("OUT",), "--budget": ("0s", "x", "1s")}),
    "budget": (["SCENE"], {
        "--sensor": _POSE, "--light": _POSE, "--p": ("0.5", "0.9999", "1"), "--reach": ("1e-300", "1e300"),
        "--stations": ("1", "-1"), "--csv": ("OUT.csv", "FILE/x.csv"), "--seed": ("1",), "--json": (),
    }),
    "show": (["SCENE"], {"--sensor": _POSE, "-o": ("OUT.png", "OUT.gif", "FILE/x.png"), "--json": ()}),
    "new": (["FILE"], {"--units": ("mm", "ell"), "-o": ("OUT.toml", "FILE/x.toml"), "--json": ()}),
    "calibrate-camera": (["IMAGE", "IMAGE", "FILE", "--square", "25"], {
        "--square": ("1e-9", "1e9"), "--square-sd": ("0.1",), "--units": ("cm", "ell"), "--shape": ("9x6", "2x2", "x"),
        "--charuco": ("DICT_4X4_50", "x"), "--markers": ("DICT_APRILTAG_36h11",), "--marker": ("9", "26", "nan"),
        "--model": ("none", "f,k1", "k4"), "--noise": ("1",), "-o": ("OUT.toml", "OUT.png"), "--scene": ("SCENE",),
        "--residuals": ("OUT.png", "FILE/x.png"), "--json": (),
    }),
    "hard": (["--area", "none"], {"--precision": ("OUT.png",)}),
    "": ([], {"--version": (), "--help": (), "--install": (), "nosuch": ()}),
}  # fmt: skip


def command(rng: np.random.Generator, folder: Path, scene: Path, run: Path) -> str:
    """One command with up to three options changed; its exit status."""
    names = {"SCENE": scene, "RUN": run, "OUT": folder / "out", "FILE": folder / "file", "IMAGE": folder / "image.npy"}
    names["DAMAGED"] = _damaged(folder, run)
    names["FILE"].write_text("a file")
    square = np.full((60, 64), 20.0)
    square[15:40, 20:50] = 90.0
    np.save(names["IMAGE"], square)
    arguments = [_named(word, names) for word in _words(rng)]
    out, err = io.StringIO(), io.StringIO()
    here = Path.cwd()
    os.chdir(folder)  # what is written is written there
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code, line = _run(arguments)
    finally:
        os.chdir(here)
        for path in folder.glob("out*"):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    said = err.getvalue() + (line + "\n" if line else "")
    if code not in (0, 1, 2) or (code == 2 and said.count("\n") != 1) or "Traceback" in said:
        raise AssertionError(f"{arguments}: exit status {code}: {said[:300]}")
    if code == 0 and "--json" in arguments and "--help" not in arguments:
        json.loads(out.getvalue())
    if code == 2:
        raise InvalidInput(line)
    return f"exit status {code}"


def _words(rng: np.random.Generator) -> list[str]:
    name = str(rng.choice(list(_COMMANDS)))
    usual, options = _COMMANDS[name]
    words = [name.strip(), *usual] if name else []
    for _ in range(rng.integers(0, 4)):
        option = str(rng.choice(list(options)))
        good = options[option]
        value = [str(rng.choice(good if good and rng.random() < 0.4 else _BAD))] if good else []
        words += [option, *value]
    if words and rng.random() < 0.1:
        words[rng.integers(len(words))] = str(rng.choice(_BAD))
    return words if set(words) - {"cost", "calibrate", "hard"} else ["--help"]


def _named(word: str, names: dict[str, Path]) -> str:
    for name, path in names.items():
        if word.startswith(name):
            return str(path) + word[len(name) :]
    return word


def _run(arguments: list[str]) -> tuple[int, str]:
    """As `validation.cli.main` runs it. What would take long is not asked for."""
    if arguments and arguments[0] in ("calibrate", "cost", "hard") and not _refused_first(arguments):
        return 0, ""
    try:
        return app(arguments or ["--help"], standalone_mode=False) or 0, ""
    except (Exception, SystemExit) as error:
        line, code = ending(error)
        return code, line


def _refused_first(arguments: list[str]) -> bool:
    """Whether a long command's own bad argument is still there."""
    bad = {"calibrate": ("--images", "1"), "cost": ("--seed", "-1"), "hard": ("--area", "none")}[arguments[0]]
    pairs = list(pairwise(arguments))
    return bad in pairs and [second for first, second in pairs if first == bad[0]] == [bad[1]]


def _damaged(folder: Path, run: Path) -> Path:
    """A directory whose run file is cut off, so that nothing is drawn."""
    made = folder / "cut"
    made.mkdir(exist_ok=True)
    (made / "run.sqlite").write_bytes((run / "run.sqlite").read_bytes()[:3000])
    return made
