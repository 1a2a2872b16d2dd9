"""Parts that another part of a catalogue is at least as good as in everything that counts, for no higher price."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import TypeVar

import numpy as np

from scenes.catalogue import Entry, ListedLens, ListedLight, ListedSensor

Part = TypeVar("Part", bound=Entry)
Compared = Callable[[Part], tuple[Hashable, tuple[float, ...]]]
_BIG = 1e30


def undominated(parts: Sequence[Part], compared: Compared) -> list[Part]:
    """Those that no other dominates; of equals the first.

    Parameters
    ----------
    parts : sequence of Entry
    compared : callable
        Of a part, what has to be the same for two to be compared, and numbers of which less is better.
    """
    groups: dict[Hashable, list[int]] = defaultdict(list)
    numbers = []
    for i, part in enumerate(parts):
        key, each = compared(part)
        groups[key].append(i)
        numbers.append((part.price or 0.0, *each))
    kept = [i for group in groups.values() for i in _best(group, numbers)]
    return [parts[i] for i in sorted(kept)]


def _best(group: list[int], numbers: list[tuple[float, ...]]) -> Iterable[int]:
    """Indices of a group that no other beats: sorted, whatever beats one stands before it."""
    order = sorted(group, key=lambda i: (numbers[i], i))
    kept = np.empty((0, len(numbers[group[0]])))
    for i in order:
        mine = np.array(numbers[i])
        if not (kept <= mine).all(1).any():
            kept = np.concatenate([kept, mine[None]])
            yield i


def of_sensor(part: ListedSensor) -> tuple[Hashable, tuple[float, ...]]:
    """Sensors with the same pixels and mounts, by noise, light and time."""
    same = part.resolution, part.pixel_pitch_um, part.mount, part.bits, part.shutter, part.filters
    longest = -(part.exposure_max_us or _BIG)
    rate = -(part.frame_rate_hz or _BIG)
    pattern = _BIG if part.prnu_percent is None else part.prnu_percent
    gain = part.system_gain_e or 0.0
    return (*same, gain), (
        -part.saturation_capacity_e, part.temporal_dark_noise_e, -part.best_efficiency, longest, rate,
        part.exposure_min_us or 0.0, pattern, part.dsnu_e or 0.0,
    )  # fmt: skip


def of_lens(part: ListedLens) -> tuple[Hashable, tuple[float, ...]]:
    """Lenses of the same kind, mount and scale, by their image circle, apertures, distances and stated faults."""
    same = part.kind, part.mount, part.focal_length_mm, part.magnification, part.working_distance_mm, part.mtf
    if part.is_telecentric:
        same = (*same, part.stops)
    return same, (
        -part.circle_mm, part.minimum_object_distance_mm or 0.0, -(part.maximum_object_distance_mm or _BIG),
        *_apertures(part), part.telecentricity_deg or 0.0, -(part.transmission or 1.0),
    )  # fmt: skip


def _apertures(part: ListedLens) -> tuple[float, ...]:
    """Which whole stops are missing, and the least f-number: what can be set less is worse."""
    whole = {round(stop, 6) for stop in part.stops}
    return (part.stops[0], *(0.0 if round(2 ** (n / 2), 6) in whole else 1.0 for n in range(13)))


def of_light(part: ListedLight) -> tuple[Hashable, tuple[float, ...]]:
    """Lights of the same shape and colour, by how bright they are."""
    same = (
        part.kind, part.outer_diameter_mm, part.inner_diameter_mm, part.size_mm, part.working_distance_mm,
        part.wavelength_nm,
    )  # fmt: skip
    if part.kind is None:
        return same, ()
    return same, (-(part.irradiance_at(part.reach_mm[0] or 100.0) or 0.0),)
