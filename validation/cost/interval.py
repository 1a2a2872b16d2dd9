"""How wide the interval of a variance ratio is, how many images that takes, and when a setting has enough."""

from __future__ import annotations

import bisect
from functools import lru_cache

from scenes import InvalidInput
from validation.statistics import ratio_interval

LEAST = 20  # images; with fewer the interval is useless and its stopping rule not valid
_MOST = 100_000_000
_NEAR = 1.02  # times the half-width asked for is narrow enough
_PART = 0.9  # of what seems to be needed: the ratio that says so is itself uncertain


@lru_cache(maxsize=100_000)
def half_width(n: int) -> float:
    """Half the width of the 95 % chi-square interval of a variance ratio, relative to the ratio, from n values.

    Examples
    --------
    >>> round(half_width(1000), 4)
    0.088
    """
    low, high = ratio_interval(1.0, n)
    return (high - low) / 2


def images(width: float) -> int:
    """The least number of images for a relative half-width.

    Examples
    --------
    >>> images(0.2)
    201
    """
    if not width > 0:
        raise InvalidInput(f"accuracy must be greater than 0, got {width}")
    found = bisect.bisect_left(range(LEAST, _MOST), -width, key=lambda n: -half_width(n))
    if found + LEAST >= _MOST:
        raise InvalidInput(f"accuracy must be at least {half_width(_MOST):.2g}, got {width:.2g}")
    return found + LEAST


def wanted(ratio: float, n: int, width: float) -> int:
    """How many images a setting should have, that has n and shows this variance ratio.

    ``width`` is the half-width asked for of the interval itself (so a larger ratio takes more images). The number is
    approached from below: the ratio will still move, and images cannot be taken back. n if it has enough.
    """
    if ratio * half_width(n) <= _NEAR * width:
        return n
    need = images(width / ratio)
    return need if need * _PART <= n else max(n + 1, int(need * _PART))
