"""What is to be measured, with what: object, material, camera, light, noise, task and poses."""

from scenes.board import Board
from scenes.cameras.lens import Lens
from scenes.cameras.noise import Noise
from scenes.cameras.pinhole import Camera
from scenes.cameras.telecentric import Telecentric
from scenes.errors import InvalidInput
from scenes.lights import AnyLight, Backlight, Bar, Disc, Dome, Light, Luminaire, Ring, as_point
from scenes.lights.filters import Filter, Lamp
from scenes.load import find, load, names
from scenes.materials.brdf import Brdf
from scenes.materials.on_faces import FaceMaterial
from scenes.materials.textures import ImageTexture, StatisticalTexture
from scenes.materials.torrance_sparrow import Material
from scenes.measurands.features import Centre, Corner, Side, Wall
from scenes.measurands.measurands import Locator, Measurand, Quantity, Task, Tolerance
from scenes.parts.ball import Ball
from scenes.parts.block import Block
from scenes.parts.curved import Curved
from scenes.parts.mesh_file import Mesh
from scenes.parts.solid import Circle, Edge, Solid, block
from scenes.parts.step_file import Step
from scenes.parts.turned import Turned
from scenes.picture import Picture, mounted
from scenes.pose import Pose, pairs, several, shown
from scenes.scene import Scene, Setting
from scenes.surroundings import Floor, Jitter, Obstacle
from scenes.uncertain import Uncertain, UncertainNumber
from scenes.uncertainty import Uncertainty
from scenes.units import UNITS, Unit

__all__ = [
    "UNITS", "AnyLight", "Backlight", "Ball", "Bar", "Block", "Board", "Brdf", "Camera", "Centre", "Circle", "Corner",
    "Curved", "Disc", "Dome", "Edge", "FaceMaterial", "Filter", "Floor", "ImageTexture", "InvalidInput", "Jitter",
    "Lamp", "Lens", "Light", "Locator", "Luminaire", "Material", "Measurand", "Mesh", "Noise", "Obstacle", "Picture",
    "Pose", "Quantity", "Ring", "Scene", "Setting", "Side", "Solid", "StatisticalTexture", "Step", "Task",
    "Telecentric", "Tolerance", "Turned", "Uncertain", "UncertainNumber", "Uncertainty", "Unit", "Wall", "as_point",
    "block", "find", "load", "mounted", "names", "pairs", "several", "shown",
]  # fmt: skip
