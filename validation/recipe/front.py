"""Measures one picture of a known part at a known place. ``README.md`` beside this file says which, and what is told.

As a command: ``python recipe.py PICTURE`` prints JSON; PICTURE is an ``.npy`` file of grey levels, (height, width).
"""

from __future__ import annotations

import json
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

_HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(_HERE))  # what stands beside this file, wherever it is called from
from validation.recipe.runtime import Recipe  # noqa: E402

sys.path.remove(str(_HERE))
_DATA = "data"


@cache
def recipe() -> Recipe:
    """The recipe of the folder that this file is in, prepared once: it takes some seconds for a large picture."""
    return Recipe.load(_HERE / _DATA)


def measure(image: np.ndarray) -> dict[str, Any]:
    """The measurands of one picture.

    Parameters
    ----------
    image : ndarray, shape (height, width)
        Grey levels as recorded, whole numbers or float.

    Returns
    -------
    dict
        ``measurands``: of each its name, value, sigma, U, decision, status and more; ``covariance`` of all values.

    Raises
    ------
    ValueError
        If it is no picture of the camera's size.
    """
    return recipe().measure(image)


def main(arguments: list[str]) -> int:
    """The command; exit status 2 where it is given no picture that can be measured."""
    if len(arguments) != 1:
        print("PICTURE must be one .npy file of grey levels, got", " ".join(arguments) or "nothing", file=sys.stderr)
        return 2
    try:
        found = measure(np.load(arguments[0], allow_pickle=False))
    except (OSError, EOFError, ValueError) as error:
        print(f"{arguments[0]}: {error}", file=sys.stderr)
        return 2
    print(json.dumps(found, indent=2))
    return 0 if all(each["value"] is not None for each in found["measurands"]) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
