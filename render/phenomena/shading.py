"""How a surface sends light on: attached shadow, fall-off, lobe, polarisation, wavelength, size of the light."""

from __future__ import annotations

import numpy as np

from planner import Pictures
from planner.features.measurand import measurands
from planner.models.texture import texture_errors
from render.phenomena.base import EVERYTHING, NOTHING, Effect, Influence, changed, largest, with_materials
from render.phenomena.edges import compare, lever, sides, total_variance
from scenes import Scene


class AttachedShadow(Effect):
    """A face turned away from the light is dark."""

    name = "attached_shadow"
    switch = "part of every reflectance; costs nothing"

    def absent(self, pictures: Pictures) -> str | None:
        return None

    def influence(self, pictures: Pictures) -> Influence:
        """Without it a face would be lit through the object."""
        found = sides(pictures)
        away = np.einsum("efi,si->sef", found.normals, pictures.lights_at[0]) < np.einsum(
            "efi,ei->ef", found.normals, found.points[:, 0]
        )
        seen = np.einsum("efi,si->sef", found.normals, pictures.sensor_at) > np.einsum(
            "efi,ei->ef", found.normals, found.points[:, 0]
        )
        return EVERYTHING if (away & seen).any() else NOTHING


class FallOff(Effect):
    """Irradiance falls with the squared distance from the light."""

    name = "fall_off"
    switch = "a point light has it; costs nothing"

    def absent(self, pictures: Pictures) -> str | None:
        return None

    def influence(self, pictures: Pictures) -> Influence:
        scene = pictures.scene
        variance = total_variance(scene)
        first, second = (sides(pictures, fall_off=on) for on in (True, False))
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.abs((first.contrast / second.contrast) ** 2 - 1).max((-1, -2))
        moved = np.abs(first.shift(variance) - second.shift(variance)).max(-1)
        return largest((lever(pictures) * moved).sum(-1), ratio)


class SpecularLobe(Effect):
    """The Torrance-Sparrow term."""

    name = "specular_lobe"
    cost = 1.5
    switch = "the paper's reflectance as a BSDF instead of a diffuse one"

    def absent(self, pictures: Pictures) -> str | None:
        scene = pictures.scene
        if all(material.specular_fraction == 0 for material in scene.surfaces.used):
            return "specular_fraction is 0"
        return "n = 1 and k = 0: no Fresnel reflection" if scene.surfaces.is_diffuse else None

    def influence(self, pictures: Pictures) -> Influence:
        scene = pictures.scene
        return compare(pictures, self.without(scene))

    def without(self, scene: Scene) -> Scene:
        return with_materials(scene, refractive_index=1.0, extinction=0.0, index_table=())


class Polarisation(Effect):
    """Linearly polarised light: J_parallel and J_perpendicular instead of 1/2 each."""

    name = "polarisation"
    cost = 1.2
    switch = "J_parallel, J_perpendicular in the BSDF"

    def absent(self, pictures: Pictures) -> str | None:
        scene = pictures.scene
        if scene.light.polarisation_deg is None:
            return "the light is unpolarised"
        return "diffuse reflection forgets polarisation" if scene.surfaces.is_diffuse else None

    def influence(self, pictures: Pictures) -> Influence:
        scene = pictures.scene
        return compare(pictures, self.without(scene))

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "light", polarisation_deg=None)


class Analyser(Effect):
    """A linear polariser in front of the sensor."""

    name = "analyser"
    cost = 1.2
    switch = "both components, with their phase, in the BSDF"

    def absent(self, pictures: Pictures) -> str | None:
        scene = pictures.scene
        return "there is no analyser" if scene.camera.analyser_deg is None else None

    def influence(self, pictures: Pictures) -> Influence:
        scene = pictures.scene
        return compare(pictures, self.without(scene))

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "camera", analyser_deg=None)


class Wavelength(Effect):
    """The refractive index changes with the wavelength."""

    name = "wavelength"
    cost = 1.2
    switch = "the specular term summed over the wavelengths"

    def absent(self, pictures: Pictures) -> str | None:
        scene = pictures.scene
        if scene.surfaces.is_diffuse:
            return "the diffuse term does not depend on the index"
        known = any(material.index_table for material in scene.surfaces.used)
        return None if known else "the material has no table of indices"

    def influence(self, pictures: Pictures) -> Influence:
        scene = pictures.scene
        return compare(pictures, self.without(scene))

    def without(self, scene: Scene) -> Scene:
        return with_materials(scene, index_table=())


class Texture(Effect):
    """Prints and uneven reflectance of faces."""

    name = "texture"
    cost = 2.0
    switch = "the diffuse reflectance as a table on each textured face"

    def absent(self, pictures: Pictures) -> str | None:
        return None if pictures.scene.textures else "the faces are even"

    def influence(self, pictures: Pictures) -> Influence:
        """Shifts by prints and twice the standard deviation by statistical textures; contrast by both."""
        scene = pictures.scene
        variance = compare(pictures, self.without(scene)).variance
        uneven = max((each.contrast for each in scene.textures if each.kind == "statistical"), default=0.0)
        poses = (pictures.sensors, *pictures.lights)
        moved = []
        for sensor, *lights in zip(*(each.reshape(-1, 2) for each in poses), strict=True):
            alone = Pictures(scene, sensor, tuple(lights), closely=True)
            found = texture_errors(alone)
            spread = 2 * np.sqrt(found.variances[0][0])
            moved.append(abs(measurands(alone).gradient[0, : found.printed.size] @ found.printed) + spread)
        found = largest(np.array(moved), np.array([2 * uneven]))
        return Influence(found.bias_px, found.variance + variance)

    def without(self, scene: Scene) -> Scene:
        return scene.model_copy(update={"textures": ()})


class LightSize(Effect):
    """A light of finite radius: softer shading, lobes and shadows."""

    name = "light_size"
    cost = 9.0
    random = True
    has_formula = False
    switch = "a sphere or a disc instead of a point"

    def absent(self, pictures: Pictures) -> str | None:
        scene = pictures.scene
        return "the light is a point" if scene.light.radius == 0 else None

    def influence(self, pictures: Pictures) -> Influence:
        """Second order in the light's angle a: cos / r^2 changes by at most 2 a^2, a lobe m wide by (a / m)^2.

        Unbounded where a face is lit at less than 2 a, or where there is something to cast a penumbra on.
        """
        scene = pictures.scene
        angle = scene.light.radius / scene.light.distance
        found = sides(pictures)
        towards = pictures.lights_at[0][:, None, None, None] - found.points[:, None]
        sine = np.einsum("sefni,efi->sefn", towards, found.normals) / np.linalg.norm(towards, axis=-1)
        if (np.abs(sine) < 2 * angle).any() or scene.floor is not None or scene.obstacles or not scene.solid.is_convex:
            return EVERYTHING
        share = 2 * angle**2 + (0 if scene.surfaces.is_diffuse else (angle / _smoothest(scene)) ** 2)
        moved = np.abs(found.shift(total_variance(scene))).max(-1) * share
        return largest((lever(pictures) * moved).sum(-1), np.array([2 * share]))

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "light", radius=0.0)


def _smoothest(scene: Scene) -> float:
    """The least roughness of what has a lobe."""
    return min(material.roughness for material in scene.surfaces.used if not material.is_diffuse)
