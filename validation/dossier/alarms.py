"""How often does the verdict contradict a prediction that is right? By drawn tables, and by the run's own pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from scenes.status import is_trusted
from validation import statistics
from validation.batch.measurands import JudgedMeasurand, column
from validation.batch.result import Validation
from validation.batch.store import RunFile
from validation.statistics import LEVEL, Verdict

_FEWEST = 20  # pictures of a block that is judged alone
_BLOCKS = 40


@dataclass(frozen=True)
class Alarms:
    """So many of so many verdicts on predictions that are right contradict them: ``rate`` with its 95 % interval
    (Clopper and Pearson 1934), and the rate that is stated."""

    tables: int
    alarms: int
    pictures: int
    rate: float
    low: float
    high: float
    stated: float = LEVEL

    @classmethod
    def of(cls, alarms: int, tables: int, pictures: int) -> Alarms:
        """Counted; ``pictures`` of each row of a table."""
        if not tables:
            return cls(0, 0, pictures, np.nan, 0.0, 1.0)
        low, high = stats.binomtest(alarms, tables).proportion_ci(0.95)
        return cls(tables, alarms, pictures, alarms / tables, float(low), float(high))

    @property
    def holds(self) -> bool:
        """Whether the rate is not above the stated one beyond chance."""
        return self.low <= self.stated


def drawn(rows: Sequence[JudgedMeasurand], tables: int, seed: int) -> Alarms:
    """Of tables that are drawn as if all that was predicted were true.

    Variances are drawn from their chi-square law, mean errors from the noise of so many pictures and the renderer's;
    rows independent of each other. What else the correction of a bias is not sure of is how the station's reflectances
    and lights differ from the scene's, and in rendered pictures they do not.
    """
    some = [each for each in rows if is_trusted(each.status) and each.ratio is not None]
    if not some:
        return Alarms.of(0, 0, 0)
    rng, numbers = np.random.default_rng(seed), _Numbers.of(some)
    alarms = sum(not numbers.judged(*numbers.draw(rng)).agrees for _ in range(tables))
    return Alarms.of(alarms, tables, int(numbers.counts.max()))


def in_blocks(found: Validation, store: RunFile) -> Alarms:
    """Of the run's own pictures, in blocks of which each is judged as if it were the run."""
    rows = [each for row in found.rows for each in row.measurands]
    values = [store.distances(row.index, column(row.main.method, k))
              for row in found.rows for k in range(len(row.measurands))]  # fmt: skip
    good = [i for i, each in enumerate(rows) if is_trusted(each.status) and each.ratio is not None]
    least = min((values[i].size for i in good), default=0)
    size = max(least // _BLOCKS, _FEWEST)
    numbers, blocks, alarms = _Numbers.of([rows[i] for i in good]), least // size, 0
    for block in range(blocks):
        part = [values[i][block * size : (block + 1) * size] for i in good]
        told = [each[np.isfinite(each)] for each in part]
        ratios = np.array([each.var(ddof=1) for each in told]) / numbers.variance
        means = np.array([each.mean() for each in told]) - numbers.expected
        alarms += not numbers.judged(ratios, means, np.array([each.size for each in told])).agrees
    return Alarms.of(alarms, blocks, size)


@dataclass(frozen=True, eq=False)
class _Numbers:
    """What is predicted of n rows, each (n,): ``expected`` is the mean value, ``counts`` pictures with a value."""

    variance: np.ndarray
    expected: np.ndarray
    predicted_bias: np.ndarray
    u_bias: np.ndarray
    noise: np.ndarray
    counts: np.ndarray
    independent: np.ndarray

    @classmethod
    def of(cls, rows: Sequence[JudgedMeasurand]) -> _Numbers:
        columns = (
            [each.predicted for each in rows], [each.value + each.correction for each in rows],
            [each.predicted_bias for each in rows], [each.u_bias or 0.0 for each in rows],
            [each.render_noise for each in rows], [each.n - each.failed for each in rows],
            [each.independent for each in rows],
        )  # fmt: skip
        return cls(*(np.array(each, float) for each in columns))

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Ratios of variances and mean errors of one table; pictures."""
        freedom = self.counts - 1
        spread = np.sqrt(self.variance / self.counts + self.noise**2)
        means = self.predicted_bias + spread * rng.standard_normal(spread.size)
        return rng.chisquare(freedom) / freedom, means, self.counts

    def judged(self, ratios: np.ndarray, means: np.ndarray, counts: np.ndarray) -> Verdict:
        """Of a table, by the test that judges a run."""
        return statistics.verdict(
            ratios, counts, bias_px=means, predicted_bias_px=self.predicted_bias, sigma_px=np.sqrt(self.variance),
            u_bias_px=self.u_bias, render_noise_px=self.noise, independent=self.independent,
        )  # fmt: skip
