"""The planner's variance models where light, view, contrast or size are extreme, against 50 digits."""

from __future__ import annotations

import math
from functools import partial

import planner
from scenes import Scene
from validation.hard.case import Answer, Case, Reference
from validation.hard.scenes_for import moved_block, scaled, task1

FAR = {"camera": {"distance": 1e6, "focal_px": 8e6}, "light": {"distance": 1e6}}
IN_TOP = math.degrees(math.acos(2.5 / 100))  # a light or sensor here lies in the plane of the top face
EQUAL = math.degrees(math.acos(0.025 / math.sqrt(2))) - 45  # light at azimuth 270: top and front equally bright
ABOVE_V3 = math.degrees(math.asin(12.5 / 100))  # a sensor on the line of the vertical edge below v3
GLOSS = {"specular_fraction": 0.8, "refractive_index": 2.0, "extinction": 3.0, "roughness": 0.4}
_COARSE = {"paper": {"points": 4}, "calibrated": {"adaptive": False}}  # for the condition number, which needs no digits


def cases() -> list[Case]:
    """All cases of the planner."""
    return _grazing() + _contrast() + _shapes() + _noise()


def variance(name: str, scene: Scene, sensor, light, kind: str, refusals=(), objective: str = "image") -> Case:
    """A predicted variance of one setting."""
    units = "px2" if objective == "image" else "cm2"

    def ours() -> Answer:
        found = planner.predict(scene, sensor, light, kind)
        variance = found.variance_px2 if objective == "image" else found.variance_cm2
        return Answer.of(variance, found.status)

    reference = partial(_reference, scene, sensor, light, kind, objective)
    return Case("planner", name, f"{kind} {units}", ours, reference, tuple(refusals))


def _reference(scene: Scene, sensor, light, kind: str, objective: str) -> Reference:
    from validation.hard import precise, precise_models

    def value(inputs, **how):
        return getattr(precise_models, kind)(scene, inputs, objective=objective, **how)

    inputs = precise.Inputs.of(scene, sensor, light)
    exact = value(inputs)
    if isinstance(exact, str):
        return Reference(None, "mpmath", reason=exact if kind == "calibrated" else "")
    return Reference.precise(exact, precise.condition(partial(value, **_COARSE[kind]), inputs))


def _grazing() -> list[Case]:
    far, sensor, light = task1(**FAR), (30, 135), (15, 315)
    found = []
    for polar in (89, 89.9, 89.999):
        found.append(variance(f"light at {polar} deg", far, sensor, (polar, 315), "paper"))
        found.append(variance(f"light at {polar} deg", far, sensor, (polar, 315), "calibrated"))
        found.append(variance(f"sensor at {polar} deg", far, (polar, 135), light, "paper"))
        found.append(variance(f"sensor at {polar} deg", far, (polar, 135), light, "paper", objective="object"))
        found.append(variance(f"sensor at {polar} deg", far, (polar, 135), light, "calibrated"))
    plain = task1()
    for off in (0.0, 1e-9, -1e-9):
        place = f"light {off:g} deg off the top's plane" if off else "light in the top's plane"
        found.append(variance(place, plain, sensor, (IN_TOP - off, 315), "paper"))
        found.append(variance(place.replace("light", "sensor"), plain, (IN_TOP - off, 135), light, "paper"))
    for kind in ("paper", "calibrated"):
        found += [
            variance("light at the sensor", plain, sensor, sensor, kind),
            variance("sensor at the north pole", plain, (0, 0), light, kind),
            variance("sensor at the south pole", plain, (180, 0), light, kind),
            variance("light at the north pole", plain, sensor, (0, 0), kind),
            variance("light on the lower hemisphere", plain, sensor, (120, 315), kind),
            variance("sensor and light on the lower hemisphere", plain, (135, 40), (120, 200), kind),
            variance("face seen edge-on (azimuth 90)", plain, (30, 90), light, kind),
            variance("face seen edge-on (azimuth 270)", plain, (30, 270), light, kind),
            variance("face lit edge-on (azimuth 270)", plain, (30, 225), (30, 270), kind),
        ]
    end_on = task1(task={"start": {"vertex": "v3", "edges": ["e9", "e2"]}})
    found.append(variance("edge seen end-on", end_on, (ABOVE_V3, 0), light, "paper"))
    found.append(variance("edge seen 1e-7 deg off end-on", end_on, (ABOVE_V3 + 1e-7, 0), light, "paper"))
    return found


