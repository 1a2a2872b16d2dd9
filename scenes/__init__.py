"""What is to be measured, with what: object, material, camera, light, noise, task and poses."""

from scenes.camera import Camera
from scenes.errors import InvalidInput
from scenes.lens import Lens
from scenes.lights import Light
from scenes.load import find, load, names
from scenes.materials import FaceMaterial, Material
from scenes.measurands import Centre, Corner, Locator, Measurand, Quantity, Side, Task, Tolerance
from scenes.noise import Noise
from scenes.parts.block import Block
from scenes.parts.mesh_file import Mesh
from scenes.parts.solid import Circle, Edge, Solid, block
from scenes.picture import Picture
from scenes.pose import Pose
from scenes.scene import Scene, Setting
from scenes.surroundings import Floor, Jitter, Obstacle
from scenes.textures import ImageTexture, StatisticalTexture
from scenes.units import UNITS, Unit

__all__ = [
    "UNITS", "Block", "Camera", "Centre", "Circle", "Corner", "Edge", "FaceMaterial", "Floor", "ImageTexture",
    "InvalidInput", "Jitter", "Lens", "Light", "Locator", "Material", "Measurand", "Mesh", "Noise", "Obstacle",
    "Picture", "Pose", "Quantity", "Scene", "Setting", "Side", "Solid", "StatisticalTexture", "Task", "Tolerance",
    "Unit", "block", "find", "load", "names",
]  # fmt: skip
