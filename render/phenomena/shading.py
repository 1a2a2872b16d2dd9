"""How a surface sends light on: attached shadow, fall-off, lobe, polarisation, wavelength, size of the light."""

from __future__ import annotations

import numpy as np

from imaging.features.measurand import measurands
from imaging.geometry.projection import facing
from imaging.light.backlight import backlights
from imaging.light.sheets import printed
from imaging.models.texture import texture_errors
from imaging.pictures import Pictures
from render.phenomena.base import EVERYTHING, NOTHING, Effect, Influence, changed, largest, relit, with_materials
from render.phenomena.edges import NEAR_STEP, Shading, compare, lever, sides, total_variance
from render.phenomena.transport import albedo
from scenes import Luminaire, Scene, as_point


class AttachedShadow(Effect):
    """A face turned away from the light is dark."""

    name = "attached_shadow"
    switch = "part of every reflectance; costs nothing"

    def influence(self, pictures: Pictures) -> Influence:
        """Without it a face would be lit through the object."""
        found = sides(pictures)
        planes = np.einsum("efi,ei->ef", found.normals, found.points[:, 0])
        view = pictures.viewpoint
        seen = np.einsum("efi,si->sef", found.normals, view.at) > view.share * planes
        away = (np.einsum("efi,...i->...ef", found.normals, emitter.at) < planes for emitter in pictures.emitters)
        return EVERYTHING if any((seen & each).any() for each in away) else NOTHING


class FallOff(Effect):
    """Irradiance falls with the squared distance from the light."""

    name = "fall_off"
    switch = "a point light has it; costs nothing"

    def influence(self, pictures: Pictures) -> Influence:
        scene = pictures.scene
        variance = total_variance(scene)
        first, second = (sides(pictures, fall_off=on) for on in (True, False))
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.abs((first.contrast / second.contrast) ** 2 - 1).max((-1, -2))
        moved = np.abs(first.shift(variance) - second.shift(variance)).max(-1)
        return largest((lever(pictures) * moved).sum(-1), ratio)


class SpecularLobe(Shading):
    """The Torrance-Sparrow term."""

    name = "specular_lobe"
    cost = 1.5
    switch = "the paper's reflectance as a BSDF instead of a diffuse one"

    def absent(self, pictures: Pictures) -> str | None:
        reasons = [material.dull for material in pictures.scene.surfaces.used]
        return None if None in reasons else "; ".join(sorted({str(each) for each in reasons}))

    def without(self, scene: Scene) -> Scene:
        return with_materials(scene, lambda each: each.matt())


class Polarisation(Shading):
    """Linearly polarised light: J_parallel and J_perpendicular instead of 1/2 each."""

    name = "polarisation"
    cost = 1.2
    switch = "J_parallel, J_perpendicular in the BSDF"

    def absent(self, pictures: Pictures) -> str | None:
        scene = pictures.scene
        if all(light.polarisation_deg is None for light in scene.lights):
            return "the light is unpolarised"
        return "diffuse reflection forgets polarisation" if scene.surfaces.is_diffuse else None

    def without(self, scene: Scene) -> Scene:
        return relit(scene, lambda light: _changed(light, polarisation_deg=None))


class Analyser(Shading):
    """A linear polariser in front of the sensor."""

    name = "analyser"
    cost = 1.2
    switch = "both components, with their phase, in the BSDF"

    def absent(self, pictures: Pictures) -> str | None:
        return "there is no analyser" if pictures.scene.camera.analyser_deg is None else None

    def without(self, scene: Scene) -> Scene:
        return changed(scene, "camera", analyser_deg=None)


class Wavelength(Shading):
    """The refractive index changes with the wavelength."""

    name = "wavelength"
    cost = 1.2
    switch = "the specular term summed over the wavelengths"

    def absent(self, pictures: Pictures) -> str | None:
        scene = pictures.scene
        if scene.surfaces.is_diffuse:
            return "the diffuse term does not depend on the index"
        known = any(material.dispersion for material in scene.surfaces.used)
        return None if known else "the material has no table of indices"

    def without(self, scene: Scene) -> Scene:
        return with_materials(scene, lambda each: each.with_dispersion(()))


