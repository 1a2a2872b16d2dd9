"""The batch job: predicted against empirical, the run file, the tables and the pictures."""

from validate.result import Judged, Row, Validation
from validate.run import run
from validate.statistics import Verdict, ratio_interval, verdict

__all__ = ["Judged", "Row", "Validation", "Verdict", "ratio_interval", "run", "verdict"]
