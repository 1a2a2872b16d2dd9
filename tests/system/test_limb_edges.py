"""A post's limbs beside edges of other parts of it, and lit by its other faces: rendered without noise and measured."""

import numpy as np
import pytest
import trimesh

import measure
import planner
import render
import scenes
from imaging.features import limb_look
from measure.features import rims
from scenes import Picture, Solid
from tests import parts

pytestmark = pytest.mark.render
RADIUS = 3.0


def _scene(folder, width: int, *others: trimesh.Trimesh) -> scenes.Scene:
    """A post of 16 mm beside other bodies, all one part in mm; its diameter is asked for."""
    post = trimesh.creation.cylinder(RADIUS, 16.0, sections=96)
    post.apply_translation([0, 0, 8.0])
    trimesh.util.concatenate([post, *others]).export(folder / "part.ply")
    data = scenes.load("plate").model_dump(exclude={"measurands", "settings"})
    camera = {"width": width, "height": 220, "focal_px": 2800.0, "distance": 400.0, "blur_px": 0.6, "exposure": 200.0,
              "look_at": [0, 0, 8.0]}  # fmt: skip
    data |= {"units": "mm", "object": {"kind": "mesh", "file": str(folder / "part.ply")}, "camera": camera,
             "light": {"kind": "point", "distance": 400.0},
             "measurands": [{"name": "post", "kind": "diameter", "features": [{"surface": "k1"}]}]}  # fmt: skip
    return scenes.Scene.model_validate(data)


def _behind(beyond: float) -> trimesh.Trimesh:
    """An upright plate behind the post, whose outline is an arc of 10 mm that reaches so far beyond the post's side."""
    middle, half = RADIUS + beyond - 10.0, np.radians(40)
    outline = parts.arc((middle, 8.0), 10.0, -40, 40, 2.0)
    back = [[middle - 12, 8 + 10 * np.sin(half)], [middle - 12, 8 - 10 * np.sin(half)]]
    plate = parts.plate(np.concatenate([outline, back]), 2.0)
    plate.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    return plate.apply_translation([0, -7.0, 0])


def test_an_arc_beside_a_limb_disturbs_it(tmp_path, monkeypatch):
    """2 px beside: within 0.3 sigma without what lies near it; taken as if arcs were none, 3 sigma off and ``ok``.

    Light between the two is neither rendered nor looked for.
    """
    picture = Picture.of(_scene(tmp_path, 240, _behind(0.3)), (80, 90), (70, 20))
    monkeypatch.setattr(limb_look, "unlent_by_faces", lambda pictures, curved, outline: outline.seen)
    effects = ["attached_shadow", "cast_shadow", "fall_off", "lens_blur"]
    clean = render.image(picture, quality=render.Quality(seed=1), effects=effects)[None]
    sigma = np.sqrt(planner.predict(picture).measurands[0].variance_object)

    def off() -> float:
        rims.rim_tool.cache_clear()
        found = measure.measure(clean, picture)
        assert found.status == [["ok"]]
        return float(found.value[0, 0] - 2 * RADIUS) / sigma

    assert abs(off()) < 0.3
    monkeypatch.setattr(Solid, "rims", property(lambda solid: solid.circles))
    monkeypatch.setattr(Solid, "lines", property(lambda solid: solid.sharp))
    assert off() > 3
    rims.rim_tool.cache_clear()


def test_light_from_the_parts_other_faces_disturbs_a_limb(tmp_path):
    """A post on a lit plate is 10 sigma off by what the plate sends to its sides: never ``ok``; alone it is."""
    plate = trimesh.creation.box((40, 30, 4.0)).apply_translation([0, 0, -2.05])
    picture = Picture.of(_scene(tmp_path, 300, plate), (60, 90), (30, 90))
    told = planner.predict(picture).measurands[0]
    clean = render.image(picture, quality=render.Quality(seed=1))[None]
    found = measure.measure(clean, picture)
    assert (told.status, found.status) == ("clutter", [["clutter"]])
    assert (found.value[0, 0] - 2 * RADIUS) / np.sqrt(told.variance_object) > 5
    alone = Picture.of(_scene(tmp_path, 300), (60, 90), (30, 90))
    assert planner.predict(alone).measurands[0].status == "ok"
