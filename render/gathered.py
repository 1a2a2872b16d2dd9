"""Light that met two other surfaces at least before the one that is seen, gathered from patches of the first of them.

Most of the noise of light between faces is that of light which met more than one, and little of the light: a ray finds
by chance what has been sent on again. Patches (`imaging.light.exchanged`) tell it without noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from imaging.light.senders import senders
from render.meshes import mesh
from scenes import Picture, Scene

SURFACES = 2  # that light which rays find may meet, the one that is seen among them


def is_gathered(scene: Scene) -> bool:
    """Whether patches tell light between a scene's faces: these are diffuse, bare and none of a turned part."""
    bare = scene.surfaces.is_diffuse and not scene.textures and scene.camera.analyser_deg is None
    return bare and not scene.solid.curved


@dataclass(frozen=True, eq=False)
class Gathering:
    """Faces that shine by what they send on, and what finds their light.

    Attributes
    ----------
    mitsuba : module
    scene : mitsuba.Scene
        Its surfaces are red: what they reflect is, what shines itself is white.
    met : mitsuba.Integrator
        Of what is seen and what rays from there meet.
    """

    mitsuba: Any
    scene: Any
    met: Any

    @classmethod
    def of(cls, mitsuba: Any, picture: Picture) -> Gathering | None:
        """Of a picture; None where patches do not tell (`is_gathered`), or no two faces see each other."""
        scene = picture.scene
        found = senders(picture) if is_gathered(scene) else None
        if found is None:
            return None
        kinds, white = scene.surfaces.kinds, [each.diffuse() for each in scene.surfaces.materials]
        if scene.bright_floor is not None:
            kinds, white = np.append(kinds, len(white)), [*white, scene.bright_floor.reflectance]
        made: dict[str, Any] = {"type": "scene"}
        for kind in np.unique(kinds):
            here = kinds[found.faces] == kind
            bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [white[kind], 0.0, 0.0]}}
            made[f"kind{kind}"] = mesh(
                mitsuba, found.triangles[here], bsdf, normals=found.normals[here], sent=found.sent[here]
            )
        met = mitsuba.load_dict({"type": "direct", "emitter_samples": 0, "bsdf_samples": 1})
        return cls(mitsuba, mitsuba.load_dict(made, parallel=False), met)

    def image(self, sensor: Any, seed: int) -> np.ndarray:
        """What a sensor, whose film has colours, sees of it: of what shines itself both colours have the same."""
        seen = np.array(self.mitsuba.render(self.scene, sensor=sensor, integrator=self.met, seed=seed), float)
        return seen[:, :, 0] - seen[:, :, 1]