def _contrast() -> list[Case]:
    plain, glossy, found = task1(), task1(material=GLOSS), []
    for off, name in ((0.0, "contrast 0"), (4e-11, "contrast 1e-12 of full"), (1e-4, "contrast 1e-6 of full")):
        for kind in ("paper", "calibrated"):
            found.append(variance(name, plain, (40, 300), (EQUAL - off, 270), kind))
    for kind in ("paper",):
        found.append(variance("contrast changes sign along e4 (gloss)", glossy, (73, 230), (39, 283), kind))
        found.append(variance("contrast changes sign along e9 (gloss)", glossy, (20, 328), (64, 316), kind))
        found.append(
            variance("glossy, light at 89.999 deg", task1(material=GLOSS, **FAR), (30, 135), (89.999, 315), kind)
        )
        found.append(
            variance("glossy, sensor at 89.999 deg", task1(material=GLOSS, **FAR), (89.999, 135), (15, 315), kind)
        )
    return found


def _shapes() -> list[Case]:
    sensor, light, found = (30, 135), (15, 315), []
    far = task1(**FAR)
    for name, azimuth in (("corners of 0.01 and 179.99 deg", 135), ("edges all but parallel", 45)):
        found.append(variance(name, far, (89.995, azimuth), light, "paper"))
    for pixels in (1, 2, 4):
        small = task1(object={"size": [s * pixels / 56 for s in (12.5, 7.5, 2.5)]})  # e9 and e11 are 56 px long
        found.append(variance(f"shortest edge of {pixels} px", small, sensor, light, "paper"))
        found.append(variance(f"shortest edge of {pixels} px", small, sensor, light, "calibrated"))
    for factor in (1e-6, 1e6):
        for kind in ("paper", "calibrated"):
            found.append(variance(f"all lengths x {factor:g}", scaled(factor), sensor, light, kind))
        found.append(variance(f"all lengths x {factor:g}", scaled(factor), sensor, light, "paper", objective="object"))
    for factor in (1e-3, 1e-6, 1e-9):
        tiny = task1(object={"size": [factor * s for s in (12.5, 7.5, 2.5)]})
        found.append(variance(f"object {factor:g} of its size, same distance", tiny, sensor, light, "paper"))
    for away, distance in ((5.0, 100.0), (1e4, 1e6)):
        scene = moved_block(task1(camera={"distance": distance}, light={"distance": distance}), (away, -away, away))
        found.append(variance(f"object {away:g} cm from the origin on each axis", scene, sensor, light, "paper"))
    for name, size in (("needle", (12.5, 1e-5, 1e-5)), ("plate", (12.5, 7.5, 1e-9)), ("post", (1e-3, 1e-3, 20.0))):
        found.append(variance(f"thin {name} {size}", task1(object={"size": list(size)}), sensor, light, "paper"))
        found.append(variance(f"thin {name} {size}", task1(object={"size": list(size)}), sensor, light, "calibrated"))
    return found


def _noise() -> list[Case]:
    sensor, light, found = (30, 135), (15, 315), []
    for name, sigma in (("noise 1e-6 grey levels", 1e-6), ("noise 100 x the contrast", 2e4)):
        for kind in ("paper", "calibrated"):
            found.append(variance(name, task1(noise={"sigma": sigma, "bits": None}), sensor, light, kind))
    for exposure in (1e-12, 1e12):
        bright = task1(camera={"exposure": exposure})
        found.append(variance(f"exposure {exposure:g}", bright, sensor, light, "paper"))
    return found
