"""The bias of a picture by simulation: images without noise, also of what the scene is not sure of."""

from validation.simulation.corrections import best, of_render, simulated
from validation.simulation.how import How
from validation.simulation.proof import Renders, independent, steadied

__all__ = ["How", "Renders", "best", "independent", "of_render", "simulated", "steadied"]
