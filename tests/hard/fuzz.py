"""Corrupted scene, mesh and image files by the thousand: ``python -m tests.hard.fuzz [--count 10000] [--seed 1]``.

Every input is read as the commands read it, and what can be read is predicted and measured. Each must end, within ten
seconds of the processor and 1 GiB, in an answer or in `scenes.InvalidInput` with one line; anything else, a warning
too, is a finding.
"""

from __future__ import annotations

import argparse
import io
import resource
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

import measure
import planner
import scenes
from scenes import InvalidInput
from scenes.load import BUNDLED
from validation import picture_file

MOST_SECONDS = 10
MOST_MEMORY = 2**30
HOSTILE = (
    "nan", "inf", "-inf", "0", "-1", "-0.0", "1e308", "1e-308", "5e-324", "1e400", "9" * 30, "9" * 5000, "true", '""',
    '"x"', "[]", "[1]", "[nan, inf]", "{}", "{a = 1}", '"\\u0000"', "1979-05-27", "[" * 3000 + "]" * 3000, "-1e308",
    "[1e-200, 1e-200, 1e-200]", "[1e200, 1e200, 1e200]", '["e4", "e4"]', '"../../../../etc/passwd"', "16384", "1e-9",
)  # fmt: skip
POSES = ((30, 135), (0, 0), (180, 0), (90, 0), (89.999, 45), (np.nan, 0), (1e308, 0), (30, 1e308), ("a", 0), (30,))
SUFFIXES = (".png", ".tif", ".jpg", ".npy", ".bmp", ".pgm", ".toml", "")


@dataclass
class Findings:
    """How often what came out, and every failure (input's number, what went wrong)."""

    outcomes: Counter = field(default_factory=Counter)
    failures: list[tuple[int, str]] = field(default_factory=list)
    slowest: float = 0.0


class _TooSlow(BaseException):
    """Not an Exception, so that nothing in between catches it."""


def run(count: int, seed: int, folder: Path) -> Findings:
    """Feed ``count`` inputs."""
    found = Findings()
    signal.signal(signal.SIGALRM, _stop)
    signal.signal(signal.SIGPROF, _stop)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for number in range(count):
            rng = np.random.default_rng([seed, number])
            feed = (_scene, _scene, _mesh, _image)[number % 4]
            began = time.process_time()
            signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
            signal.alarm(20 * MOST_SECONDS)  # for what waits and does not work
            try:
                found.outcomes[feed(rng, folder)] += 1
            except InvalidInput as error:
                found.outcomes[f"{feed.__name__[1:]}: refused"] += 1
                if "\n" in str(error) or " must " not in str(error):
                    found.failures.append((number, f"not one line of what must be: {str(error)[:300]!r}"))
            except (Exception, _TooSlow) as error:
                found.failures.append((number, f"{feed.__name__[1:]}: {type(error).__name__}: {str(error)[:300]}"))
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
                signal.alarm(0)
            found.slowest = max(found.slowest, time.process_time() - began)
    return found


def _stop(*_) -> None:
    raise _TooSlow(f"more than {MOST_SECONDS} s")


