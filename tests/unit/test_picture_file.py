"""Images in files."""

import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from scenes import InvalidInput, photograph
from scenes.files.image import Size, WrongSize
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


def png_header(width, height):
    """A PNG of grey pixels that ends where they would begin."""
    chunks = (b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0), b"IDAT")
    parts = (struct.pack(">I", len(each) - 4) + each + struct.pack(">I", zlib.crc32(each)) for each in chunks)
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


@pytest.mark.parametrize("read", [picture_file.read, lambda path, size: photograph.read(path, size=size)])
def test_a_size_that_is_not_the_cameras_is_refused_before_a_pixel_is_decoded(tmp_path, read):
    """There is none to decode: what does not look at the header alone finds a broken file."""
    (tmp_path / "a.png").write_bytes(png_header(8000, 5000))
    with pytest.raises(WrongSize, match=r"a.png must be 256 x 240 px as the camera, got 8000 x 5000"):
        read(tmp_path / "a.png", Size(240, 256))
    with pytest.raises(InvalidInput, match="must be a readable image"):
        read(tmp_path / "a.png", Size(5000, 8000))


def test_a_photograph_on_its_side_has_the_size_that_it_is_seen_in(tmp_path):
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(np.zeros((8, 6), np.uint8)).save(tmp_path / "a.jpg", exif=exif)
    assert picture_file.read(tmp_path / "a.jpg", Size(6, 8)).shape == (6, 8)
    with pytest.raises(WrongSize, match="must be 6 x 8 px as the camera, got 8 x 6"):
        picture_file.read(tmp_path / "a.jpg", Size(8, 6))


def test_missing_file_and_bad_suffix(tmp_path):
    with pytest.raises(InvalidInput, match="must be a readable image, got: No such file"):
        picture_file.read(tmp_path / "a.png")
    with pytest.raises(InvalidInput, match=r"--output must end in .*, got"):
        picture_file.write(tmp_path / "a.xyz", np.zeros((2, 2)))
