"""Every command that prints a value of a part, where nothing is known of its bias: none decides, signs or agrees.

The bias of a stepped plate is as if simulated: the same numbers twice, once told as doubtful. What decides or signs is
sought in all that is printed and written, by words and by keys; with the trusted numbers every command has some.
"""

import json
import re
from functools import partial

import numpy as np
import pytest

import measure
import scenes
from tests.commands import ice
from tests.parts import prism
from validation import kept, plan_check, simulation
from validation.batch import work
from validation.simulation import proof

POSE = ("--sensor", "20,0", "--light", "20,45")
WORDS = re.compile(
    r" (?:pass|fail) +(?:ok|clutter)|measured (?:precisely enough|usably)|TUR = |\+- [\d.e-]+ mm, k = |\bagree: "
    "|guard band U = "
)
KEYS = {"decision": ("pass", "fail"), "signed": (True,), "agrees": (True,), "capability": (dict,), "ok": (True,)}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A stepped plate of 64 x 48 pixels, and a picture of it."""
    made = tmp_path_factory.mktemp("doubt")
    prism([(0, 0), (50, 0), (50, 6), (48, 6), (48, 8), (0, 8)], 30.0).export(made / "plate.stl")
    bare = {
        "name": "plate", "units": "mm",
        "object": {"kind": "mesh", "units": "mm", "file": str(made / "plate.stl")},
        "material": {"diffuse_reflectance": 0.8}, "light": {"distance": 300.0},
        "camera": {"width": 64, "height": 48, "focal_px": 3000.0, "distance": 300.0, "look_at": [49.0, 15.0, 6.5],
                   "blur_px": 0.8, "exposure": 180.0},
        "noise": {"dark_level": 16.0, "sigma": 1.6, "bits": 8},
    }  # fmt: skip
    solid = scenes.Scene.model_validate(bare).solid
    at = {edge.name: solid.vertices[list(edge.ends)] for edge in solid.sharp}
    ends = [next(n for n, v in at.items() if np.allclose(v[:, [0, 2]], (x, 6))) for x in (48, 50)]
    text = "\n".join([
        'units = "mm"', "[object]", 'kind = "mesh"', 'units = "mm"', 'file = "plate.stl"',
        "[material]", "diffuse_reflectance = 0.8", "[light]", "distance = 300.0",
        "[camera]", *(f"{key} = {value}" for key, value in bare["camera"].items()),
        "[noise]", *(f"{key} = {value}" for key, value in bare["noise"].items()),
        "[[measurands]]", 'name = "step"', 'kind = "width"',
        f'features = [{{ edge = "{ends[0]}" }}, {{ edge = "{ends[1]}" }}]', "tolerance = 0.2",
        "[[settings]]", "sensor = [20, 0]", "light = [20, 45]",
    ])  # fmt: skip
    (made / "plate.toml").write_text(text)
    assert ice("render", made / "plate.toml", *POSE, "-o", made / "picture.png").returncode == 0
    return made


COMMANDS = {
    "measure": ("measure", "picture.png", "plate.toml", *POSE),
    "budget": ("budget", "plate.toml", *POSE),
    "budget, rendered, as pages": ("budget", "plate.toml", *POSE, "--render", "--out", "pages/budget"),
    "validate": ("validate", "plate.toml", "--renders", "20", "--workers", "1", "--out", "run", "--fresh"),
    "plan, as pages": ("plan", "plate.toml", "--sensor", "20,0", "--step", "30", "--check", "1", "--out", "plan"),
    "plan of several pictures": ("plan", "plate.toml", "--sensor", "20,0", "--step", "30", "--views", "1"),
    "predict": ("predict", "plate.toml"),
    "predict, rendered": ("predict", "plate.toml", *POSE, "--render"),
}


def numbers(part, picture, method, image=None):
    """As `simulation.simulated`, of a render that costs little: the bias that there is, its u a part of sigma."""
    if image is None:
        image = simulation.How().rough.image(picture)
    told = measure.propagate(image, picture, estimator=method.locator, threshold=method.threshold).measurands
    sources = {"rendering": 0.01 * np.sqrt(np.diag(told.covariance))}
    sources["reflectance"] = part * np.sqrt(np.diag(told.covariance))
    return measure.Correction(
        picture.scene.quantities, method.locator, method.threshold, told.bias, told.bias, sources, sources,
        told.covariance, told.covariance_image, told.status,
    )  # fmt: skip


def decided(value, key=""):
    """Places of a JSON document where something is decided, signed or agreed."""
    if isinstance(value, dict):
        return [f"{key}.{found}" for name, inner in value.items() for found in _found(name, inner)]
    return [found for inner in value for found in decided(inner, key)] if isinstance(value, list) else []


def _found(name, inner):
    if name in KEYS and (inner in KEYS[name] if not isinstance(inner, dict) else dict in KEYS[name]):
        return [name]
    return decided(inner, name)


def said(folder, name):
    """All that decides: words that a command prints and writes, keys of its document."""
    command = [folder / part if part.endswith((".toml", ".png")) else part for part in COMMANDS[name]]
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
    plain = ice(*command, cwd=folder)
    assert plain.returncode in (0, 1), plain.stderr
    found = WORDS.findall(plain.stdout)
    for path in folder.rglob("*"):
        if path.suffix in (".html", ".md", ".csv") and before.get(path) != path.stat().st_mtime_ns:
            text = re.sub(r"<style.*?</style>|<title>.*?</title>", "", path.read_text(), flags=re.DOTALL)
            found += [f"{path.name}: {word}" for word in WORDS.findall(text)]
    document = ice(*command, "--json", cwd=folder)
    return found, decided(json.loads(document.stdout))


@pytest.mark.render
@pytest.mark.parametrize("is_known", [False, True])
@pytest.mark.parametrize("name", COMMANDS)
def test_nothing_is_decided_or_signed_where_the_bias_is_not_known(name, folder, monkeypatch, is_known):
    made = partial(numbers, 0.01 if is_known else np.inf)
    monkeypatch.setattr(kept, "correction", lambda picture, method, how=None: made(picture, method))
    monkeypatch.setattr(proof, "_MOST", 1)  # how noisy its renders are is not asked here
    monkeypatch.setattr(
        work.simulation, "independent",
        lambda picture, methods, renders, *_: tuple(made(picture, method, renders.whole) for method in methods),
    )  # fmt: skip
    monkeypatch.setattr(
        plan_check.simulation, "of_render", lambda picture, method, image, *_: made(picture, method, image)
    )
    words, keys = said(folder, name)
    assert bool(words or keys) == (is_known and not name.startswith("predict")), (words, keys)
