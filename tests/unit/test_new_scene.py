"""The scene that is proposed for a part of one's own."""

import pytest
import trimesh

from validation.cli.scene import new_command
from validation.new_scene import _lens


@pytest.mark.parametrize(("size", "focal"), [(2.0, 100.0), (24.0, 100.0), (24.2, 12.0), (60.0, 12.0), (900.0, 12.0)])
def test_a_part_of_any_size_fills_the_picture_and_is_not_too_near(size, focal):
    """1024 rows of 4.8 um; similar triangles: the image is as much smaller as it is nearer to the lens."""
    found, distance = _lens(size)
    image = found * size / (distance - found)  # mm, by the equation of thin lenses
    assert (found, image) == (focal, pytest.approx(0.7 * 4.9152))
    assert distance > 3 * size  # margin: 3.5 and more


@pytest.mark.parametrize(("scale", "meant"), [(1.0, ""), (1e-3, "m"), (0.5, "")])
def test_a_part_in_another_unit_is_noticed(scale, meant, tmp_path, capsys):
    """Of a file that says no unit: a block of 60 mm, in metres taken for mm, is 0.06 mm large."""
    part = tmp_path / "block.stl"
    trimesh.creation.box((60 * scale, 40 * scale, 12 * scale)).export(part)
    new_command(part, tmp_path / "block.toml")
    said = capsys.readouterr().out
    assert f"block.toml: {60 * scale:g} x {40 * scale:g} x {12 * scale:g} mm, 12 edges, 0 circles" in said
    hint = f"Its numbers were taken for mm, and it is small for that: --units {meant} perhaps"
    assert (hint in said) == bool(meant)
    assert ("--units" in said) == bool(meant)