def peak_memory() -> int:
    """Most memory that this process ever had, bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def _scene(rng: np.random.Generator, folder: Path) -> str:
    """A bundled scene file with one to three things corrupted."""
    source = rng.choice(sorted(BUNDLED.glob("*.toml")))
    data = source.read_bytes()
    for _ in range(rng.integers(1, 4)):
        data = rng.choice([_keys, _keys, _keys, _bytes])(rng, data)
    return _use_scene(rng, _stored(folder, "scene.toml", data), folder)


def _mesh(rng: np.random.Generator, folder: Path) -> str:
    """A bundled scene whose mesh file is corrupted."""
    name = str(rng.choice(["bracket.obj", "plate.ply", "wedge.stl"]))
    data = (BUNDLED / name).read_bytes()
    if rng.random() < 0.5:
        data = _bytes(rng, data)
    else:
        words = data.split(b" ")
        words[rng.integers(len(words))] = str(rng.choice(HOSTILE)).encode()[:400]
        data = b" ".join(words)
    _stored(folder, name, data)
    return _use_scene(rng, _stored(folder, "scene.toml", (BUNDLED / name).with_suffix(".toml").read_bytes()), folder)


def _use_scene(rng: np.random.Generator, path: Path, folder: Path) -> str:
    for name in ("bracket.obj", "plate.ply", "wedge.stl"):
        if not (folder / name).exists():
            _stored(folder, name, (BUNDLED / name).read_bytes())
    try:
        scene = scenes.load(path)
    finally:
        for name in ("bracket.obj", "plate.ply", "wedge.stl"):
            (folder / name).unlink(missing_ok=True)
    sensor, light = (POSES[rng.choice(len(POSES), p=[0.73] + [0.03] * 9)] for _ in range(2))
    found = planner.predict(scene, sensor, light, rng.choice(["paper", "calibrated", "bound"]))
    variances = np.array([found.variance_image, found.variance_object])
    positive = (variances > 0).all() or (scene.noise.variance == 0 and (variances >= 0).all())
    if not positive or (found.status == "ok" and not np.isfinite(variances).all()):
        raise AssertionError(f"variances {variances.tolist()}, status {found.status}")
    return "scene: predicted"


def _image(rng: np.random.Generator, folder: Path) -> str:
    """An image file of some kind, corrupted, then measured by itself and as a photograph of task1."""
    suffix = str(rng.choice(SUFFIXES))
    data = _encoded(rng, _picture(rng), suffix)
    if rng.random() < 0.8:
        data = _bytes(rng, data)
    image = picture_file.read(_stored(folder, f"image{suffix}", data))
    if image.size <= 100_000:
        measure.measure_quadrilateral(image)
    estimator = str(rng.choice(measure.ESTIMATORS))
    found = measure.distance(image, scenes.load("task1"), (30, 135), estimator=estimator)
    good = np.isin(found.status, ("ok", "clutter"))
    if not (np.isfinite(found.value_px) == good).all() or not (found.variance_px2 > 0).all():
        raise AssertionError(f"value {found.value_px}, variance {found.variance_px2}, status {found.status}")
    return "image: measured"


def _picture(rng: np.random.Generator) -> np.ndarray:
    kind = rng.integers(4)
    if kind == 0:
        return rng.integers(0, 256, (240, 256))
    if kind == 1:
        size = tuple(int(s) for s in rng.choice([0, 1, 2, 3, 5, 17, 64, 240, 256], 2))
        return rng.normal(100, 50, size)
    picture = np.zeros((240, 256))
    picture[80:160, 60:190] = 10.0 ** rng.uniform(-3, 300 if kind == 3 else 2)
    return picture


def _encoded(rng: np.random.Generator, picture: np.ndarray, suffix: str) -> bytes:
    kinds = (np.uint8, np.uint16, np.float32, np.float64, bool, complex, object, ">i2")
    with np.errstate(all="ignore"):
        if suffix == ".npy":
            stream = io.BytesIO()
            np.save(stream, picture.astype(kinds[rng.integers(len(kinds))]), allow_pickle=True)
            return stream.getvalue()
        kind = np.float32 if suffix == ".tif" and rng.random() < 0.5 else np.uint8
        small = np.clip(picture, 0, 1e30).astype(kind)
    if suffix in ("", ".toml") or not small.size:
        return small.tobytes()
    return cv2.imencode(suffix, small)[1].tobytes()


def _keys(rng: np.random.Generator, data: bytes) -> bytes:
    """One line's value hostile, or the line lost, doubled or renamed."""
    lines = data.decode("utf-8", "replace").split("\n")
    places = [i for i, line in enumerate(lines) if "=" in line] or [0]
    i, what = int(rng.choice(places)), rng.integers(6)
    key = lines[i].split("=")[0]
    lines[i] = {3: "", 4: f"{lines[i]}\n{lines[i]}", 5: f"un{lines[i]}"}.get(what, f"{key}= {rng.choice(HOSTILE)}")
    return "\n".join(lines).encode()


def _bytes(rng: np.random.Generator, data: bytes) -> bytes:
    """Truncated, bytes changed, a header's numbers set, or a piece repeated."""
    what, array = rng.integers(5), np.frombuffer(data, np.uint8).copy()
    if not array.size:
        return data
    at = int(rng.integers(array.size))
    if what == 0:
        return data[:at]
    if what == 1:
        array[rng.integers(array.size, size=rng.integers(1, 9))] = rng.integers(256)
    elif what == 2:
        start = int(rng.integers(min(array.size, 128)))
        array[start : start + 4] = rng.choice([0, 127, 255])
    elif what == 3:
        return data[:at] + data[at : at + 200] * int(rng.integers(1, 50)) + data[at:]
    else:
        return data.replace(b"\x00\x00\x01\x00", b"\x00\x00\x7f\xff").replace(b"240", b"999999999")
    return array.tobytes()


def _stored(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def main() -> None:
    """Print what came out; exit status 1 if anything was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        found = run(arguments.count, arguments.seed, Path(folder))
    for number, problem in found.failures:
        print(f"input {number}: {problem}")
    for outcome, times in sorted(found.outcomes.items()):
        print(f"{times:7d}  {outcome}")
    seconds, memory = time.perf_counter() - began, peak_memory()
    print(
        f"{arguments.count} inputs in {seconds:.0f} s, the slowest {found.slowest:.2f} s; peak {memory / 2**20:.0f} MiB"
    )
    print(f"{len(found.failures)} findings")
    sys.exit(bool(found.failures) or memory > MOST_MEMORY)


if __name__ == "__main__":
    main()
