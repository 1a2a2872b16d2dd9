"""What files hold: photographs and their tone curves, STEP records, faces by place, the pages of the formats."""

import contextlib
import json
import struct
import subprocess
import tempfile
from functools import partial
from pathlib import Path
from unittest import mock

import cv2
import numpy as np

from scenes import photograph, plugins, reference, selection
from scenes.cameras import mosaic, tone
from scenes.parts import step, walls
from tests.regression.numbers.poses import load, without_error
from tests.regression.stored import CLOSED
from validation import picture_file

_ROOT = Path(__file__).parents[3]
_RECORD = _ROOT / "tests" / "unit" / "flange.step.json"
_WRITTEN = np.array([-0.1, 0.0, 0.0404, 0.0405, 0.31, 0.5, 0.77, 1.0])


def refused(make):
    """A result, or the words in which a value is refused."""
    try:
        return without_error(make)
    except ValueError as error:
        return str(error)


@contextlib.contextmanager
def folder():
    """An empty folder to work in: names of files in words are short ones."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        yield Path()


def _tones():
    asked = ("none", "SRGB", "1", "2.2", "0.1", "10", "0.099", "10.1", "x", "nan")
    made = [refused(partial(tone.asked, each)) for each in asked]
    made.append(tone.Tone("table", 0.0, (0.0, 0.1, 0.5, 1.0)))
    return [[each, [each.plain, each.light(_WRITTEN)] if isinstance(each, tone.Tone) else None] for each in made]


def _profiled(data, name=b"gTRC", more=b"kTRC"):
    """An ICC profile with a curve, and another behind it."""
    other = b"para" + bytes(4) + struct.pack(">HHi", 0, 0, 3 * 65536)
    tags = [(name, 156, len(data)), (more, 156 + len(data), len(other))]
    return bytes(128) + struct.pack(">I", 2) + b"".join(struct.pack(">4sII", *tag) for tag in tags) + data + other


def _profiles():
    def para(form, power):
        return b"para" + bytes(4) + struct.pack(">HHi", form, 0, round(power * 65536))

    def curv(*numbers, count=None):
        head = struct.pack(">I", len(numbers) if count is None else count)
        return b"curv" + bytes(4) + head + struct.pack(f">{len(numbers)}H", *numbers)

    steep = np.round(65535 * np.linspace(0, 1, 9) ** 1.7).astype(int)
    srgb = np.round(65535 * tone.SRGB.light(np.linspace(0, 1, 1024))).astype(int)
    curves = {
        **{
            f"para {form} {power}": para(form, power)
            for form, power in (
                (0, 2.2),
                (0, 1.0),
                (0, 0.05),
                (0, 10.0),
                (0, 10.2),
                (0, 0.1001),
                (3, 2.4),
                (4, 2.405),
                (3, 2.42),
                (2, 2.4),
            )
        },
        "one": curv(563),
        "none": curv(),
        "table": curv(*steep),
        "two": curv(0, 65535),
        "of sRGB": curv(*srgb),
        "cut": curv(1, 2, count=3),
        "many": curv(*[7] * 9, count=65537),
        "unknown": b"mft2" + bytes(20),
    }
    found = {name: tone.of_profile(_profiled(data)) for name, data in curves.items()}
    found |= {
        f"named {name}": tone.of_profile(_profiled(curv(563), name, b"none")) for name in (b"kTRC", b"rTRC", b"bTRC")
    }
    return found | {"empty": tone.of_profile(b""), "without": tone.of_profile(bytes(132))}


def _mosaics():
    rng = np.random.default_rng(3)
    most = [np.array([value], np.uint16) for b in (8, 10, 12, 14, 16) for value in (2**b - 1, min(2**b, 65535))]
    ramp = np.add.outer(np.linspace(0, 40, 36), np.linspace(400, 900, 50))
    colours = np.tile([[0.5, 1.0], [1.05, 0.7]], (18, 25))
    even = ramp * colours + rng.normal(0, 1, ramp.shape)
    uneven = even.copy()
    uneven[:, :25] *= np.tile([[1.3, 1.0], [1.0, 0.8]], (18, 13))[:, :25]
    names = (*mosaic.PATTERNS, "gbrg", "XYZ")
    return {
        "bits": [mosaic.bits(each) for each in most],
        "of bytes": mosaic.bits(np.zeros(2, np.uint8)),
        "even": mosaic.balanced(even, "rggb"),
        "uneven": [
            refused(partial(mosaic.balanced, each, name))
            for each in (uneven, uneven.astype(np.uint16))
            for name in names
        ],
        "small": [
            refused(partial(mosaic.balanced, even[:rows, :columns], "RGGB"))
            for rows, columns in ((15, 40), (16, 16), (17, 15))
        ],
    }


def _photographs():
    rng = np.random.default_rng(8)
    y, x = np.mgrid[:75, :90]
    plain = np.stack([60 + 90 * (x > 30), 40 + 25 * (y > 50), 50 + 120 * (x + y > 80)], -1)  # blue, green, red
    colours = np.clip(np.rint(plain + rng.normal(0, [6.0, 2.0, 5.0], plain.shape)), 0, 255).astype(np.uint8)
    files = {
        "colour.png": colours,
        "grey.png": colours[..., 2],
        "three.png": np.repeat(colours[..., :1], 3, 2),
        "ten.png": colours[..., 1].astype(np.uint16) * 5,
        "real.tif": colours[..., 2].astype(np.float32) / 7,
        "lossy.jpg": colours,
        "clear.png": np.dstack([colours, colours[..., :1]]),
    }
    asked = {
        "colour.png": [
            {},
            {"gamma": "2.2"},
            {"gamma": "none"},
            *({"channel": name} for name in photograph.CHANNELS),
            {"channel": "x"},
            {"bayer": "RGGB"},
        ],
        "grey.png": [{}, {"channel": "r"}, {"bayer": "RGGB"}, {"gamma": "srgb"}, {"bayer": "x"}],
        "three.png": [{}],
        "ten.png": [{}, {"gamma": "1.8"}, {"gamma": "none", "bayer": "GBRG"}],
        "real.tif": [{}, {"gamma": "srgb"}, {"gamma": "2.2"}],
        "lossy.jpg": [{"gamma": "none"}],
        "clear.png": [{}],
        "none.png": [{}],
    }
    with folder():
        for name, image in files.items():
            cv2.imwrite(name, image)
        # a decoder of JPEG rounds as it will
        found = {name: [_levels(name, each) for each in some] for name, some in asked.items()}
    return found


def _levels(name, how):
    found = refused(partial(photograph.read, Path(name), **how))
    if isinstance(found, str):
        return found
    about = [found.full, found.compressed, found.tone, found.channel, found.tone_known, found.levels.shape]
    return about if found.compressed else [*about, found.levels]


def _written():
    image = np.random.default_rng(5).uniform(-20, 300, (7, 9))
    with folder():
        found = {}
        for name in ("a.png", "a.tif", "a.npy", "a.tiff"):
            refused(partial(picture_file.write, Path(name), image))
            found[name] = np.load(name) if name == "a.npy" else cv2.imread(name, cv2.IMREAD_UNCHANGED)
        return found


def _flange(unit):
    part = step.part(json.loads(_RECORD.read_text()), unit)
    solid = part.solid
    return {
        "surfaces": [
            [each.kind, refused(partial(each.values, np.array([[0.3, 1.7, 2.2], [40.0, 1.0, 5.0]])))]
            for each in part.surfaces
        ],
        "names": part.names,
        "edges": [[e.kind, e.faces, e.ends, e.centre, e.axis, e.radii] for e in part.edges],
        "circles": [[c.name, c.centre, c.axis, c.radius, len(c.edges)] for c in solid.circles],
        "faces": solid.face_names[:40],
        "kinds": {k: sum(e.kind == k for e in solid.edges) for k in ("sharp", "smooth")},
        "curved": [[type(each).__name__, each] for each in part.curved],
        "triangles": part.triangles.shape,
    }


def _other_records():
    """Kinds of faces that the flange lacks, and answers of the kernel's process."""
    record = json.loads(_RECORD.read_text())
    face = next(each for each in record["faces"] if each["kind"] == "cylinder")
    changed = {
        "sphere": {"kind": "sphere"},
        "torus": {"kind": "torus", "radius": 5.0, "tube": 1.2},
        "other": {"kind": "other"},
        "plane": {"kind": "plane", "normal": [0.6, 0.0, 0.8]},
    }
    told = {name: refused(lambda c=c: _surface_of(face | c)) for name, c in changed.items()}
    answers = {
        "found": (0, _RECORD.read_bytes(), b""),
        "absent": (3, b"", b"words"),
        "said": (2, b"", b"first\na solid, got none\n"),
        "silent": (2, b"", b" "),
        "killed": (-11, b"", b"words"),
    }
    for name, (code, out, err) in answers.items():
        done = subprocess.CompletedProcess([], code, out, err)
        told[name] = refused(partial(_read, mock.Mock(return_value=done)))
    told["late"] = refused(partial(_read, mock.Mock(side_effect=subprocess.TimeoutExpired("", 1))))
    told["no first line"] = refused(partial(_read, mock.Mock(), b" " * 1000 + b"ISO-10303-21;"))
    told["first line"] = refused(
        partial(_read, mock.Mock(return_value=subprocess.CompletedProcess([], 3)), b" " * 988 + b"ISO-10303-21")
    )
    return told


