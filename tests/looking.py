"""What is wrong with how a page looks in a browser: cut off, covered, faint, small, or not as WCAG AA asks."""

from __future__ import annotations

import asyncio
from importlib.resources import files
from pathlib import Path

import pytest

from tests.chromium import PROGRAM, Page, chromium

needs_a_browser = pytest.mark.skipif(PROGRAM is None, reason="no Chromium is installed")
WIDTHS = (390, 768, 1280)
NOTHING = {"outside": [], "clipped": [], "overlaps": [], "cut": [], "faint": [], "small": 0, "unexplained": 0}
LOOK = """(() => {
const wide = document.documentElement.clientWidth;
const unseen = e => e && (getComputedStyle(e).clipPath.startsWith('inset') || unseen(e.parentElement));
const all = [...document.body.querySelectorAll('*')].filter(e => !unseen(e) && e.checkVisibility());
const free = all.filter(e => !e.closest('.wide') || e.matches('.wide'));
const size = e => parseFloat(getComputedStyle(e).fontSize);
const box = e => e.getBoundingClientRect();
const meet = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1
  && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1;
const overlaps = [], cut = [];
for (const svg of document.querySelectorAll('svg')) {
  const texts = [...svg.querySelectorAll('text')].filter(e => e.textContent.trim() && e.checkVisibility());
  texts.forEach((a, i) => texts.slice(i + 1).forEach(b => {
    if (meet(box(a), box(b))) overlaps.push(a.textContent + ' | ' + b.textContent);
  }));
  const [whole, near] = [box(svg), (a, b) => a.left > b.left - 1 && a.right < b.right + 1 && a.top > b.top - 1
    && a.bottom < b.bottom + 1];
  cut.push(...texts.filter(e => !near(box(e), whole)).map(e => e.textContent));
}
const grey = text => {
  const part = text.match(/[0-9.]+/g).slice(0, 3).map(c => c / 255);
  const [r, g, b] = part.map(c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const behind = e => {
  for (; e; e = e.parentElement) {
    const colour = getComputedStyle(e).backgroundColor;
    if (colour != 'rgba(0, 0, 0, 0)') return colour;
  }
  return 'rgb(255, 255, 255)';
};
const below = e => {
  const at = box(e);
  for (const o of document.elementsFromPoint((at.left + at.right) / 2, (at.top + at.bottom) / 2)) {
    if (o.closest('text')) continue;
    if (!(o instanceof SVGElement) || o.matches('svg')) return behind(o);
    if (o.matches('image')) return null;
    const style = getComputedStyle(o);
    if (style.fill.startsWith('rgb(') && style.fillOpacity * style.opacity > 0.9) return style.fill;
  }
  return 'rgb(255, 255, 255)';
};
const written = e => [...e.childNodes].some(n => n.nodeType == 3 && n.data.trim());
const faint = all.filter(e => written(e) && (e.matches('text') || !(e instanceof SVGElement))).filter(e => {
    const drawn = e instanceof SVGElement, ground = drawn ? below(e) : behind(e);
    if (ground == null) return true;
    const [low, high] = [grey(getComputedStyle(e)[drawn ? 'fill' : 'color']), grey(ground)].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05) < 4.5;
  });
return {
  outside: free.filter(e => box(e).right > wide + 0.5).map(e => e.outerHTML.slice(0, 80)),
  clipped: all.filter(e => !(e instanceof SVGElement) && e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0
    && getComputedStyle(e).overflowX != 'auto').map(e => e.outerHTML.slice(0, 80)),
  overlaps, cut, faint: faint.map(e => e.outerHTML.slice(0, 80)),
  small: all.filter(e => e.matches('p, td, th, figcaption, li') && size(e) < 10).length,
  unexplained: [...document.querySelectorAll('.wide')].filter(e => e.checkVisibility()
    && !(e.nextElementSibling?.textContent.length > 40)).length,
}})()"""


_OPEN = "document.querySelectorAll('details').forEach(e => e.open = true)"
_AXE = """axe.run({resultTypes: ['violations']}).then(found =>
  found.violations.flatMap(rule => rule.nodes.map(node => rule.id + ': ' + node.html.slice(0, 80))))"""


def looked_at(page: Path, width: int) -> tuple[dict, dict, list[str]]:
    """What `LOOK` finds in a window of that width, and again with all that is folded opened."""

    async def look():
        async with chromium(width) as window:
            await _open(window, page)
            first = await _whole(window, width)
            await window.value(_OPEN)
            return first, await _whole(window, width), window.errors

    return asyncio.run(look())


def lowest(page: Path, selector: str, width: int) -> float:
    """Where what a selector finds ends below, px from the page's top, in a window of that width."""

    async def look():
        async with chromium(width) as window:
            await _open(window, page)
            await window.resize(width, 900)
            every = f"[...document.querySelectorAll('{selector}')].map(e => e.getBoundingClientRect().bottom)"
            return await window.value(f"Math.max(...{every}) + window.scrollY")

    return asyncio.run(look())


def against_wcag(page: Path) -> list[str]:
    """What axe-core finds wrong: contrast by WCAG 2.1 AA, names, headings, landmarks."""
    pytest.importorskip("axe_core_python", reason="axe-core is not installed")

    async def look():
        async with chromium() as window:
            await _open(window, page)
            await window.value(f"{(files('axe_core_python') / 'axe.min.js').read_text()}; 0")
            return await window.value(_AXE, seconds=300)

    return asyncio.run(look())


async def _open(window: Page, page: Path) -> None:
    await window.open(page.as_uri())
    await window.until("document.readyState == 'complete'")


async def _whole(window: Page, width: int) -> dict:
    """In a window as long as the page: what lies below a label is known only of what is inside."""
    await window.resize(width, await window.value("document.documentElement.scrollHeight"))
    return await window.value(LOOK)
