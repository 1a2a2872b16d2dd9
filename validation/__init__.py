"""The batch job: predicted against empirical, the run file, the tables and the pictures."""

from validation.batch.campaign import Campaign, Grid
from validation.batch.job import run
from validation.batch.result import Judged, Row, Validation
from validation.batch.stopped import Stopped
from validation.statistics import Verdict, ratio_interval, verdict

__all__ = ["Campaign", "Grid", "Judged", "Row", "Stopped", "Validation", "Verdict", "ratio_interval", "run", "verdict"]
