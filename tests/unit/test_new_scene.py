"""The scene that is proposed for a part of one's own."""

import pytest

from validation.new_scene import _lens


@pytest.mark.parametrize(("size", "focal"), [(2.0, 100.0), (24.0, 100.0), (24.2, 12.0), (60.0, 12.0), (900.0, 12.0)])
def test_a_part_of_any_size_fills_the_picture_and_is_not_too_near(size, focal):
    """1024 rows of 4.8 um; similar triangles: the image is as much smaller as it is nearer to the lens."""
    found, distance = _lens(size)
    image = found * size / (distance - found)  # mm, by the equation of thin lenses
    assert (found, image) == (focal, pytest.approx(0.7 * 4.9152))
    assert distance > 3 * size  # margin: 3.5 and more
