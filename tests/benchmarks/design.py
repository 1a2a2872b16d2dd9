"""``python -m tests.benchmarks.design``: `ice design` over a catalogue of the market's size, and beside a brute force.

A made-up catalogue (seeded) of cameras that share chips, as bought ones do, of lenses of which four fifths are
telecentric, and of lights of all kinds, with prices. The search's winner has to be the one of all combinations of a
subset that are rated one by one. ``--cameras``, ``--lenses``, ``--lights``, ``--scene``, ``--k``, ``--seed``: how much.
"""

from __future__ import annotations

import argparse
import itertools
import resource
import time

import numpy as np

import scenes
from planner.designing.close import look
from planner.designing.evaluation import Problem, Rated, rate_light, views
from planner.designing.outcome import Design
from planner.designing.search import design
from planner.designing.wishes import Wishes
from scenes.catalogue import Catalogue, ListedLens, ListedLight, ListedSensor

_SIZES = ((640, 480), (1280, 1024), (1440, 1080), (1920, 1200), (2048, 1536), (2448, 2048), (3088, 2064), (4096, 3000),
          (5320, 3032), (5320, 4600))  # fmt: skip
_PITCHES = (2.2, 2.74, 3.45, 4.5, 5.5, 6.9)
_FOCALS = (6, 8, 12, 16, 25, 35, 50, 75)
_FORMATS = ('1/2"', '1/1.8"', '2/3"', '1"', '1.1"', '1.2"', '4/3"')


def sensors(rng: np.random.Generator, count: int) -> list[ListedSensor]:
    """Cameras: a chip, and what its maker asks for it."""
    chips = [(size, pitch) for size in _SIZES for pitch in _PITCHES]
    found = []
    for i in range(count):
        size, pitch = chips[int(rng.integers(len(chips)))]
        full = round(900 * pitch**2 * rng.uniform(0.9, 1.1))
        price = 150 + 45 * size[0] * size[1] / 1e6 * (pitch / 3.45) ** 0.7
        found.append(ListedSensor(
            name=f"camera {i}", source="made up", price=round(price * rng.uniform(0.8, 1.5), 2), resolution=size,
            pixel_pitch_um=pitch, bits=12, saturation_capacity_e=full,
            temporal_dark_noise_e=round(rng.uniform(2, 8), 1), quantum_efficiency=round(rng.uniform(0.5, 0.75), 2),
            mount=("C",), frame_rate_hz=round(rng.uniform(10, 120)), exposure_max_us=1e7,
        ))  # fmt: skip
    return found


def lenses(rng: np.random.Generator, count: int) -> list[ListedLens]:
    """Four of five telecentric, as those of the market are."""
    found = []
    for i in range(count):
        form, factor = _FORMATS[int(rng.integers(len(_FORMATS)))], rng.uniform(0.8, 1.5)
        common = {"name": f"lens {i}", "source": "made up", "mount": "C", "format": form}
        if rng.random() < 0.78:
            scale = float(f"{np.exp(rng.uniform(np.log(0.05), np.log(2))):.3g}")
            found.append(ListedLens(
                kind="bi-telecentric", magnification=scale, f_number=float(rng.choice([5, 6, 8])),
                working_distance_mm=round(rng.uniform(65, 400)),
                telecentricity_deg=float(rng.choice([0.03, 0.05, 0.1])),
                price=round((300 + 60 / scale) * factor, 2), **common,
            ))  # fmt: skip
        else:
            focal = float(rng.choice(_FOCALS))
            found.append(ListedLens(
                kind="entocentric", focal_length_mm=focal, f_number=float(rng.choice([1.4, 2.0, 2.8])),
                f_number_max=16.0, minimum_object_distance_mm=100.0 + 4 * focal,
                price=round((60 + 2 * focal) * factor, 2), **common,
            ))  # fmt: skip
    return found


def lights(rng: np.random.Generator, count: int) -> list[ListedLight]:
    """Of all kinds, in a few sizes."""
    found = []
    for i in range(count):
        kind = str(rng.choice(["ring", "bar", "flat dome", "backlight", "spot"]))
        size, colour = float(rng.choice([30, 50, 100, 150, 200])), rng.choice([0, 465, 525, 625])
        shape = {"ring": {"outer_diameter_mm": size + 30, "inner_diameter_mm": size},
                 "spot": {"outer_diameter_mm": 20.0}}.get(kind, {"size_mm": (size, size)})  # fmt: skip
        if kind == "flat dome":
            shape["inner_diameter_mm"] = 40.0 if size > 50 else 20.0
        found.append(ListedLight(
            name=f"light {i}", source="made up", kind=kind, working_distance_mm=(20.0, 300.0), **shape,
            wavelength_nm=float(colour) or None, radiance=round(float(rng.uniform(20, 400))),
            price=round((40 + 2 * size) * rng.uniform(0.8, 1.5), 2),
        ))  # fmt: skip
    return found


def synthetic(seed: int, cameras: int, glasses: int, lamps: int) -> Catalogue:
    """A made-up catalogue."""
    rng = np.random.default_rng(seed)
    return Catalogue(
        title="made up", is_sample=True, currency="EUR", sensors=tuple(sensors(rng, cameras)),
        lenses=tuple(lenses(rng, glasses)), lights=tuple(lights(rng, lamps)),
    )  # fmt: skip


def brute_force(problem: Problem, found: Catalogue) -> tuple[float, tuple[str, str, str]] | None:
    """Of all combinations, each rated and, where it passes, looked at closely: least cost, and of what."""
    passing = []
    for camera, lens in itertools.product(found.sensors, found.lenses):
        seen = views(problem, camera, lens)
        if isinstance(seen, str):
            continue
        for light in found.lights:
            rated = rate_light(problem, camera, lens, light, seen)
            if isinstance(rated, Rated) and rated.ratio <= 1 and look(problem, rated).ratio <= 1:
                passing.append((camera.price + lens.price + light.price, rated.names))
    return min(passing, default=None)


def told(found: Design) -> str:
    """The winner in one line."""
    best = found.best
    return "nothing" if best is None else f"{best.cost:.2f} {best.rated.names} ratio {best.ratio:.3f} {found.reached}"


def main() -> None:
    """Search the large catalogue, then a subset both ways."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name, value in (("cameras", 1400), ("lenses", 900), ("lights", 2000), ("seed", 1), ("subset", 6)):
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--scene", default="bracket_station")
    parser.add_argument("--k", type=float, default=2.0)
    given = parser.parse_args()
    whole = synthetic(given.seed, given.cameras, given.lenses, given.lights)
    problem = Problem.of(scenes.load(given.scene), Wishes(k=given.k))
    began = time.process_time()
    found = design(problem, whole)
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2
    print(f"{told(found)}; {time.process_time() - began:.1f} s of processor time, {most:.2f} GiB")
    print(found.searched)
    if found.best is None:
        return
    rng = np.random.default_rng(given.seed)
    names = found.best.rated.names
    part = {
        table: (*(each for each in getattr(whole, table) if each.name == name),
                *rng.choice(np.array(getattr(whole, table), object), given.subset - 1, replace=False))
        for table, name in zip(("sensors", "lenses", "lights"), names, strict=True)
    }  # fmt: skip
    subset = whole.model_copy(update=part)
    print(f"subset: search {told(design(problem, subset, beside=0))}; brute force {brute_force(problem, subset)}")


if __name__ == "__main__":
    main()
