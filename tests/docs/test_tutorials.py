"""Tutorials do what they say: every command, every printed line, every script."""

import pytest

from tests.docs.following import follow
from tests.docs.pages import DOCS

pytestmark = pytest.mark.render


@pytest.mark.parametrize("page", ["tutorial-station.md", "tutorial-camera.md"])
def test_tutorial(page, tmp_path):
    assert follow(DOCS / page, tmp_path) > 3


def test_another_output_is_noticed(tmp_path):
    """Negative control: a number in what a command prints."""
    page = tmp_path / "page.md"
    page.write_text("```console\n$ ice scenes\n...\nglossy_metal 7 settings...\n```\n")
    with pytest.raises(AssertionError, match=r"page\.md:1: ice scenes prints"):
        follow(page, tmp_path)
