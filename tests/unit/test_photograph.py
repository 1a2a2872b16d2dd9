"""Photographs in files: orientation, tone curve, channel, raw mosaic."""

import contextlib
import io
import os

import numpy as np
import pytest
from PIL import Image, ImageCms, PngImagePlugin

from scenes import InvalidInput, photograph
from scenes.cameras import mosaic, tone
from scenes.files import image as image_file

GREY = np.arange(12, dtype=np.uint8).reshape(3, 4) * 20
TURNS = {  # as the EXIF standard draws them
    1: lambda a: a, 2: np.fliplr, 3: lambda a: np.rot90(a, 2), 4: np.flipud, 5: lambda a: a.T,
    6: lambda a: np.rot90(a, -1), 7: lambda a: np.rot90(a, 2).T, 8: np.rot90,
}  # fmt: skip


def stored(folder, image, kind="png", **options):
    path = folder / f"a.{kind}"
    Image.fromarray(image).save(path, **options)
    return path


@pytest.mark.parametrize("kind", ["png", "tif", "jpg"])
@pytest.mark.parametrize("number", list(TURNS))
def test_orientation(tmp_path, kind, number):
    """All eight, in every kind of file that can tell them."""
    exif = Image.Exif()
    exif[0x0112] = number
    big = np.kron(GREY, np.ones((8, 8), np.uint8))
    found = image_file.read(stored(tmp_path, big, kind, exif=exif))
    assert found.shape == TURNS[number](big).shape
    assert found == pytest.approx(TURNS[number](big).astype(float), abs=12 if kind == "jpg" else 0)


