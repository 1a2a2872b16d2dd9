"""``python -m tests.proofs pair-bounds``: does the search that bounds leave pairs out of find what all pairs have?

Scenes, aims and poses are drawn (`tests.bounded`): hollow and convex parts, glossy ones, floors, two lights, shot
noise. The value of every pair is compared with its bounds, of all pairs and of those whose levels are within the
sensor's scale, and the best pair of the search with the best of all pairs. A bound that is 5 % too high must be
contradicted.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import typer

from planner.search.exhaustive import best_pair
from planner.search.pair_bounds import PairBounds
from tests.bounded import all_values, drawn_lights, drawn_poses, drawn_problem, searched_values, values_within

_SENSORS, _LIGHTS = 25, 40


def pair_bounds(
    cases: Annotated[int, typer.Option(help="Scenes that are drawn.")] = 30,
    seed: Annotated[int, typer.Option(help="Of what is drawn.")] = 1,
) -> None:
    """Compare bounds with values, and the search by bounds with all pairs."""
    told, nearest, contradicted, caught, same = 0, 0.0, 0, 0, 0
    for case in range(cases):
        rng = np.random.default_rng([seed, case])
        problem = drawn_problem(rng)
        poses = drawn_poses(rng, _SENSORS), drawn_lights(rng, problem, _LIGHTS)
        values, bound = all_values(problem, *poses), PairBounds.of(problem, *poses).rows(np.arange(_SENSORS), np.inf)
        found = best_pair(problem, *poses, lambda *_: None)
        least = searched_values(problem, *poses).min()
        same += bool(np.isclose(found.variance, least, rtol=1e-9, atol=0) or np.isinf(least))
        within = PairBounds.of(problem, *poses, within_scale=True).rows(np.arange(_SENSORS), np.inf)
        told += int(np.isfinite(values).sum())
        uncut = values_within(problem, *poses)
        for bounds, of in ((bound, values), (within, uncut)):
            which = np.isfinite(of)
            contradicted += int((bounds[which] > of[which]).sum())
            caught += int((1.05 * bounds[which] > of[which]).sum())
            nearest = max(nearest, float((bounds[which] / of[which]).max(initial=0.0)))
        measures = np.isfinite(uncut).any()
        least = within.min() / np.nanmin(uncut) if measures else np.nan
        gloss = "" if problem.scene.surfaces.is_diffuse else "glossy "
        print(
            f"{gloss + problem.scene.name:>17}: evaluated {found.evaluated:4} of {values.size}; least bound / value "
            f"{least:.2f}"
        )
    print(f"{told} pairs that measure: {contradicted} below their bound, nearest {nearest:.4f} of the value;")
    print(f"a bound 5 % too high is contradicted by {caught}. The best pair is that of all in {same} of {cases}.")
    if contradicted or not caught or same < cases:
        raise typer.Exit(1)
