"""Hard cases: what the planner, the renderer and the measurement answer where numbers lose their digits."""

from validation.hard.case import Answer, Case, Reference, Row, run
from validation.hard.catalogue import catalogue

__all__ = ["Answer", "Case", "Reference", "Row", "catalogue", "run"]
