"""Images in files."""

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from scenes import InvalidInput, photograph
from scenes.cameras.pinhole import MOST_PIXELS
from scenes.files import image as image_file
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


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (OSError(5, "Input/output error"), "Input/output error"),
        (ValueError("no such kind\nof number"), "no such kind"),
        (MemoryError(), "MemoryError"),
    ],
)
def test_a_decoder_s_error_is_told_in_one_line(tmp_path, monkeypatch, error, reason):
    """What the system says of it, else the first line of what it says itself, else what it is."""

    def fails(*_):
        raise error

    monkeypatch.setattr(image_file, "_decoded", fails)
    with pytest.raises(InvalidInput, match=f"a.png must be a readable image, got: {reason}$"):
        picture_file.read(tmp_path / "a.png")


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize("channels", [3, 4])
def test_colour_becomes_luma(tmp_path, kind, channels):
    """0.114 blue + 0.587 green + 0.299 red (ITU-R BT.601), whatever the numbers are; a fourth channel counts for
    nothing."""
    colours = np.random.default_rng(4).uniform(0, 250, (5, 7, channels)).astype(kind)
    np.save(tmp_path / "a.npy", colours)
    found = picture_file.read(tmp_path / "a.npy", Size(5, 7))
    assert found.dtype == float
    whole = np.issubdtype(kind, np.integer)
    # margin: half a level, by rounding to whole ones
    np.testing.assert_allclose(found, colours[..., :3] @ [0.114, 0.587, 0.299], atol=0.51 if whole else 1e-3)


@pytest.mark.parametrize(
    ("shape", "kind"), [((4, 6, 2), np.uint8), ((4, 6, 5), np.uint8), ((4, 6, 3), np.int16), ((4, 6, 4), np.uint32)]
)
def test_other_channels_are_refused(tmp_path, shape, kind):
    np.save(tmp_path / "a.npy", np.ones(shape, kind))
    with pytest.raises(InvalidInput, match="must be an image of one or three channels, got shape"):
        picture_file.read(tmp_path / "a.npy")


def test_one_channel_is_the_image(tmp_path):
    image = np.arange(24.0).reshape(4, 6, 1)
    np.save(tmp_path / "a.npy", image)
    assert (picture_file.read(tmp_path / "a.npy") == image[..., 0]).all()


def test_columns_first_and_other_byte_orders(tmp_path):
    """An array is read as NumPy reads it."""
    image = np.asfortranarray(np.arange(24, dtype=">i2").reshape(4, 6))
    np.save(tmp_path / "a.npy", image)
    assert (picture_file.read(tmp_path / "a.npy") == image).all()


def test_an_array_is_as_long_as_its_header_says(tmp_path):
    np.save(tmp_path / "a.npy", np.ones((4, 6), np.uint16))
    data = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "b.npy").write_bytes(data[:-1])
    assert picture_file.read(tmp_path / "a.npy").shape == (4, 6)
    with pytest.raises(InvalidInput, match=r"b\.npy must be a readable image, got"):
        picture_file.read(tmp_path / "b.npy")
    np.save(tmp_path / "d.npy", np.array([[None, 1]]), allow_pickle=True)
    with pytest.raises(InvalidInput, match="got: objects, or fewer bytes"):
        picture_file.read(tmp_path / "d.npy")


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


def test_the_largest_image_as_doubles_is_no_too_large_file():
    """Its numbers, and a header of NumPy's or of a TIFF; a tenth of it more is too large for any image."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (1, MOST_PIXELS)})
    whole = 8 * MOST_PIXELS + len(header.getvalue())
    assert whole <= image_file._MOST_BYTES < 1.1 * whole
