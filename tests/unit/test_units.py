"""Units of length, cameras as on a data sheet, and whether camera and object fit together."""

import numpy as np
import pytest

import planner
import render
import scenes
from scenes import InvalidInput
from scenes.load import BUNDLED, from_document
from scenes.units import in_unit

SHEET = {
    "pixel_pitch_um": 3.45, "focal_length_mm": 25.0, "sensor_size_mm": [8.4456, 7.0656], "working_distance_mm": 300.0,
}  # fmt: skip


def in_units(scene, unit):
    """The same scene, its lengths told in another unit."""
    document = scene.model_dump(mode="json", exclude_none=True)
    factor = in_unit(1.0, "cm", unit)
    document["object"]["size"] = [factor * side for side in document["object"]["size"]]
    for role in ("camera", "light"):
        document[role]["distance"] *= factor
    return from_document(BUNDLED / "x.toml", document | {"units": unit})


@pytest.mark.parametrize("unit", ["mm", "m", "inch"])
def test_the_unit_changes_no_picture(task1, unit):
    """Pixels stay; lengths of the object are told in the scene's unit; variance_cm2 stays what its name says."""
    told = in_units(task1, unit)
    for poses in (((30, 135), (15, 315)), ((45, 225), (60, 45))):
        ours, theirs = (planner.predict(scene, *poses) for scene in (told, task1))
        assert ours.variance_px2 == pytest.approx(theirs.variance_px2, rel=1e-9)
        assert ours.value_object == pytest.approx(in_unit(theirs.value_object, "cm", unit), rel=1e-12)
        assert ours.variance_object == pytest.approx(theirs.variance_object * in_unit(1, "cm", unit) ** 2, rel=1e-9)
        assert ours.variance_cm2 == pytest.approx(theirs.variance_cm2, rel=1e-9)
        assert (ours.units, theirs.units) == (unit, "cm")


def test_a_scene_in_mm_gives_the_same_image(task1):
    images = [render.image(scene, (30, 135), (15, 315)) for scene in (task1, in_units(task1, "mm"))]
    # margin: a ray that meets the other side of an edge: up to 0.06 where Embree has no AVX; another unit is some 100
    assert np.abs(images[0] - images[1]).max() < 0.3


def as_document(name, **changes):
    document = scenes.load(name).model_dump(mode="json", exclude_none=True, exclude={"name"})
    return document | {key: document.get(key, {}) | value for key, value in changes.items()}


def load(document):
    return from_document(BUNDLED / "x.toml", document)


def test_a_mesh_in_another_unit_than_the_scene(tmp_path):
    plate = scenes.load("plate")
    here = load(as_document("plate", object={"units": "inch", "names": {"corner": [12 * 2.54, 8 * 2.54, 2.54]}}))
    assert here.solid.vertices == pytest.approx(2.54 * plate.solid.vertices, rel=1e-12)
    assert here.solid.vertex("corner") == pytest.approx([30.48, 20.32, 2.54])
    assert here.solid.circle("c2").radius == pytest.approx(2 * 2.54, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"camera": {"focal_px": 1e4}}, r'object\.units must be stated \(units = "mm" perhaps\): the mesh is 12 cm '),
        ({"camera": {"focal_px": 60.0}}, r'object\.units must be stated \(units = "inch" perhaps\): the mesh is 12 '),
        ({"camera": {"distance": 2e4}}, r'object\.units must be stated \(units = "m" perhaps\): the mesh is 12 cm '),
        ({"camera": {"focal_px": 1e7}, "object": {"units": "cm"}}, r"object\.units must be the unit of the mesh: "),
        ({"camera": {"look_at": [100, 0, 0]}}, r"camera\.look_at must be within 36\.\d* cm of the object, which lies "),
    ],
)
def test_a_mesh_that_does_not_fit_the_field_of_view(change, line):
    with pytest.raises(InvalidInput, match=line):
        load(as_document("plate", **change))


def test_a_detail_of_a_large_part_may_be_looked_at():
    names = {"corner": [12.0, 8.0, 1.0]}
    scene = load(as_document("plate", camera={"focal_px": 1e4}, object={"units": "cm", "names": names}))
    assert max(scene.camera.field_of_view) == pytest.approx(2.56)


def with_camera(**camera):
    document = as_document("task1", object={"size": [60.0, 40.0, 12.0]}, light={"distance": 300.0})
    return load({**document, "units": "mm", "camera": camera, "settings": []})


def test_a_camera_as_on_its_data_sheet():
    """The lens is focused at 300 mm: its image lies 25 * 300 / 275 mm behind it."""
    camera = with_camera(**SHEET).camera
    assert (camera.width, camera.height, camera.distance) == (2448, 2048, 300.0)
    assert camera.focal_px == pytest.approx(25 * 300 / 275 / 3.45e-3, rel=1e-12)
    assert camera.field_of_view[0] == pytest.approx(2448 * 3.45e-3 * 275 / 25, rel=1e-12)
    again = scenes.Scene.model_validate(with_camera(**SHEET).model_dump())
    assert again.camera == camera


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"focal_px": 1000.0}, r"camera\.focal_px must be 7905\.\d+, as focal_length_mm says, got 1000"),
        ({"distance": 301.0}, r"camera\.distance must be 300, as working_distance_mm says, got 301"),
        ({"width": 1920}, r"camera\.width must be about 2448, as sensor_size_mm and pixel_pitch_um say, got 1920"),
        ({"focal_length_mm": 400.0}, r"camera\.focal_length_mm must be less than the distance, 300 mm, got 400"),
        ({"pixel_pitch_um": None}, r"camera\.pixel_pitch_um must be given with sensor_size_mm, or width and height"),
        ({"focal_length_mm": "25"}, r"camera\.focal_length_mm must be a number|camera\.focal_px must be given"),
        ({"pixel_pitch_um": -1}, r"camera\.\w+ must be "),
    ],
)
def test_a_data_sheet_that_contradicts_itself(change, line):
    with pytest.raises(InvalidInput, match=line):
        with_camera(**{key: value for key, value in {**SHEET, **change}.items() if value is not None})