def _surface_of(face):
    surface = step._surface(face, 0.1)
    return surface and [surface.kind, surface.values(np.array([[0.3, 1.7, 2.2], [4.0, 1.0, 0.5]]))]


def _read(run, data=b"ISO-10303-21;"):
    with folder(), mock.patch.object(step, "find_spec", lambda name: name), mock.patch.object(subprocess, "run", run):
        Path("a.STEP").write_bytes(data)
        found = step.read(Path("a.STEP"), "cm")
        return [len(found.surfaces), run.call_args.args[0][3:], run.call_args.kwargs["timeout"], found.triangles]


def _faces():
    solid = load("task1").solid
    low, high = solid.vertices.min(0), solid.vertices.max(0)
    middle = (low + high) / 2
    up = solid.normals[0] + 0.02 * np.array([0.3, -0.5, 0.1])
    asked = [
        *({"where": name} for name in ("top", "bottom", "front", "back", "left", "right", "up")),
        {},
        {"faces": (solid.face_names[1], solid.face_names[-1])},
        {"faces": ("none",)},
        {"faces": ("x",), "where": "top"},
        {"faces": (solid.face_names[2],) * 2},
        {"where": {}},
        {"where": {"normal": (0, 0, 0)}},
        {"where": {"box": (tuple(low), tuple(high))}},
        {"where": {"box": (tuple(high), tuple(low))}},
        {"where": {"box": (tuple(low - 0.1), (high[0], high[1], middle[2]))}},
        {"where": {"box": (tuple(low), (high[0], low[1], high[2] + 0.1))}},
        {"where": {"box": (tuple(low + 1e-7), tuple(high - 1e-7))}},
        {"where": {"box": (tuple(low + 1e-4), tuple(high + 1))}},
        *({"where": {"normal": tuple(up), "within_deg": angle}} for angle in (0.3, 1.0, 1.2, 91.0, 180.0)),
        {"where": {"normal": tuple(up), "within_deg": 100.0, "box": (tuple(low - 0.1), (high[0], high[1], middle[2]))}},
    ]
    return [refused(lambda a=a: selection.OnFaces.model_validate(a).chosen(solid, "textures[0]")) for a in asked]


