"""Numbers of a scene that carry an uncertainty, and what is uncertain beside them."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest

import scenes
from scenes.load import from_document

_SCENE = {
    "object": {"kind": "block", "size": [12.5, 7.5, 2.5]},
    "material": {"diffuse_reflectance": 0.9},
    "camera": {"width": 256, "height": 240, "focal_px": 800.0, "distance": 100.0},
    "light": {"distance": 100.0},
    "noise": {"sigma": 2.0},
    "task": {
        "kind": "distance",
        "start": {"vertex": "v3", "edges": ["e4", "e9"]},
        "end": {"vertex": "v6", "edges": ["e7", "e11"]},
    },
}


def _with(**tables) -> dict:
    document = copy.deepcopy(_SCENE)
    for table, values in tables.items():
        document.setdefault(table, {}).update(values)
    return document


def _scene(tmp_path, **tables) -> scenes.Scene:
    return from_document(tmp_path / "part.toml", _with(**tables))


def test_a_number_and_its_uncertainty(tmp_path) -> None:
    found = _scene(
        tmp_path,
        camera={
            "focal_px": {"value": 800.0, "sd": 2.0},
            "look_at": [{"value": 0.0, "half_width": 0.3}, 0.0, 0.0],
            "lens": {"distortion": {"value": -0.1, "sd": 0.01, "dof": 9}},
        },
    )
    plain = _scene(tmp_path, camera={"look_at": [0.0, 0.0, 0.0], "lens": {"distortion": -0.1}})
    assert found.model_copy(update={"uncertain": ()}) == plain
    assert {each.key: each.u for each in found.uncertain} == pytest.approx(
        {"camera.focal_px": 2.0, "camera.look_at[0]": 0.3 / 3**0.5, "camera.lens.distortion[0]": 0.01}
    )
    for mode in ("python", "json"):
        again = scenes.Scene.model_validate(found.model_dump(mode=mode))
        assert again == found
        assert hash(again) == hash(found)


@pytest.mark.parametrize(
    ("tables", "text"),
    [
        ({"camera": {"focal_px": {"value": 8.0}}}, "camera.focal_px.sd or half_width must be given, got none"),
        ({"camera": {"focal_px": {"value": 8.0, "sd": -1}}}, "camera.focal_px.sd must be at least 0, got -1"),
        ({"camera": {"focal_px": {"value": 8.0, "sigma": 1}}}, "camera.focal_px.sigma must be a known key"),
        ({"camera": {"focal_px": {"value": "a", "sd": 1}}}, "camera.focal_px.value must be a number"),
        ({"camera": {"width": {"value": 256, "sd": 1}}}, "uncertain.key must be a number of .*got 'camera.width'"),
        ({"uncertainty": {"sensor_deg": {"value": 1.0, "sd": 1}}}, "sensor_deg.value must be 0"),
        ({"uncertainty": {"sensor_deg": -1}}, "uncertainty.sensor_deg.sd must be at least 0"),
        ({"uncertainty": {"expansion_per_K": 1e-6}}, "expansion_per_K.value must be given"),
        ({"uncertainty": {"covariance": "none.toml"}}, "none.toml must be a readable file"),
        ({"uncertainty": {"covariance": {"names": ["fx"], "matrix": [[-1.0]]}}}, "covariance.matrix must be symmetric"),
        (
            {"uncertainty": {"covariance": {"names": ["cx", "cy"], "matrix": [[1, 2], [2, 1]]}}},
            "covariance.matrix must be positive semidefinite",
        ),
        (
            {
                "camera": {"focal_px": {"value": 800.0, "sd": 2.0}},
                "uncertainty": {"covariance": {"names": ["fx"], "matrix": [[1.0]]}},
            },
            "camera.focal_px must be without an uncertainty where the covariance has fx",
        ),
    ],
)
def test_bad_uncertainties(tmp_path, tables, text) -> None:
    with pytest.raises(scenes.InvalidInput, match=f"part.toml: .*{text}"):
        _scene(tmp_path, **tables)


def test_covariance_files(tmp_path) -> None:
    matrix = np.array([[4.0, 0.01], [0.01, 1e-4]])
    (tmp_path / "one.toml").write_text(f'names = ["fx", "k1"]\nmatrix = {matrix.tolist()}\n')
    (tmp_path / "two.json").write_text(
        json.dumps({"stdDeviationsIntrinsics": [[0.5], [0.6], [1.0], [2.0]] + [[0]] * 14})
    )
    one, two = (
        _scene(tmp_path, uncertainty={"covariance": name}).uncertainty.covariance for name in ("one.toml", "two.json")
    )
    assert (one.names, one.correlation[0, 1]) == (("fx", "k1"), pytest.approx(0.5))
    assert (two.names, two.sd.tolist()) == (("fx", "fy", "cx", "cy"), pytest.approx([0.5, 0.6, 1.0, 2.0]))
    scene = _scene(tmp_path, uncertainty={"covariance": "one.toml"})
    assert scenes.Scene.model_validate(scene.model_dump(mode="json")) == scene


def test_a_wrong_covariance_file_is_named(tmp_path) -> None:
    (tmp_path / "one.toml").write_text('names = ["fx", "q"]\nmatrix = [[1, 0], [0, 1]]\n')
    with pytest.raises(scenes.InvalidInput, match=r"one.toml: names.1. must be one of"):
        _scene(tmp_path, uncertainty={"covariance": "one.toml"})