class Texture(Effect):
    """Prints and uneven reflectance of faces."""

    name = "texture"
    cost = 2.0
    switch = "the diffuse reflectance as a table on each textured face"

    def absent(self, pictures: Pictures) -> str | None:
        return None if pictures.scene.textures else "the faces are even"

    def influence(self, pictures: Pictures) -> Influence:
        """Shifts by prints and twice the standard deviation by statistical textures; contrast by both.

        A print counts wherever it is seen: how far from an edge an estimator looks is its own.
        """
        scene = pictures.scene
        variance = compare(pictures, self.without(scene)).variance
        contrasts = [2 * each.contrast for each in scene.textures if each.kind == "statistical"]
        seen = facing(scene.solid, pictures.viewpoint).reshape(-1, len(scene.solid.normals)).any(0)
        contrasts += [float(np.abs(sheet.values - 1).max()) for face, sheet in printed(scene).items() if seen[face]]
        poses = (pictures.sensors, *pictures.lights)
        moved = []
        for sensor, *lights in zip(*(each.reshape(-1, 2) for each in poses), strict=True):
            alone = Pictures(scene, sensor, tuple(lights), closely=True)
            found = texture_errors(alone)
            spread = 2 * np.sqrt(found.variances[0][0])
            moved.append(abs(measurands(alone).gradient[0, : found.printed.size] @ found.printed) + spread)
        found = largest(np.array(moved), np.array([max(contrasts, default=0.0)]))
        return Influence(found.bias_px, found.variance + variance)

    def without(self, scene: Scene) -> Scene:
        return scene.model_copy(update={"textures": ()})


class LightSize(Effect):
    """Lights of some size: softer shading, lobes and shadows."""

    name = "light_size"
    cost = 9.0
    random = True
    switch = "spheres, discs, rectangles, rings and domes instead of points"

    def absent(self, pictures: Pictures) -> str | None:
        lights = [light for light in pictures.scene.lights if not light.faces_sensor]
        one = "the light is a point" if len(lights) == 1 else "all lights are points"
        return one if all(light.half_size == 0 for light in lights) else None

    def influence(self, pictures: Pictures) -> Influence:
        """Of the shading by quadrature over the lights against that of points in their middles.

        Unbounded where there is something to cast a penumbra on.
        """
        scene = pictures.scene
        if scene.floor is not None or scene.obstacles or not scene.solid.is_convex:
            return EVERYTHING
        return compare(pictures, self.without(scene))

    def without(self, scene: Scene) -> Scene:
        return relit(scene, lambda light: light if light.faces_sensor else as_point(light))


class BacklightShown(Effect):
    """A light that the sensor sees behind the object."""

    name = "backlight"
    cost = 2.0
    switch = "a bright plane behind the object; the whole frame is rendered"

    def absent(self, pictures: Pictures) -> str | None:
        return None if backlights(pictures.scene) else "there is no backlight"

    def influence(self, pictures: Pictures) -> Influence:
        """Everything: it is what outer edges are seen against."""
        return EVERYTHING

    def without(self, scene: Scene) -> Scene:
        return relit(scene, lambda light: _changed(light, intensity=0.0) if light.faces_sensor else light)


class Spill(Effect):
    """Light of a backlight that falls on the object's sides."""

    name = "spill"
    cost = 9.0
    random = True
    switch = "rays from the object to the backlight"

    def absent(self, pictures: Pictures) -> str | None:
        return None if backlights(pictures.scene) else "there is no backlight"

    def influence(self, pictures: Pictures) -> Influence:
        """A side along the axis has (c - sin c cos c) / pi of the radiance of a cone of half angle c, c = 90 degrees
        half of it; one that the sensor sees from within the cone at most twice that."""
        scene = pictures.scene
        cones = (scene.lights[which].cone for which in backlights(scene))
        share = float(sum(2 * (cone - np.sin(cone) * np.cos(cone)) / np.pi for cone in cones)) * albedo(scene)
        moved = NEAR_STEP * np.sqrt(total_variance(scene)) * share
        lost = 1 / (1 - share) ** 2 - 1 if share < 1 else np.inf
        return largest((lever(pictures) * moved).sum(-1), np.array([lost]))


def _changed(light: Luminaire, **values) -> Luminaire:
    return light.model_copy(update=values)
