"""A station of which all is stated, quick to measure."""

from pathlib import Path

from scenes.load import BUNDLED


def small_rig(folder: Path) -> Path:
    """`calibrated_rig` with its first setting and a camera of half the size, as rig.toml in a folder; its path."""
    head, first, *_ = (BUNDLED / "calibrated_rig.toml").read_text().split("[[settings]]")
    for there, here in (("width = 256", "width = 128"), ("height = 240", "height = 120"), ("= 800.0", "= 400.0")):
        assert there in head
        head = head.replace(there, here)
    path = folder / "rig.toml"
    path.write_text(f"{head}[[settings]]{first}")
    return path
