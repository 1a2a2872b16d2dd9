"""Runs of chance alone that stop when their interval is narrow enough."""

import numpy as np

from validation.cost.interval import wanted


def simulate(ratio: float, width: float, first: int, rng: np.random.Generator) -> tuple[float, int]:
    """Stop one setting of normal distances by `wanted`; the variance ratio it shows at the end, and of how many.

    ``ratio`` is the truth, ``first`` the images of the first look.
    """
    values = np.sqrt(ratio) * rng.standard_normal(first)
    while True:
        found = float(values.var(ddof=1))
        need = wanted(found, values.size, width)
        if need == values.size:
            return found, need
        values = np.concatenate([values, np.sqrt(ratio) * rng.standard_normal(need - values.size)])
