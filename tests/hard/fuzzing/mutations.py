"""Hostile values, and what is done to a file's bytes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

HOSTILE = (
    "nan", "inf", "-inf", "0", "-1", "-0.0", "1e308", "1e-308", "5e-324", "1e400", "9" * 30, "9" * 5000, "true", '""',
    '"x"', "[]", "[1]", "[nan, inf]", "{}", "{a = 1}", '"\\u0000"', "1979-05-27", "[" * 3000 + "]" * 3000, "-1e308",
    "[1e-200, 1e-200, 1e-200]", "[1e200, 1e200, 1e200]", '["e4", "e4"]', '"../../../../etc/passwd"', "16384", "1e-9",
    '"=1+1"', '"<script>alert(1)</script>"', '"a\\nb"', "1e9", "[[1, 2], [3]]", "9223372036854775807",
)  # fmt: skip


def keys(rng: np.random.Generator, data: bytes, values: tuple[str, ...] = HOSTILE) -> bytes:
    """One line's value hostile, or the line lost, doubled or renamed."""
    lines = data.decode("utf-8", "replace").split("\n")
    places = [i for i, line in enumerate(lines) if "=" in line] or [0]
    i, what = int(rng.choice(places)), rng.integers(6)
    key = lines[i].split("=")[0]
    lines[i] = {3: "", 4: f"{lines[i]}\n{lines[i]}", 5: f"un{lines[i]}"}.get(what, f"{key}= {rng.choice(values)}")
    return "\n".join(lines).encode()


def spoilt(rng: np.random.Generator, data: bytes) -> bytes:
    """Truncated, bytes changed, a header's numbers set, or a piece repeated."""
    what, array = rng.integers(5), np.frombuffer(data, np.uint8).copy()
    if not array.size:
        return data
    at = int(rng.integers(array.size))
    if what == 0:
        return data[:at]
    if what == 1:
        array[rng.integers(array.size, size=rng.integers(1, 9))] = rng.integers(256)
    elif what == 2:
        start = int(rng.integers(min(array.size, 128)))
        array[start : start + 4] = rng.choice([0, 127, 255])
    elif what == 3:
        return data[:at] + data[at : at + 200] * int(rng.integers(1, 50)) + data[at:]
    else:
        return data.replace(b"\x00\x00\x01\x00", b"\x00\x00\x7f\xff").replace(b"240", b"999999999")
    return array.tobytes()


def stored(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path
