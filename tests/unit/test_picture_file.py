"""Images in files."""

import numpy as np
import pytest

from scenes import InvalidInput
from validation import picture_file


@pytest.mark.parametrize(("name", "tolerance"), [("a.png", 0.5), ("a.tif", 1e-5), ("a.npy", 0.0)])
def test_round_trip(tmp_path, name, tolerance):
    image = np.linspace(0, 200, 48).reshape(6, 8)
    picture_file.write(tmp_path / name, image)
    assert np.abs(picture_file.read(tmp_path / name) - image).max() <= tolerance  # margin: half a digit


def test_bright_images_take_16_bits(tmp_path):
    image = np.full((4, 4), 4000.0)
    picture_file.write(tmp_path / "a.png", image)
    assert (picture_file.read(tmp_path / "a.png") == 4000).all()


@pytest.mark.parametrize("content", [b"", b"nonsense", b"\x89PNG\r\n\x1a\n"])
@pytest.mark.parametrize("name", ["a.png", "a.npy"])
def test_bad_files(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InvalidInput, match="must be a readable image, got"):
        picture_file.read(tmp_path / name)


def test_missing_file_and_bad_suffix(tmp_path):
    with pytest.raises(InvalidInput, match="must be a readable image, got: No such file"):
        picture_file.read(tmp_path / "a.png")
    with pytest.raises(InvalidInput, match=r"--output must end in .*, got"):
        picture_file.write(tmp_path / "a.xyz", np.zeros((2, 2)))
