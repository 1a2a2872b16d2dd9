"""What is to be measured, with what: object, material, camera, light, noise, task and poses."""

from scenes.errors import InvalidInput
from scenes.load import load, names
from scenes.model import (
    Block,
    Camera,
    Centre,
    Corner,
    Light,
    Locator,
    Material,
    Mesh,
    Scene,
    Setting,
    Task,
)
from scenes.optics import Floor, Jitter, Lens, Noise, Obstacle
from scenes.pose import Pose
from scenes.solid import Circle, Edge, Solid, block

__all__ = [
    "Block", "Camera", "Centre", "Circle", "Corner", "Edge", "Floor", "InvalidInput", "Jitter", "Lens", "Light",
    "Locator", "Material", "Mesh", "Noise", "Obstacle", "Pose", "Scene", "Setting", "Solid", "Task", "block", "load",
    "names",
]  # fmt: skip
