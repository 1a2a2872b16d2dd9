"""What is wrong with how a page looks in a browser: cut off, covered, faint, small."""

from __future__ import annotations

import asyncio
from pathlib import Path

from tests.chromium import chromium

NOTHING = {"outside": [], "clipped": [], "overlaps": [], "faint": [], "small": 0, "unexplained": 0}
LOOK = """(() => {
const wide = document.documentElement.clientWidth;
const unseen = e => e && (getComputedStyle(e).clipPath.startsWith('inset') || unseen(e.parentElement));
const all = [...document.body.querySelectorAll('*')].filter(e => !unseen(e) && e.checkVisibility());
const free = all.filter(e => !e.closest('.wide') || e.matches('.wide'));
const size = e => parseFloat(getComputedStyle(e).fontSize);
const box = e => e.getBoundingClientRect();
const meet = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1
  && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1;
const overlaps = [];
for (const svg of document.querySelectorAll('svg')) {
  const texts = [...svg.querySelectorAll('text')].filter(e => e.textContent.trim() && e.checkVisibility());
  texts.forEach((a, i) => texts.slice(i + 1).forEach(b => {
    if (meet(box(a), box(b))) overlaps.push(a.textContent + ' | ' + b.textContent);
  }));
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
const written = e => [...e.childNodes].some(n => n.nodeType == 3 && n.data.trim());
const faint = all.filter(e => !(e instanceof SVGElement) && written(e)).filter(e => {
    const [low, high] = [grey(getComputedStyle(e).color), grey(behind(e))].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05) < 4.5;
  });
return {
  outside: free.filter(e => box(e).right > wide + 0.5).map(e => e.outerHTML.slice(0, 80)),
  clipped: all.filter(e => !(e instanceof SVGElement) && e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0
    && getComputedStyle(e).overflowX != 'auto').map(e => e.outerHTML.slice(0, 80)),
  overlaps, faint: faint.map(e => e.outerHTML.slice(0, 80)),
  small: all.filter(e => e.matches('p, td, th, figcaption, li') && size(e) < 10).length,
  unexplained: [...document.querySelectorAll('.wide')].filter(e => e.checkVisibility()
    && !(e.nextElementSibling?.textContent.length > 40)).length,
}})()"""


def looked_at(page: Path, width: int) -> tuple[dict, dict, list[str]]:
    """What `LOOK` finds in a window of that width, and again with all that is folded opened."""

    async def look():
        async with chromium(width) as window:
            await window.open(page.as_uri())
            await window.until("document.readyState == 'complete'")
            first = await window.value(LOOK)
            await window.value("document.querySelectorAll('details').forEach(e => e.open = true)")
            return first, await window.value(LOOK), window.errors

    return asyncio.run(look())
