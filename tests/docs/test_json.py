"""docs/json.md tells of every key that a command prints, and of none that it does not."""

import json

import pytest

from scenes.load import BUNDLED
from tests.docs.pages import DOCS, keys, told
from tests.docs.shell import ice

pytestmark = pytest.mark.render

OPEN = ("failures", "parameters", "correlation", "classic_verdicts", "seconds", "paper_real", "global", "guarded")
POSES = ("--sensor", "30,135", "--light", "15,315")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Task1 with its first setting only, and a picture of it."""
    made = tmp_path_factory.mktemp("json")
    head, _, settings = (BUNDLED / "task1.toml").read_text().partition("[[settings]]")
    (made / "short.toml").write_text(head + "[[settings]]" + settings.partition("[[settings]]")[0])
    ice("render", "task1", *POSES, "-o", "a.png", "--noise-seed", "1", cwd=made)
    return made


@pytest.mark.parametrize(
    "arguments",
    [
        ("validate", "short.toml", "--renders", "60", "--workers", "1", "--out", "run"),
        ("plan", "task1", "--step", "10", "--check", "2"),
        ("measure", "a.png", "task1", *POSES),
        ("budget", "calibrated_rig", "--monte-carlo", "--reach", "0.005"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_keys_are_those_of_the_page(folder, arguments):
    every, some = told(DOCS / "json.md", f"ice {arguments[0]}")
    document = json.loads(ice(*arguments, "--json", "-q", cwd=folder).out)
    there = {key for key in keys(document) if not any(part in OPEN for part in key.split(".")[:-1])}
    assert there - every == set(), "not told"
    missing = {key for key in every - some - there if _reached(key, document)}
    assert missing == set(), "told, but not there"


def _reached(key, document):
    """Whether the list or table that should hold a key is there and not empty."""
    for part in key.split(".")[:-1]:
        document = document.get(part.removesuffix("[]"))
        if not document:
            return False
        document = document[0] if part.endswith("[]") else document
    return True


def test_a_wrong_page_is_noticed(folder, tmp_path):
    """Negative control: a key more and a key less in the page."""
    page = tmp_path / "json.md"
    page.write_text((DOCS / "json.md").read_text().replace("| `file`, `measurands` |", "| `file`, `nothing` |"))
    every, some = told(page, "ice measure")
    there = set(keys(json.loads(ice("measure", "a.png", "task1", *POSES, "--json", cwd=folder).out)))
    assert there - every == {"measurands"}
    assert every - some - there == {"nothing"}