def srgb(light):
    """IEC 61966-2-1, from light to numbers."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def gamma_mark(value):
    marks = PngImagePlugin.PngInfo()
    marks.add(b"gAMA", round(100000 * value).to_bytes(4, "big"))
    return {"pnginfo": marks}


def colour_exif():
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA001] = 1
    return {"exif": exif}


PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()


@pytest.mark.parametrize(
    ("kind", "options", "said", "power"),
    [
        ("png", {}, "none", 1.0),
        ("png", {"icc_profile": PROFILE}, "sRGB (its colour profile)", None),
        ("tif", {"icc_profile": PROFILE}, "sRGB (its colour profile)", None),
        ("png", gamma_mark(0.5), "gamma 2 (its gAMA mark)", 2.0),
        ("png", gamma_mark(1.0), "none (its gAMA mark)", 1.0),
        ("jpg", {}, "sRGB (being a JPEG)", None),
        ("jpg", colour_exif(), "sRGB (its EXIF data)", None),
    ],
)
def test_tone_curve_from_the_file(tmp_path, kind, options, said, power):
    light = np.linspace(0.05, 0.95, 64).reshape(8, 8)
    light = np.kron(light, np.ones((8, 8)))
    written = srgb(light) if power is None else light ** (1 / power)
    photo = photograph.read(stored(tmp_path, np.rint(255 * written).astype(np.uint8), kind, **options))
    assert photo.tone == f"tone curve: {said}"
    assert photo.full == 255
    # margin: half a digit times the curve's slope, 2.4 at most
    assert photo.levels == pytest.approx(255 * light, abs=9 if kind == "jpg" else 1.3)
    assert photo.compressed == (kind == "jpg")


def test_tone_curve_as_asked(tmp_path):
    """Before what the file says; bad ones are refused."""
    path = stored(tmp_path, GREY, icc_profile=PROFILE)
    assert (photograph.read(path, gamma="none").levels == GREY).all()
    assert photograph.read(path, gamma="2").levels == pytest.approx(255 * (GREY / 255.0) ** 2, rel=1e-5)
    for bad in ("0", "blue", "nan", "11"):
        with pytest.raises(InvalidInput, match=f"--gamma must be none, srgb or a number from 0.1 to 10, got '{bad}'"):
            photograph.read(path, gamma=bad)


def test_sixteen_bits(tmp_path):
    path = tmp_path / "a.png"
    Image.fromarray((GREY.astype(np.uint16) + 1) * 200).save(path)
    photo = photograph.read(path)
    assert (photo.levels == (GREY.astype(float) + 1) * 200).all()
    assert photo.full == 65535


def curve_tag(kind, body):
    """The smallest profile that holds one tone curve."""
    head, data = bytes(128), kind + bytes(4) + body
    return head + (1).to_bytes(4, "big") + b"gTRC" + (144).to_bytes(4, "big") + len(data).to_bytes(4, "big") + data


def test_profiles():
    """Straight, a power, a parametric power, a table; and none."""
    number = lambda value, size=4: int(value).to_bytes(size, "big")  # noqa: E731
    assert tone.of_profile(curve_tag(b"curv", number(0))) == tone.NONE
    # margin: stored in 256ths
    assert tone.of_profile(curve_tag(b"curv", number(1) + number(2.2 * 256, 2))).power == pytest.approx(2.2, abs=2e-3)
    # margin: stored in 65536ths
    assert tone.of_profile(curve_tag(b"para", number(0, 2) + bytes(2) + number(1.8 * 65536))).power == pytest.approx(
        1.8, abs=2e-5
    )
    table = tone.of_profile(curve_tag(b"curv", number(3) + number(0, 2) + number(8192, 2) + number(65535, 2)))
    assert table.light(np.array([0.25, 0.5, 1.0])) == pytest.approx([0.0625, 0.125, 1.0], abs=1e-4)
    for bad in (b"", b"nonsense", curve_tag(b"none", b""), curve_tag(b"curv", number(9))):
        assert tone.of_profile(bad) is None


def coloured(rng):
    """A step that red shows best, blue not at all."""
    step = np.where(np.arange(160) < 80, 60.0, 100.0) * np.ones((120, 1))
    clean = np.stack([step + 60 * (step > 80), step, np.full_like(step, 90.0)], -1)
    return np.rint(clean + rng.standard_normal(clean.shape)).astype(np.uint8)


def test_channel(tmp_path, rng):
    """The one with the most contrast over noise, and the one asked for."""
    image = coloured(rng)
    path = stored(tmp_path, image)
    best = photograph.read(path)
    assert best.channel.startswith("r (of")
    assert (best.levels == image[..., 0]).all()
    assert (photograph.read(path, channel="b").levels == image[..., 2]).all()
    mixed = image @ [0.2126, 0.7152, 0.0722]
    assert photograph.read(path, channel="luminance").levels == pytest.approx(mixed, abs=1e-3)
    assert photograph.read(stored(tmp_path, np.repeat(GREY[..., None], 3, -1))).channel == "grey"
    with pytest.raises(InvalidInput, match="--channel must be one of r, g, b, luminance, got 'x'"):
        photograph.read(path, channel="x")
    with pytest.raises(InvalidInput, match="--channel must be left out for a grey image"):
        photograph.read(stored(tmp_path, GREY), channel="r")
    with pytest.raises(InvalidInput, match="--bayer must go with a file of one channel"):
        photograph.read(stored(tmp_path, image), bayer="RGGB")


@pytest.mark.parametrize("pattern", list(mosaic.PATTERNS))
def test_raw_mosaic(pattern, rng):
    """Grey things: every pixel kept, levels even again to 0.3 %. Coloured things are interpolated. Others refused."""
    clean = np.where(np.arange(160) < 70, 60.0, 150.0) * np.ones((128, 1))
    shares = np.ones(clean.shape)
    shares[::2, ::2], shares[::2, 1::2], shares[1::2, 1::2] = 0.7, 0.9, 0.8
    found, said = mosaic.balanced(clean * shares + rng.standard_normal(clean.shape), pattern)
    assert "mosaic itself" in said
    sites = [found[i::2, j::2][:, 50:].mean() for i in (0, 1) for j in (0, 1)]
    assert sites == pytest.approx([np.mean(sites)] * 4, rel=3e-3)
    shares[::2, ::2] = np.where(clean[::2, ::2] > 100, 0.7, 0.3)
    assert "interpolated" in mosaic.balanced(clean * shares + rng.standard_normal(clean.shape), pattern)[1]
    with pytest.raises(InvalidInput, match="--bayer must be one of RGGB, BGGR, GRBG, GBRG, got 'XYZ'"):
        mosaic.balanced(clean, "xyz")


def test_real_numbers(tmp_path):
    """A .npy file is light already, and its scale ends nowhere."""
    np.save(tmp_path / "a.npy", GREY / 255.0)
    photo = photograph.read(tmp_path / "a.npy")
    assert photo.full is None
    assert photo.levels == pytest.approx(GREY / 255.0)


def test_a_broken_note_beside_good_pixels(tmp_path):
    packed = io.BytesIO()
    Image.fromarray(GREY).save(packed, "PNG", exif=b"Exif\0\0II*\0nonsense")
    (tmp_path / "a.png").write_bytes(packed.getvalue())
    assert (photograph.read(tmp_path / "a.png").levels == GREY).all()


@pytest.mark.parametrize("shape", [(16, 20), (16, 20, 1)])
def test_a_raw_mosaic_has_one_channel_however_it_is_kept(shape, tmp_path, rng):
    np.save(tmp_path / "raw.npy", 100 + rng.normal(size=shape))
    assert photograph.read(tmp_path / "raw.npy", bayer="RGGB").levels.shape == (16, 20)
    np.save(tmp_path / "three.npy", 100 + rng.normal(size=(16, 20, 3)))
    with pytest.raises(InvalidInput, match=r"--bayer must go with a file of one channel, got .*three\.npy with 3"):
        photograph.read(tmp_path / "three.npy", bayer="RGGB")


def test_what_decoders_say_of_broken_files_is_not_shown(tmp_path, capfd):
    """They are written in C: to the process's own standard error, which is as it was afterwards."""
    path = tmp_path / "a.jpg"
    Image.fromarray(np.full((64, 64), 90, np.uint8)).save(path)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) - 40])
    with contextlib.suppress(InvalidInput):
        photograph.read(path)
    with image_file._silent():
        os.write(2, b"from C")
    os.write(2, b"ours")
    assert capfd.readouterr().err == "ours"
