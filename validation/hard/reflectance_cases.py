"""Reflectance where materials and angles are extreme, against 50 digits."""

from __future__ import annotations

from functools import partial

import numpy as np

from scenes import Material
from validation.hard import precise
from validation.hard.case import Answer, Case, Reference

_NORMAL = np.array([0.0, 0.0, 1.0])
MATERIALS = {
    "n = 1 exactly": {"refractive_index": 1.0},
    "n = 1 + 1e-9": {"refractive_index": 1.0 + 1e-9},
    "n = 1, k = 1e-9": {"refractive_index": 1.0, "extinction": 1e-9},
    "n = 1.5, k = 0": {"refractive_index": 1.5},
    "n = 0.2, total reflection": {"refractive_index": 0.2},
    "silver n = 0.05, k = 4": {"refractive_index": 0.05, "extinction": 4.0},
    "n = 200, k = 300": {"refractive_index": 200.0, "extinction": 300.0},
    "roughness 0.001": {"refractive_index": 1.5, "roughness": 0.001},
    "roughness 2": {"refractive_index": 1.5, "roughness": 2.0},
}
ANGLES = {"at 45": (45.0, -45.0), "light 89.999": (89.999, -60.0), "both 89.999": (89.999, -89.999)}


def cases() -> list[Case]:
    """Every material at every pair of angles."""
    found = []
    for name, facts in MATERIALS.items():
        material = Material(specular_fraction=0.5, **facts)
        for place, angles in ANGLES.items():
            vectors = [_vector(angle) for angle in angles]
            ours = partial(_ours, material, *vectors)
            reference = partial(_reference, material, *vectors)
            found.append(Case("reflectance", f"{name}, {place} deg", "N.L R", ours, reference))
    return found


def _vector(angle: float) -> np.ndarray:
    return np.array([np.sin(np.radians(angle)), 0.0, np.cos(np.radians(angle))])


def _ours(material: Material, to_light: np.ndarray, to_sensor: np.ndarray) -> Answer:
    index = material.indices()
    return Answer.of(float(material.reflected(index, _NORMAL, to_light, to_sensor)))


def _reference(material: Material, to_light: np.ndarray, to_sensor: np.ndarray) -> Reference:
    """From the components of the same vectors, the unit length of which is good to the last digit only."""

    def value(numbers):
        light, sensor = (tuple(numbers[i : i + 3]) for i in (0, 3))
        return precise.brightness(material, (0, 0, 1), light, sensor)

    return precise.reference(value, (*to_light, *to_sensor))
