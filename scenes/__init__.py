"""What is to be measured, with what: object, material, camera, light, noise, task and poses."""

from scenes.errors import InvalidInput
from scenes.load import load, names
from scenes.model import Block, Camera, Corner, Light, Locator, Material, Scene, Setting, Task
from scenes.optics import Band, Floor, Jitter, Lens, Noise, Obstacle
from scenes.pose import Pose
from scenes.solid import Edge, Solid, block

__all__ = [
    "Band", "Block", "Camera", "Corner", "Edge", "Floor", "InvalidInput", "Jitter", "Lens", "Light", "Locator",
    "Material", "Noise", "Obstacle", "Pose", "Scene", "Setting", "Solid", "Task", "block", "load", "names",
]  # fmt: skip
