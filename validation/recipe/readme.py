"""The README of a recipe's folder."""

from __future__ import annotations

from typing import Any

from validation.recipe.runtime import DISPLACED


def readme(facts: dict[str, Any]) -> str:
    """For whom has no more than the folder; of what `validation.recipe.folder` tells of it."""
    rows = "\n".join(f"| {each['name']} | {each['kind']} | {each['unit']} |" for each in facts["measurands"])
    sensor, light = _pose(facts["sensor"]), " ".join(map(_pose, facts["light"]))
    beside = (f' --light "{light}"' if light else "") + (" --as-measured" if facts["as_measured"] else "")
    off = "no bias is taken off" if facts["as_measured"] else "the bias that a simulation tells is taken off"
    told = {"pose": sensor, "lamp": light or "its place in the scene", "beside": beside, "off": off, "rows": rows}
    return _TEXT.format(**facts, **told, displaced=DISPLACED)


def _pose(pose: list[float]) -> str:
    return ",".join(f"{angle:g}" for angle in pose)


_TEXT = """# Recipe: {scene}

Measures one picture of a part that lies at a known place before a known camera.

| measurand | kind | unit |
|---|---|---|
{rows}

- Scene: `{scene}`; SHA-256 of its file: {sha256}
- Sensor at {pose}, light at {lamp} (polar angle, azimuth, degrees).
- Pictures of {width} x {height} pixels, grey levels as recorded: not turned, not smoothed.
- Straight edges by the estimator `{estimator}`; {off}.
- Made by `ice export` of {program} {version}. The same values, statuses and decisions are given by
  `ice measure PICTURE {scene} --sensor {pose} --estimator {estimator}{beside}`

## How it is used

Python 3.11 or later and NumPy 1.25 or later, nothing else. Copy the whole folder.

```python
import sys
sys.path.insert(0, "this folder")
import recipe

for each in recipe.measure(picture)["measurands"]:
    print(each["name"], each["value"], each["U"], each["decision"], each["status"])
```

`python recipe.py PICTURE.npy` prints the same as JSON. The first call prepares the recipe, which takes up to some
seconds; `recipe.recipe()` does so before the first part comes.

## Whether it is installed well

`python recipe.py example.npy` prints what `expected.json` holds, to 12 digits. `example.npy` is a simulated picture
without noise, which shows only the surroundings of what is measured.

## What is told

value: its bias taken off, where that is done. sigma: standard deviation by the noise of one picture. u_bias: standard
uncertainty of the bias that was taken off. u: both together. U: expanded uncertainty (95 %) of all that the scene says
is not exact. decision: `pass` or `fail` by more than U within or beyond the tolerance (ISO 14253-1), else `undecided`.
covariance: of all values, by noise. null (None in Python) is what is not known.

status: only what is `ok` is decided. `clutter`: something beside an edge biases it. `low_contrast`, `sign_change`,
`short`, `not_visible`, `ill_conditioned`: not measured. `{displaced}`: edges lie more than 1.5 px, or a circle more
than 1 px, from where this recipe looks; `ice measure` looks for them.

## Limits

The recipe is of one scene, one place and one light. Where the camera, the light, the drawing or the program change,
export it anew. A picture of another size, or not of finite numbers, is refused with one line.
"""
