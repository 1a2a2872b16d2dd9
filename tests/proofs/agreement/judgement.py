"""What the rows must show: every claim with its verdict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.proofs.agreement.rows import Row
from validation.statistics import LEVEL, bias_test, verdict

MEAN, EACH = 0.03, 0.10  # calibrated over propagated: of a scene's geometric mean, and of any row
CLOSED_FORM = "gradient"  # whose closed form `calibrated` is


@dataclass(frozen=True)
class Claim:
    """That one kind of variance is right.

    Attributes
    ----------
    kind : str
        ``propagated``, ``reported``, ``calibrated`` or ``bias``.
    subject : str
        The estimator; the scene for ``calibrated``.
    holds : bool or None
        None where nothing is judged.
    text : str
        One sentence.
    """

    kind: str
    subject: str
    holds: bool | None
    text: str


def judge(rows: list[Row], level: float = LEVEL) -> tuple[Claim, ...]:
    """All claims about rows of status ``ok``.

    For each estimator the propagated and the reported variance must lie within what chance does to the empirical one,
    in each row and pooled, and no mean error may be significantly beyond what `validation.statistics.verdict` allows
    (``level`` for each estimator and kind: false alarm, over all its rows). For each scene calibrated over propagated
    must be within 3 % in the geometric mean, and within 10 % in every row, unless an effect without a formula is
    simulated there. What is ``ok`` has a variance.
    """
    estimators, groups = (tuple(dict.fromkeys(getattr(row, name) for row in rows)) for name in ("estimator", "group"))
    by_chance = [_by_chance(kind, name, rows, level) for kind in ("propagated", "reported") for name in estimators]
    biases = [_bias(name, rows, level) for name in estimators]
    return (*by_chance, *(_closed_form(name, rows) for name in groups), *biases)


def broken(claims: tuple[Claim, ...]) -> list[Claim]:
    """The claims that do not hold."""
    return [claim for claim in claims if claim.holds is False]


def _by_chance(kind: str, estimator: str, rows: list[Row], level: float) -> Claim:
    judged = _ok(estimator, rows)
    known = [row for row in judged if np.isfinite(row.ratio(kind))]
    unknown = _unknown([row for row in judged if row not in known])
    if not known:
        return Claim(kind, estimator, False if unknown else None, unknown or "no row is ok")
    found = verdict([row.ratio(kind) for row in known], [row.n for row in known], level)
    worst = max(known, key=lambda row: abs(np.log(row.ratio(kind))))
    text = (
        f"{found.inside} of {found.rows} rows inside their 95 % interval, smallest p-value {found.smallest_p:.2g} "
        f"against {found.limit:.2g}, pooled {found.pooled.ratio:.3f} with {found.pooled.p_value:.2g} against "
        f"{found.pooled.limit:.2g}; farthest {worst.ratio(kind):.3f} at {_name(worst)}{unknown}"
    )
    return Claim(kind, estimator, found.agrees and not unknown, text)


def _closed_form(group: str, rows: list[Row]) -> Claim:
    here = [row for row in rows if row.group == group and row.estimator == CLOSED_FORM]
    ok = [row for row in here if row.judged]
    judged = [row for row in ok if not row.without_formula]
    left_out = f"{len(here) - len(ok)} not ok, {len(ok) - len(judged)} with effects that have no formula"
    if not judged:
        return Claim("calibrated", group, None, f"no row is judged: {left_out}")
    known = [row for row in judged if np.isfinite([row.calibrated, row.propagated]).all()]
    unknown = _unknown([row for row in judged if row not in known])
    if not known:
        return Claim("calibrated", group, False, unknown)
    ratios = np.array([row.calibrated / row.propagated for row in known])
    mean, worst = float(np.exp(np.log(ratios).mean())), int(np.abs(np.log(ratios)).argmax())
    near = abs(mean - 1) <= MEAN and bool((np.abs(ratios - 1) <= EACH).all())
    text = (
        f"calibrated / propagated {mean:.3f} in the mean of {len(known)} rows ({left_out}), "
        f"farthest {ratios[worst]:.3f} at {_name(known[worst])}{unknown}"
    )
    return Claim("calibrated", group, near and not unknown, text)


def _bias(estimator: str, rows: list[Row], level: float) -> Claim:
    known = [row for row in _ok(estimator, rows) if np.isfinite(row.bias_over_sigma)]
    if not known:
        return Claim("bias", estimator, None, "no row is ok")
    away = np.array([row.bias_over_sigma for row in known])
    found = bias_test(away, np.array([row.n for row in known]), level)
    worst = known[int(np.abs(away).argmax())]
    text = (
        f"{found.within} of {found.rows} rows shown within {found.allowance:g} sigma, smallest p-value "
        f"{found.smallest_p:.2g} against {found.limit:.2g}; farthest {worst.bias_over_sigma:+.2f} sigma, "
        f"{worst.bias_px:+.4f} px, at {_name(worst)}"
    )
    return Claim("bias", estimator, found.smallest_p >= found.limit, text)


def _unknown(rows: list[Row]) -> str:
    """Words for rows that are ok and have no variance; none where there are none."""
    return f"; {len(rows)} ok without a variance, the first {_name(rows[0])}" if rows else ""


def _ok(estimator: str, rows: list[Row]) -> list[Row]:
    return [row for row in rows if row.judged and row.estimator == estimator]


def _name(row: Row) -> str:
    (sensor, light) = (f"({polar:.4g}, {azimuth:.4g})" for polar, azimuth in (row.sensor, row.light))
    return f"{row.group} {sensor}/{light}"
