"""Pages made from the program are up to date; links lead somewhere; every page is in the contents."""

import re

import pytest

from tests.docs.pages import DOCS, ROOT, links
from validation.cli import reference

PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md"))]


def test_the_command_lines_page_is_up_to_date():
    """`python -m validation.cli.reference docs` writes it anew."""
    assert (DOCS / "command-line.md").read_text() == reference.page()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in links(page):
        path, _, heading = target.partition("#")
        there = (page.parent / path).resolve() if path else page
        assert there.is_relative_to(ROOT), target
        assert there.exists(), target
        if heading:
            headings = re.findall(r"^#+ (.+)$", there.read_text(), re.M)
            slugs = [re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-") for text in headings]
            assert heading in slugs, target


def test_every_page_is_in_the_contents():
    """And the contents name no other."""
    listed = re.findall(r"^[\w-]+$", (DOCS / "index.md").read_text(), re.M)
    assert sorted([*listed, "index"]) == sorted(page.stem for page in [*DOCS.glob("*.md"), *DOCS.glob("*.ipynb")])


def test_what_the_architecture_names_is_there():
    """Files and folders, of the repository or of the package whose line names them."""
    text = (ROOT / "ARCHITECTURE.md").read_text()
    named = {path for path in re.findall(r"`([\w./]+)`", text) if "/" in path or path.endswith((".py", ".md", ".txt"))}
    assert len(named) > 60
    packages = [each for each in ROOT.iterdir() if (each / "__init__.py").exists()]
    beside = [
        ROOT,
        *packages,
        ROOT / "imaging" / "light",
        ROOT / "imaging" / "models",
        ROOT / "scenes" / "lights",
        ROOT / "scenes" / "measurands",
    ]
    assert [path for path in sorted(named) if not any((folder / path).exists() for folder in beside)] == []
