"""Hard cases: what the planner, the renderer and the measurement answer where numbers lose their digits."""

from validate.hard.case import Answer, Case, Reference, Row, run
from validate.hard.catalogue import catalogue

__all__ = ["Answer", "Case", "Reference", "Row", "catalogue", "run"]
