"""The rows and the judgement, as text and as plain facts."""

from __future__ import annotations

import math
from dataclasses import asdict

from tests.proofs.agreement.judgement import Claim, broken
from tests.proofs.agreement.rows import KINDS, Row

_HEAD = (
    f"{'sensor':>14s} {'light':>14s} {'estimator':9s} {'n':>5s} {'lost':>4s} "
    + " ".join(f"{'/ ' + kind:>21s}" for kind in KINDS)
    + f" {'cal/prop':>8s} {'bias/sigma':>10s} status"
)
_VERDICTS = {True: "holds", False: "BROKEN", None: "-"}


def text(rows: list[Row], claims: tuple[Claim, ...]) -> str:
    """One block a scene, one line a setting and estimator; then every claim."""
    lines = ["Empirical variance over ..., with the 95 % chi-square interval; only rows of status ok are judged."]
    for group in dict.fromkeys(row.group for row in rows):
        lines += ["", group, _HEAD, *(_line(row) for row in rows if row.group == group)]
    lines += ["", "Judgement"]
    lines += [f"{c.kind:10s} {c.subject:16s} {_VERDICTS[c.holds]:6s} {c.text}" for c in claims]
    wrong = broken(claims)
    said = f"{len(wrong)} of {len(claims)} claims are broken." if wrong else "Prediction, render and measurement agree."
    return "\n".join([*lines, "", said])


def _line(row: Row) -> str:
    ratios = " ".join(f"{_ratio(row, kind):>21s}" for kind in KINDS)
    closed = row.calibrated / row.propagated if row.propagated else math.nan
    notes = ", ".join([row.status, *row.without_formula, *([row.reason] if row.reason else [])])
    return (
        f"{_pose(row.sensor):>14s} {_pose(row.light):>14s} {row.estimator:9s} {row.n:5d} {row.failed:4d} "
        f"{ratios} {_number(closed):>8s} {_number(row.bias_over_sigma, 2):>10s} {notes}"
    )


def _pose(pose: tuple[float, float]) -> str:
    return f"({pose[0]:.1f}, {pose[1]:.1f})"


def _number(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def _ratio(row: Row, kind: str) -> str:
    if not math.isfinite(row.ratio(kind)):
        return "-"
    low, high = row.interval(kind)
    return f"{row.ratio(kind):.3f} [{low:.3f}, {high:.3f}]{' ' if low <= 1 <= high else '*'}"


def facts(rows: list[Row], claims: tuple[Claim, ...]) -> dict:
    """For JSON, which knows neither infinity nor NaN."""
    listed = []
    for row in rows:
        ratios = {kind: {"ratio": row.ratio(kind), "interval": list(row.interval(kind))} for kind in KINDS}
        listed.append(asdict(row) | {"judged": row.judged, "bias_over_sigma": row.bias_over_sigma, "over": ratios})
    judged = [asdict(claim) for claim in claims]
    return _plain({"rows": listed, "claims": judged, "agree": not broken(claims)})


def _plain(value):
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
