"""What is to be measured, with what: object, material, camera, light, noise, task and poses."""

from scenes.errors import InvalidInput
from scenes.load import load, names
from scenes.model import Block, Camera, Corner, Light, Locator, Material, Noise, Scene, Setting, Task
from scenes.pose import Pose
from scenes.solid import Edge, Solid, block

__all__ = [
    "Block", "Camera", "Corner", "Edge", "InvalidInput", "Light", "Locator", "Material", "Noise", "Pose",
    "Scene", "Setting", "Solid", "Task", "block", "load", "names",
]  # fmt: skip
