import pytest

from scenes.load import BUNDLED


@pytest.fixture(scope="session")
def small_toml(tmp_path_factory):
    """Task1 with four settings, one a sensor position, and a camera of half the size: quick to render."""
    head, *settings = (BUNDLED / "task1.toml").read_text().split("[[settings]]")
    for there, here in (("width = 256", "width = 128"), ("height = 240", "height = 120"), ("= 800.0", "= 400.0")):
        assert there in head
        head = head.replace(there, here)
    path = tmp_path_factory.mktemp("scene") / "small.toml"
    path.write_text("[[settings]]".join([head.replace('["task1_part1"]', "[]"), *settings[1::4]]))
    return path