def _pages():
    """Whether the pages of the formats are those that the code says."""
    with folder():
        paths = reference.write(Path("made"))
        return [path.read_text() == (_ROOT / "docs" / path.name).read_text() for path in paths]


def _plugins():
    names = ("tests.boards", "tests.boards", "no_such_module", "not a name", "tests..x")
    with mock.patch.object(plugins, "_loaded", []):
        return [[refused(partial(plugins.load, name)), plugins.loaded()] for name in names]


def _alike():
    """Where a wall's neighbours are alike."""
    part = step.part(json.loads(_RECORD.read_text()))
    owners = part._owners(part.solid)
    surfaces = [None if number % 3 == 1 else each for number, each in enumerate(part.surfaces)]
    return [[each, owners.tolist().count(2)] for each in walls.exact_walls(part.solid, owners, surfaces, part.names)]


def cases():
    """By name: relative tolerance, and what makes the result."""
    made = {
        "tones": _tones,
        "tones of profiles": _profiles,
        "mosaics": _mosaics,
        "photographs": _photographs,
        "written pictures": _written,
        "flange": partial(_flange, "mm"),
        "flange in inches": partial(_flange, "inch"),
        "other records": _other_records,
        "faces by place": _faces,
        "pages": _pages,
        "plugins": _plugins,
        "exact walls": _alike,
    }
    return {f"file {name}": (CLOSED, make) for name, make in made.items()}
