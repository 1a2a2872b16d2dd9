"""What 2 mm of height error cost a distance: through a telecentric lens, and through a pinhole lens of the same field.

python examples/height_error.py
"""

import measure
import planner
import render
import scenes
from scenes import Picture, Scene

HIGHER = 2.0  # mm
SENSOR, LIGHT = (0, 90), (30, 60)
NAME = "bore to hole"


def lit() -> Scene:
    """The bundled plate under a lamp, of which one distance is asked: through a pinhole its holes' walls are seen."""
    plate = scenes.load("telecentric_plate")
    asked = [each for each in plate.measurands if each.name == NAME]
    return plate.with_(  # found as far off as a pinhole moves them
        light={"kind": "point", "distance": 200.0}, measurands=asked, settings=(), uncertain=(),
        uncertainty={"part_shift": HIGHER}, locator={"window_px": 6.0},
    )  # fmt: skip


def pinhole(scene: Scene) -> Scene:
    """The scene before a pinhole lens of the same field at the same distance."""
    kept = {"width", "height", "focal_px", "distance", "look_at", "blur_px", "exposure"}
    camera = scene.camera.model_dump(include=kept)
    return scene.with_(camera={"kind": "pinhole", **camera})


def higher(scene: Scene) -> Scene:
    """The part nearer to the camera than the scene says, everything else where it was."""
    x, y, z = scene.camera.look_at
    return scene.with_(camera={"look_at": (x, y, z - HIGHER)})


def main(supersample: int = 4) -> dict[str, tuple[float, float]]:
    """Change of the distance by lens, mm: as the budget's sensitivity tells it, and measured in rendered pictures."""
    telecentric = lit()
    leaning = telecentric.with_(camera={"telecentricity_deg": 0.1})
    found = {}
    for name, scene in (
        ("telecentric", telecentric), ("telecentricity 0.1 degrees", leaning), ("pinhole", pinhole(telecentric)),
    ):  # fmt: skip
        believed, quality = Picture.of(scene, SENSOR, LIGHT), render.Quality(supersample=supersample, everywhere=False)
        pictures = (believed, Picture.of(higher(scene), SENSOR, LIGHT))
        here, there = (measure.measure(render.image(each, quality=quality), believed).value[0] for each in pictures)
        rows = {row.source: row.contribution for row in planner.budget(believed)[NAME].contributions}
        found[name] = rows.get("part_shift.z", 0.0), float(there - here)
        told, seen = (1000 * each for each in found[name])
        print(f"{name:<27} {HIGHER:g} mm higher: {told:7.2f} um told, {seen:7.2f} um measured")
    return found


if __name__ == "__main__":
    main()
