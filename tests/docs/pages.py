"""Reading pages as the tests need them: fenced blocks, tables of keys, links."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

_FENCE = re.compile(r"^```\{?([\w-]+)\}? ?(.*?)\n(.*?)^```$", re.M | re.S)


@dataclass(frozen=True)
class Block:
    """A fenced block: language, caption ("" for none), text, line in the page."""

    language: str
    caption: str
    text: str
    line: int


def blocks(page: Path) -> list[Block]:
    """All fenced blocks of a page, in order."""
    found, text = [], page.read_text()
    for fence in _FENCE.finditer(text):
        kind, argument, body = fence.groups()
        caption = re.match(r":caption: (.+)\n\n?", body)
        language = argument if kind == "code-block" else kind
        line = text.count("\n", 0, fence.start()) + 1
        found.append(Block(language, caption[1] if caption else "", body[caption.end() :] if caption else body, line))
    return found


def told(page: Path, command: str) -> tuple[set[str], set[str]]:
    """Keys that the tables under a command's heading tell of: all, and those that are there only in some cases."""
    section = re.search(rf"^## {command}\n(.*?)(?=^## |\Z)", page.read_text(), re.M | re.S)[1]
    prefix, every, some = "", set(), set()
    for line in section.splitlines():
        if head := re.match(r"\*\*`(.+)`\*\*", line):
            prefix = f"{head[1]}."
        elif row := re.match(r"\| (`.+?) \| (.+) \|$", line):
            names = {prefix + name for name in re.findall(r"`([^`]+)`", row[1])}
            every |= names
            some |= names if row[2].startswith("Only") else set()
    return every, some


def keys(document: Any, prefix: str = "") -> Iterator[str]:
    """Paths of all keys of a document; ``[]`` is each item of a list."""
    if isinstance(document, dict):
        for key, value in document.items():
            yield prefix + key
            yield from keys(value, f"{prefix}{key}.")
    elif isinstance(document, list):
        for value in document:
            yield from keys(value, prefix.removesuffix(".") + "[].")


def links(page: Path) -> list[str]:
    """Targets of all links and pictures of a page that are not on the web."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.M | re.S)
    return [target for target in re.findall(r"\]\(([^)\s]+)\)", text) if not target.startswith("http")]
