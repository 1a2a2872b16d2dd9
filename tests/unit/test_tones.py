"""Tone curves of colour profiles, byte by byte, and of what a user says."""

import struct

import numpy as np
import pytest

from scenes import InvalidInput
from scenes.cameras.tone import NONE, SRGB, asked, of_profile


def profile(*tags: tuple[bytes, bytes], count: int | None = None) -> bytes:
    """An ICC profile of some tags: its table of them begins at byte 128, what they hold follows."""
    start, table = 132 + 12 * len(tags), b""
    for name, data in tags:
        table += struct.pack(">4sII", name, start, len(data))
        start += len(data)
    return bytes(128) + struct.pack(">I", len(tags) if count is None else count) + table + b"".join(d for _, d in tags)


def curv(*values: int) -> bytes:
    return b"curv" + bytes(4) + struct.pack(f">I{len(values)}H", len(values), *values)


def para(form: int, power: float) -> bytes:
    return b"para" + bytes(4) + struct.pack(">HHi", form, 0, round(power * 65536))


@pytest.mark.parametrize(
    ("data", "name", "power"),
    [
        (curv(), "none", 1.0),
        (curv(256), "none", 1.0),
        (curv(461), "gamma 1.801", 461 / 256),
        (curv(26), "gamma 0.1016", 26 / 256),
        (curv(2560), "gamma 10", 10.0),
        (para(0, 2.2), "gamma 2.2", 2.2),
        (para(0, 1.0), "none", 1.0),
        (para(3, 2.4), "sRGB", 0.0),
        (para(4, 2.391), "sRGB", 0.0),
        (para(3, 2.409), "sRGB", 0.0),
    ],
)
def test_curves_that_are_told_by_a_number(data, name, power):
    found = of_profile(profile((b"gTRC", data)))
    assert (found.name, found.table) == (name, ())
    # margin: a file keeps 16 binary places
    assert found.power == pytest.approx(power, abs=2**-16)
    assert found.plain == (name == "none")


@pytest.mark.parametrize(
    "data",
    [
        curv(25), curv(2561), para(0, 0.09), para(0, 10.1), para(1, 2.4), para(2, 2.4), para(5, 2.4), para(3, 2.415),
        para(4, 2.385), b"mft2" + bytes(20), curv(1, 2)[:-1], b"curv", b"",
    ],
)  # fmt: skip
def test_curves_that_are_not_known(data):
    assert of_profile(profile((b"gTRC", data))) is None


def test_a_table_is_interpolated_unless_it_is_srgb_s():
    """Full scale is 65,535; within a thousandth of sRGB's curve everywhere it is that."""
    found = of_profile(profile((b"gTRC", curv(0, 13107, 65535))))
    assert found.name == "the profile's table"
    assert found.light(np.array([0.0, 0.25, 0.5, 0.9, 1.0])) == pytest.approx([0, 0.1, 0.2, 0.84, 1])
    assert found.light(np.array([0.5], np.float32)).dtype == np.float32
    assert not found.plain
    curve = SRGB.light(np.linspace(0, 1, 1024))
    for off, known in ((0.9e-3, True), (-0.9e-3, True), (1.1e-3, False), (-1.1e-3, False)):
        near = np.clip(np.where(np.arange(1024) == 700, curve + off, curve), 0, 1)
        assert (of_profile(profile((b"gTRC", curv(*np.rint(65535 * near).astype(int))))) is SRGB) == known


@pytest.mark.parametrize(("count", "known"), [(2, True), (65536, True), (65537, False)])
def test_tables_have_a_longest_length(count, known):
    ramp = np.linspace(0, 65535, count).astype(int)
    assert (of_profile(profile((b"gTRC", curv(*ramp)))) is not None) == known


def test_green_counts_before_grey_and_that_before_red():
    red, grey, green = ((name, curv(value)) for name, value in ((b"rTRC", 300), (b"kTRC", 400), (b"gTRC", 500)))
    for tags, value in (((red, grey, green), 500), ((red, grey), 400), ((red,), 300)):
        assert of_profile(profile(*tags)).power == value / 256
    assert of_profile(profile((b"bTRC", curv(300)))) is None
    other = [(b"x%03d" % k, b"") for k in range(199)]
    assert of_profile(profile(*other, green)).power == 500 / 256
    assert of_profile(profile(*other, (b"last", b""), green)) is None  # of 201 tags no more than 200 are looked at
    assert of_profile(profile(red, count=5)) is None  # fewer than it says
    assert of_profile(bytes(130)) is None


def test_srgb_and_powers():
    """IEC 61966-2-1 on both sides of where its line ends; negative numbers, which noise makes, stay small."""
    written = np.array([-0.01, 0.02, 0.04045, 0.0405, 0.5, 1.0])
    line, power = written[:3] / 12.92, ((written[3:] + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(SRGB.light(written), [*line, *power], rtol=1e-12)
    np.testing.assert_allclose(asked("2.5").light(written), [0, *written[1:] ** 2.5], rtol=1e-12)
    assert NONE.light(written) is written
    assert (NONE.plain, SRGB.plain, asked("2.5").plain) == (True, False, False)


def test_what_a_user_may_say():
    assert asked("SRGB") is SRGB
    assert asked("None") is asked("1.0") is NONE
    assert (asked("0.1").power, asked("10").power, asked("2.20").name) == (0.1, 10.0, "gamma 2.2")
    for wrong in ("0.099", "10.1", "nan", "-2", "linear", ""):
        with pytest.raises(InvalidInput, match=r"--gamma must be none, srgb or a number from 0\.1 to 10, got"):
            asked(wrong)
