"""How precisely will this picture measure, and where should camera and light stand instead?

python examples/predict_and_plan.py
"""

import math

import planner
import scenes


def main(step_deg: float = 1.0) -> tuple[planner.Prediction, planner.Plan]:
    """Predict the block's first setting, then plan a better one on a grid of `step_deg` degrees."""
    scene = scenes.load("task1")  # a bundled name, or the path of your own TOML file
    now = planner.predict(scene, scene.settings[0].sensor, scene.settings[0].light)
    best = planner.plan(scene, step_deg=step_deg)

    print(now)
    print(best)
    for before, after in zip(now.measurands, best.prediction.measurands, strict=True):
        sigmas = [math.sqrt(each.variance_object) for each in (before, after)]
        print(f"  {before.name:<16} sigma {sigmas[0]:.5f} -> {sigmas[1]:.5f} {before.unit}")
    return now, best


if __name__ == "__main__":
    main()
