"""Scene, mesh and image files, corrupted, and used as the commands use them."""

from __future__ import annotations

import io
from pathlib import Path

import cv2
import numpy as np

import measure
import planner
import scenes
from scenes import status
from scenes.load import BUNDLED
from tests.hard.fuzzing.mutations import HOSTILE, keys, spoilt, stored
from validation import picture_file

POSES = ((30, 135), (0, 0), (180, 0), (90, 0), (89.999, 45), (np.nan, 0), (1e308, 0), (30, 1e308), ("a", 0), (30,))
SUFFIXES = (".png", ".tif", ".jpg", ".npy", ".bmp", ".pgm", ".toml", "")


def scene(rng: np.random.Generator, folder: Path) -> str:
    """A bundled scene file with one to three things corrupted."""
    source = rng.choice(sorted(BUNDLED.glob("*.toml")))
    data = source.read_bytes()
    for _ in range(rng.integers(1, 4)):
        data = rng.choice([keys, keys, keys, spoilt])(rng, data)
    return _use_scene(rng, stored(folder, "scene.toml", data), folder)


def mesh(rng: np.random.Generator, folder: Path) -> str:
    """A bundled scene whose mesh file is corrupted."""
    name = str(rng.choice(["bracket.obj", "plate.ply", "wedge.stl"]))
    data = (BUNDLED / name).read_bytes()
    if rng.random() < 0.5:
        data = spoilt(rng, data)
    else:
        words = data.split(b" ")
        words[rng.integers(len(words))] = str(rng.choice(HOSTILE)).encode()[:400]
        data = b" ".join(words)
    stored(folder, name, data)
    return _use_scene(rng, stored(folder, "scene.toml", (BUNDLED / name).with_suffix(".toml").read_bytes()), folder)


def _use_scene(rng: np.random.Generator, path: Path, folder: Path) -> str:
    for name in ("bracket.obj", "plate.ply", "wedge.stl"):
        if not (folder / name).exists():
            stored(folder, name, (BUNDLED / name).read_bytes())
    try:
        loaded = scenes.load(path)
    finally:
        for name in ("bracket.obj", "plate.ply", "wedge.stl"):
            (folder / name).unlink(missing_ok=True)
    sensor, *lights = (POSES[rng.choice(len(POSES), p=[0.73] + [0.03] * 9)] for _ in range(1 + len(loaded.free)))
    light = lights[0] if len(lights) == 1 else tuple(lights)
    found = planner.predict(loaded, sensor, light, rng.choice(["paper", "calibrated", "bound"]))
    variances = np.array([found.variance_image, found.variance_object])
    positive = (variances > 0).all() or (loaded.noise.variance == 0 and (variances >= 0).all())
    if not positive or (found.status == "ok" and not np.isfinite(variances).all()):
        raise AssertionError(f"variances {variances.tolist()}, status {found.status}")
    return "predicted"


def image(rng: np.random.Generator, folder: Path) -> str:
    """An image file of some kind, corrupted, then measured by itself and as a photograph of task1."""
    suffix = str(rng.choice(SUFFIXES))
    data = _encoded(rng, _picture(rng), suffix)
    if rng.random() < 0.8:
        data = spoilt(rng, data)
    picture = picture_file.read(stored(folder, f"image{suffix}", data))
    if picture.size <= 100_000:
        measure.measure_quadrilateral(picture)
    estimator = str(rng.choice(measure.ESTIMATORS.names))
    found = measure.distance(picture, scenes.load("task1"), (30, 135), estimator=estimator)
    good = np.isin(found.status, status.MEASURED)
    if not (np.isfinite(found.value_px) == good).all() or not (found.variance_px2 > 0).all():
        raise AssertionError(f"value {found.value_px}, variance {found.variance_px2}, status {found.status}")
    return "measured"


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
