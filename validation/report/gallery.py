"""The gallery of the bundled scenes, a page of the documentation: each rendered, and what it teaches.

``python -m validation.report.gallery docs`` writes the page and its pictures, ``... docs NAME`` those of some scenes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import render
import scenes
from render import Quality
from scenes import Picture, Scene
from validation.report import station, station_view
from validation.report.requirements import Requirement
from validation.report.wording import sentence

_PAGE, _FOLDER = "gallery.md", "gallery"
_LARGEST = 640  # px of a picture's side, to which a larger camera is made coarser
_QUALITY = Quality(supersample=2, edge_samples=16, random_samples=16, seed=1)

TEACHES = {
    "anodised": "Each face may have a material of its own: milled faces beside anodised ones.",
    "backlight_plate": "Edges as silhouettes against a telecentric backlight: what a hole's far rim does to its width.",
    "ball": "What has no edge is measured by its limb: a ball's diameter and centre.",
    "board_block": "A chessboard beside the part tells where both lie, and no camera has to be where the scene says.",
    "bracket": "A part that hides and shadows itself: a riser's light biases the edge at its foot.",
    "bracket_mm": "Seven numbers of a drawing, a part of 60 mm, 5 megapixels, camera and lens as on data sheets.",
    "bracket_station": "The same at a station of which all is stated that is not exactly known: what may be signed.",
    "calibrated_rig": "A camera from a calibration with its covariance: which input the uncertainty comes from.",
    "copper": "Lamps and filters to choose from: `ice plan copper --vary band`.",
    "flange": "A pitch circle of bolt holes: rims of circles seen as ellipses, inside of bores dark.",
    "glossy_metal": "A specular lobe: where the lamp is reflected into the camera the sensor's scale ends.",
    "grey_floor": "What stands around a part matters: a floor throws light on its sides and takes its shadow.",
    "low_light": "Shot noise: the variance grows with the level, and the dark side of an edge is the quieter.",
    "macro": "A wide aperture near the part: what is not in focus is blurred.",
    "plate": "Five requirements of a drawing at once, from a hole's rim and four sides.",
    "polarised": "Polarised light and an analyser before the lens: gloss is taken out.",
    "printed_label": "A print on a face: an estimator that expects even faces says `misfit`.",
    "ring_light": "A ring light around the lens: a light of some size that moves with the camera.",
    "shaft": "A turned part against a telecentric backlight: its diameters, from its limbs.",
    "shaft_ring": "The same shaft in reflected light: a limb is dark, and its shading biases it.",
    "task1": "The paper's own block, 16 settings: its Table 3 beside predictions that need no fitted constant.",
    "task1_part1": "The paper's search, sensor and light by turns, on a block of a tenth the size.",
    "telecentric_plate": "A telecentric lens: how near the part stands matters by the lens' own telecentricity alone.",
    "telecentric_shaft": "The same before a turned part: lines of sight run alike along all its limbs.",
    "two_lights": "Two lights in one total: `ice plan two_lights` shares it out between them.",
    "wedge": "An angle that is not 90 degrees: how well a corner of 30 degrees is found.",
}


def image(scene: Scene, folder: Path) -> Path:
    """Render a scene's first setting into a folder, with what is measured; the picture, SVG."""
    small = coarser(scene)
    picture = Picture.of(small, scene.settings[0].sensor, scene.settings[0].lights)
    clean = render.image(picture, quality=_QUALITY)
    drawn = station_view.draw(
        picture, requirements(scene), clean, f"{scene.title}, rendered, with what is measured", scene.name
    )
    path = folder / f"{scene.name}.svg"
    path.write_text(f'<?xml version="1.0" encoding="utf-8"?>\n{drawn}', encoding="utf-8")
    return path


def coarser(scene: Scene) -> Scene:
    """The scene before a camera of larger pixels, where it has very many."""
    camera = scene.camera
    factor = -(-max(camera.width, camera.height) // _LARGEST)
    if factor == 1:
        return scene
    pixels = {"width": camera.width // factor, "height": camera.height // factor}
    smaller = pixels | {"focal_px": camera.focal_px / factor, "blur_px": max(camera.blur_px / factor, 0.4)}
    return scene.model_copy(update={"camera": camera.model_copy(update=smaller)})


def requirements(scene: Scene) -> tuple[Requirement, ...]:
    """A scene's requirements at its first setting, as its page tells them: simulated where formulas do not do."""
    first = scene.settings[0]
    return station.of_picture(Picture.of(scene, first.sensor, first.lights), simulated=True).requirements


def told(scene: Scene) -> str:
    """How well they are measured."""
    return sentence(requirements(scene))


def page(told: Callable[[Scene], str] = told) -> str:
    """The page, Markdown; ``told`` says of a scene how well it is measured."""
    parts = [
        "# Gallery",
        "The bundled scenes, each rendered at its first setting, with what is measured in it (`ice scenes` lists them, "
        "`ice validate NAME` proves one). All is simulated; biases that a simulation tells are taken off, and what it "
        "is not sure of is part of U. Blue circles: measured precisely enough, U at most a quarter of half "
        "the tolerance zone; squares: usable, U up to all of it; diamonds: too uncertain; grey: no tolerance is given; "
        "octagons: white not proven, red not measured.",
    ]
    return "\n\n".join(parts + [_entry(scene, told(scene)) for scene in map(scenes.load, scenes.names())]) + "\n"


def _entry(scene: Scene, told: str) -> str:
    return "\n\n".join([
        f"## {scene.name}",
        f"{scene.title}.",
        f"![{scene.title}, rendered, with what is measured]({_FOLDER}/{scene.name}.svg)",
        f"**{TEACHES[scene.name]}** {told}",
    ])  # fmt: skip


def write(folder: Path, names: list[str]) -> list[Path]:
    """Write the page into a folder, and the pictures of some scenes, or of all, beside it."""
    (folder / _FOLDER).mkdir(parents=True, exist_ok=True)
    (folder / _PAGE).write_text(page(), encoding="utf-8")
    drawn = [image(scenes.load(name), folder / _FOLDER) for name in names or scenes.names()]
    return [folder / _PAGE, *drawn]


if __name__ == "__main__":
    for path in write(Path(sys.argv[1] if len(sys.argv) > 1 else "docs"), sys.argv[2:]):
        print(path)
