"""What may be signed: the uncertainty budget of a bore, and what to improve first.

python examples/uncertainty_budget.py
"""

import planner
import scenes
from planner.uncertainty import Budget, improvements


def main() -> Budget:
    """The budget of the bundled station's bore."""
    scene = scenes.load("bracket_station")
    found = planner.budget(scene, scene.settings[0].sensor, scene.settings[0].light)
    bore = found["bore"]

    print(bore)
    rows = sorted(bore.contributions, key=lambda row: -row.share)
    for row in rows[:5]:
        print(f"  {row.source:<20} {row.contribution:.6f} {bore.unit}, {100 * row.share:5.1f} %")
    best = improvements(bore)[0]
    print(f"halving {best.source} makes U {best.U:.5f} {bore.unit} of {bore.U:.5f}")
    shared = found.ufloats()  # numbers of the `uncertainties` package that know what they share
    print(f"in further computation: {shared['bore']:.5f}")
    return bore


if __name__ == "__main__":
    main()
