"""The table of hard cases as text and as plain facts."""

from __future__ import annotations

from dataclasses import asdict

from validation.hard.case import Row

_HEAD = (
    f"{'case':50s} {'measurand':17s} {'ours':>10s} {'reference':>10s} {'from':12s} {'rel. error':>10s} {'allowed':>8s} "
    f"{'condition':>9s} {'verdict':8s} {'ms':>6s}  status"
)


def text(rows: list[Row]) -> str:
    """One line a case, one block an area, a summary."""
    lines = []
    for area in dict.fromkeys(row.area for row in rows):
        lines += ["", area, _HEAD] + [_line(row) for row in rows if row.area == area]
    wrong = sum(row.verdict == "WRONG" for row in rows)
    right, refused = (sum(row.verdict == verdict for row in rows) for verdict in ("right", "refused"))
    lines += [
        "",
        f"{len(rows)} cases: {right} right within their tolerance, {refused} refused with a reason, {wrong} wrong.",
        "rel. error: to the reference; px where that is an image. allowed: 1e-10 below a condition number of 1e4, then",
        "10 x condition x 2^-52; for images the estimator's bias, for Monte Carlo 4 standard errors. ms: our answer's.",
    ]
    return "\n".join(lines[1:])


def _line(row: Row) -> str:
    numbers = f"{_number(row.ours):>10s} {_number(row.reference):>10s} {row.kind:12s} {_number(row.error, 2):>10s}"
    judged = f"{_number(row.tolerance, 2):>8s} {_number(row.condition, 2):>9s} {row.verdict:8s}"
    return (
        f"{row.name[:50]:50s} {row.measurand:17s} {numbers} {judged} {1000 * row.seconds:6.1f}  {row.reason}".rstrip()
    )


def _number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def facts(rows: list[Row]) -> dict:
    """For JSON."""
    return {"cases": [asdict(row) for row in rows], "wrong": sum(row.verdict == "WRONG" for row in rows)}
