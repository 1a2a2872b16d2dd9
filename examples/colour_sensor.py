"""What colour filters cost a distance: white light and a red lamp, the raw mosaic and the demosaiced picture.

python examples/colour_sensor.py
"""

import measure
import planner
import render
import scenes
from scenes import Picture, Scene

SETTING = 5  # of task1
WHITE, RED = (0.6, 1.0, 0.5), (1.0, 0.2, 0.1)  # of the strongest colour's signal, at the same exposure of that
CASES = {
    "monochrome": None,
    "white light, raw mosaic": {"response": WHITE},
    "white light, bilinear": {"response": WHITE, "demosaicing": "bilinear"},
    "red lamp, raw mosaic": {"response": RED},
    "red lamp, red pixels": {"response": RED, "demosaicing": "bilinear", "reads": "red"},
}


def seen(colour: dict | None, scale_px: float) -> Scene:
    """The paper's first scene by a sensor with colour filters, its locator as wide as half the pixels ask for."""
    filters = None if colour is None else {"pattern": "RGGB", **colour}
    return scenes.load("task1").with_(
        camera={"blur_px": 1.0}, locator={"scale_px": scale_px, "window_px": 3 * scale_px},
        noise={"sigma": 0.8, "gain": 0.02, "bits": None, "dark_level": 16.0, "colour": filters},
    )  # fmt: skip


def main(scale_px: float = 2.0, supersample: int = 4) -> dict[str, tuple[float, float]]:
    """Standard deviation over that of the monochrome sensor, planned and propagated through a rendered picture."""
    found, unit = {}, (1.0, 1.0)
    for name, colour in CASES.items():
        scene = seen(colour, scale_px)
        setting = scene.settings[SETTING]
        picture = Picture.of(scene, setting.sensor, setting.lights)
        image = render.image(picture, quality=render.Quality(supersample=supersample))
        variances = planner.predict(picture).variance_px2, measure.propagate(image, picture).variance_px2
        unit = variances if colour is None else unit
        found[name] = tuple((each / one) ** 0.5 for each, one in zip(variances, unit, strict=True))
        planned, propagated = found[name]
        print(f"{name:<24} sigma x {planned:5.2f} planned, x {propagated:5.2f} propagated")
    return found


if __name__ == "__main__":
    main()
