"""The batch job: predicted against empirical, the run file, the tables and the pictures."""

from validate.campaign import Campaign, Grid
from validate.result import Judged, Row, Validation
from validate.run import run
from validate.statistics import Verdict, ratio_interval, verdict
from validate.stopped import Stopped

__all__ = ["Campaign", "Grid", "Judged", "Row", "Stopped", "Validation", "Verdict", "ratio_interval", "run", "verdict"]
