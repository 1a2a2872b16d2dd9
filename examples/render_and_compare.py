"""Render a picture, add the sensor's noise, measure every image, and compare the scatter with the prediction.

python examples/render_and_compare.py
"""

import numpy as np
from scipy import stats

import measure
import planner
import render
import scenes

SENSOR, LIGHT = (30, 135), (15, 315)  # polar angle and azimuth, degrees


def main(count: int = 1000, seed: int = 1) -> tuple[float, tuple[float, float]]:
    """Measured over propagated variance of `count` images, and its 95 % chi-square interval."""
    scene = scenes.load("task1")
    predicted = planner.predict(scene, SENSOR, LIGHT)
    clean = render.image(scene, SENSOR, LIGHT)  # noise-free grey levels
    propagated = measure.propagate(clean, scene, SENSOR, LIGHT)

    images = render.expose(clean, scene.noise, np.random.default_rng(seed), count)
    found = measure.distance(images, scene, SENSOR, LIGHT)
    good = found.value_px[found.status == "ok"]
    scatter = good.var(ddof=1)

    ratio = scatter / propagated.variance_px2
    low, high = stats.chi2.ppf([0.025, 0.975], len(good) - 1) / (len(good) - 1)
    interval = ratio / high, ratio / low
    print(found)
    print(f"variance, px^2: {predicted.variance_px2:.4g} without an image, {propagated.variance_px2:.4g} propagated, ")
    print(f"{scatter:.4g} measured; measured / propagated {ratio:.3f} [{interval[0]:.3f}, {interval[1]:.3f}]")
    return ratio, interval


if __name__ == "__main__":
    main()
