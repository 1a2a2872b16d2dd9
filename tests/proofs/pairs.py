"""STEP and STL files of the same parts: do they offer the same straight edges and circles, and only those that are?

What is there is asked of OpenCASCADE's own edges and faces (`tests.cad_edges`), by none of the program's code; so is
whether both files are of the same surfaces at all (`tests.cad_faces`).
"""

from __future__ import annotations

import itertools
import tempfile
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import trimesh
import typer
from scipy.spatial import KDTree

import planner
from scenes import Measurand
from scenes.errors import InvalidInput
from scenes.parts import mesh, step
from scenes.parts.solid import Solid
from scenes.status import is_trusted
from tests.cad_edges import SAME, Sharp, sharp_edges
from tests.cad_faces import distances
from validation import new_scene

SIGMA = 0.01  # of a standard deviation
_ALONG = 33  # places of an offered edge that are asked whether they lie on one
_SAME_PART = 0.98  # of the corners of its sharp edges: those of another revision are elsewhere


@dataclass(frozen=True)
class Match:
    """Features of one kind that are offered, beside those that there are.

    Attributes
    ----------
    there, matched : int
        Those of the file; of them offered.
    missed : ndarray, shape (k, ...)
        Those that are not.
    false : ndarray, shape (n, ...)
        Offered ones that are none.
    part : ndarray, shape (m, ...)
        Offered ones that lie on a straight edge and end elsewhere: halves, or a little of a curve that continues it.
    """

    there: int
    matched: int
    missed: np.ndarray
    false: np.ndarray
    part: np.ndarray

    def __str__(self) -> str:
        part = f", {len(self.part)} in part" if len(self.part) else ""
        return f"{self.matched} of {self.there}, {len(self.false)} false{part}"


def matched(there: np.ndarray, offered: np.ndarray, signs: np.ndarray | None = None) -> Match:
    """Features (n, k) and (m, k) that differ by at most `SAME` in each number; ``signs`` (k,) make the same one."""
    if not len(there) or not len(offered):
        return Match(len(there), 0, there, offered, offered[:0])
    both = offered if signs is None else np.concatenate([offered, offered * signs])
    near = KDTree(both).query(there, p=np.inf)
    found = near[0] <= SAME
    taken = np.zeros(len(offered), bool)
    taken[near[1][found] % len(offered)] = True
    return Match(len(there), int(found.sum()), there[~found], offered[~taken], offered[:0])


def matched_lines(there: np.ndarray, offered: np.ndarray) -> Match:
    """Straight edges (n, 2, 3) and (m, 2, 3): their middles, and half their way from either end."""
    numbers = [np.concatenate([ends.mean(1), (ends[:, 1] - ends[:, 0]) / 2], 1) for ends in (there, offered)]
    return matched(*numbers, np.repeat([1.0, -1.0], 3))


def compared_lines(there: Sharp, turn: np.ndarray, shift: np.ndarray, found: np.ndarray) -> Match:
    """Straight edges (m, 2, 3) that are offered beside those of a part, turned and shifted.

    None are those that lie on no straight edge: edges that are straight within `SAME` may be offered.
    """
    lines, nearly, curves = (each @ turn.T + shift for each in (there.lines, there.nearly, there.curves))
    match = matched_lines(lines, found)
    left = matched_lines(nearly, _ends(match.false)).false
    straight = np.concatenate([lines, nearly])
    part = np.array([_lies_on(ends, straight, curves) for ends in _ends(left)], bool)
    return replace(match, false=left[~part], part=left[part])


def _ends(rows: np.ndarray) -> np.ndarray:
    """Ends (n, 2, 3) of edges by their middles and half their ways (n, 6)."""
    return np.stack([rows[:, :3] - rows[:, 3:], rows[:, :3] + rows[:, 3:]], 1)


def _lies_on(ends: np.ndarray, straight: np.ndarray, curves: np.ndarray) -> bool:
    """Whether a line (2, 3) lies on edges of a part, and for most of its length on straight ones."""
    places = ends[0] + np.linspace(0, 1, _ALONG)[:, None] * (ends[1] - ends[0])
    on = _near(places, straight)
    pieces = np.stack([curves[:, :-1], curves[:, 1:]], 2).reshape(-1, 2, 3)
    return bool((on | _near(places, pieces)).all() and on.mean() > 0.5)


def _near(places: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Which places (n, 3) are no farther than `SAME` from one of lines (m, 2, 3); bool, (n,)."""
    if not len(lines):
        return np.zeros(len(places), bool)
    way = lines[:, 1] - lines[:, 0]
    away = places[:, None] - lines[:, 0]
    along = np.clip((away * way).sum(-1) / np.maximum((way**2).sum(-1), 1e-300), 0, 1)
    return np.linalg.norm(away - along[..., None] * way, axis=-1).min(1) <= SAME


def offered(solid: Solid) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the sharp edges (n, 2, 3), and centres and radii of the circles (m, 4), that a solid offers."""
    ends = solid.vertices[np.array([edge.ends for edge in solid.sharp], int).reshape(-1, 2)]
    circles = np.array([[*circle.centre, circle.radius] for circle in solid.circles]).reshape(-1, 4)
    return ends, circles


def moved(there: Sharp, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Turn (3, 3) by right angles and shift (3,) that bring a file's edges to the corners of a mesh, and how many."""
    ends = there.lines.reshape(-1, 3)
    if not len(ends):
        return np.eye(3), np.zeros(3), 1.0
    tree, best = KDTree(corners), (np.eye(3), np.zeros(3), -1.0)
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            turn = np.eye(3)[list(order)] * np.array(signs)[:, None]
            if np.linalg.det(turn) < 0:
                continue
            for shift in _shifts(ends @ turn.T, corners):
                share = float((tree.query(ends @ turn.T + shift)[0] <= SAME).mean())
                if share > best[2] + 1e-9:
                    best = turn, shift, share
            if best[2] > _SAME_PART:
                return best
    return best


def _shifts(ends: np.ndarray, corners: np.ndarray) -> list[np.ndarray]:
    """None, and those that bring the boxes to each other: at their lower ends, their upper ends, their middles."""
    low, high = corners.min(0) - ends.min(0), corners.max(0) - ends.max(0)
    return [np.zeros(3), low, high, (low + high) / 2]


@dataclass(frozen=True)
class Pair:
    """What both files of a part offer; ``share`` of the corners of its edges are where the mesh has one.

    ``apart`` is how far the farthest corner of the mesh is off the faces of the STEP file, mm.
    """

    name: str
    share: float
    apart: float
    placed: str
    step_lines: Match
    step_circles: Match
    lines: Match
    circles: Match

    @property
    def same(self) -> bool:
        """Whether the mesh is of this revision of the part."""
        return self.share >= _SAME_PART  # margin: a limit, no tolerance

    @property
    def differ(self) -> bool:
        """Whether the files' surfaces are not the same."""
        return self.apart > SAME

    def __str__(self) -> str:
        note = self.placed if self.same else f"{self.placed}; ANOTHER REVISION, {self.share:.0%} of the corners"
        note += f"; FILES DIFFER, surfaces by {self.apart:.4f} mm" if self.differ else ""
        return (
            f"{self.name:<26}STEP lines {self.step_lines}; circles {self.step_circles} | "
            f"STL lines {self.lines}; circles {self.circles}{note}"
        )


def compared(exact: Path, tessellated: Path) -> Pair:
    """Both files of a part."""
    there = sharp_edges(exact)
    lines, circles = offered(step.read(exact).solid)
    solid = mesh.read(tessellated)
    corners = np.unique(np.asarray(trimesh.load_mesh(tessellated, process=False).vertices), axis=0)
    turn, shift, share = moved(there, corners)
    there_circles = np.concatenate([there.circles[:, :3] @ turn.T + shift, there.circles[:, 3:]], 1)
    found = offered(solid)
    placed = "" if np.array_equal(turn, np.eye(3)) and not shift.any() else " (elsewhere)"
    return Pair(
        exact.stem,
        share,
        float(distances(exact, (corners - shift) @ turn).max()),
        placed,
        compared_lines(there, np.eye(3), np.zeros(3), lines),
        matched(there.circles, circles),
        compared_lines(there, turn, shift, found[0]),
        matched(there_circles, found[1]),
    )


def names(exact: Solid, tessellated: Solid) -> dict[str, str]:
    """For edges, circles and vertices of a part as the STEP file names them the mesh's names, where it has them."""
    found: dict[str, str] = {}
    rows = [
        (
            {each.name: [*each.centre, each.radius, *each.axis] for each in solid.circles},
            {each.name: np.sort(solid.vertices[list(each.ends)], 0).ravel() for each in solid.sharp},
            dict(zip(solid.vertex_names, solid.vertices, strict=True)),
        )
        for solid in (exact, tessellated)
    ]
    for one, other in zip(*rows, strict=True):
        if one and other:
            away, which = KDTree(np.array(list(other.values()))).query(np.array(list(one.values())), p=np.inf)
            called = [list(other)[k] for k in which]
            found |= {name: to for name, to, off in zip(one, called, away, strict=True) if off <= SAME}
    return found


def told_by(measurand: Measurand, names: dict[str, str]) -> Measurand | None:
    """The same by other names; None where it needs one that there is not."""

    def renamed(value: Any) -> Any:
        if isinstance(value, (list, tuple)):
            return [renamed(each) for each in value]
        return names[value]

    try:
        features = [
            {key: renamed(value) for key, value in each.model_dump(exclude_none=True).items()}
            for each in measurand.features
        ]
    except KeyError:
        return None
    said = {"name": measurand.name, "kind": measurand.kind, "tolerance": measurand.tolerance.plus}
    return Measurand(**said, features=features)


def sigmas(exact: Path, tessellated: Path) -> tuple[dict[str, float], dict[str, str]]:
    """Of what ``ice new`` proposes for the STEP file: sigma predicted for the mesh over that for it, at one setting.

    Only of what may be relied on from both files; of the rest both statuses, where these differ.
    """
    with tempfile.TemporaryDirectory() as folder:
        new = new_scene.written(exact, Path(folder) / "exact.toml", "mm")
        scene, look = new.scene, new.look
        other = new_scene.written(tessellated, Path(folder) / "mesh.toml", "mm").scene
    if look is None:
        return {}, {}
    called = names(scene.solid, other.solid)
    pairs_ = [(each, told_by(each, called)) for each in look.measurands]
    known = [(one, two) for one, two in pairs_ if two is not None]
    if not known:
        return {}, {}
    camera = scene.camera
    predicted = [
        planner.predict(each.with_(camera=camera, measurands=asked), look.sensor, look.light).measurands
        for each, asked in ((scene, [one for one, _ in known]), (other, [two for _, two in known]))
    ]
    ratios, other_statuses = {}, {}
    for one, two in zip(*predicted, strict=True):
        if is_trusted(one.status) and is_trusted(two.status):
            ratios[one.name] = float(np.sqrt(two.variance_object / one.variance_object))
        elif one.status != two.status:
            other_statuses[one.name] = f"{one.status} and {two.status}"
    return ratios, other_statuses


def pairs(
    steps: Annotated[Path, typer.Argument(help="Folder of STEP files.")],
    meshes: Annotated[Path, typer.Argument(help="Folder of STL files of the same names.")],
    only: Annotated[str, typer.Option(help="Names that begin so.")] = "",
    sigma: Annotated[bool, typer.Option(help="Compare predicted standard deviations, too.")] = False,
    details: Annotated[bool, typer.Option(help="Where what is missed and what is false is.")] = False,
) -> None:
    """STEP and STL of the same parts: straight edges and circles that both offer, beside those that there are."""
    totals: Counter[str] = Counter()
    for exact in sorted(path for path in steps.iterdir() if path.suffix.lower() in step.FORMATS):
        tessellated = meshes / f"{exact.stem}.stl"
        if not exact.name.startswith(only) or not tessellated.exists():
            continue
        try:
            pair = compared(exact, tessellated)
        except InvalidInput as error:
            print(f"{exact.stem:<26}{error}")
            totals["refused"] += 1
            continue
        print(pair, flush=True)
        if sigma and pair.same and not pair.placed:
            ratios, statuses = sigmas(exact, tessellated)
            told = [f"{name} {ratio:.4f}" for name, ratio in ratios.items()]
            told += [f"{name} {both}" for name, both in statuses.items()]
            print("    sigma of the mesh over that of STEP: " + ", ".join(told), flush=True)
            totals["sigma compared"] += len(ratios)
            totals["sigma same"] += sum(abs(ratio - 1) <= SIGMA for ratio in ratios.values())
            totals["statuses differ"] += len(statuses)
        if details:
            print(_details(pair))
        totals += _counted(pair)
    print(_total(totals))


def _counted(pair: Pair) -> Counter[str]:
    found = Counter({"pairs": 1, "same": int(pair.same), "differ": int(pair.differ)})
    for name in ("step_lines", "step_circles", "lines", "circles"):
        match = getattr(pair, name)
        if pair.same or name.startswith("step"):
            facts = {"there": match.there, "matched": match.matched, "false": len(match.false), "part": len(match.part)}
            found += Counter({f"{name} {key}": count for key, count in facts.items()})
    return found


def _total(totals: Counter[str]) -> str:
    told = f"{totals['pairs']} pairs, {totals['same']} of the same revision, {totals['refused']} refused"
    lines = [f"{told}; surfaces of {totals['differ']} differ by more than {SAME:g} mm"]
    for name in ("step_lines", "step_circles", "lines", "circles"):
        counts = [totals[f"{name} {key}"] for key in ("matched", "there", "false", "part")]
        told = name.replace("step_", "STEP ") if name.startswith("step") else f"STL {name}"
        lines.append("{}: {} of {} offered, {} that are none, {} in part".format(told, *counts))
    if totals["sigma compared"]:
        other = f"; of {totals['statuses differ']} more the statuses differ"
        lines.append(f"sigma within {SIGMA:.0%}: {totals['sigma same']} of {totals['sigma compared']}{other}")
    return "\n".join(lines)


def _details(pair: Pair) -> str:
    told = []
    for name in ("step_lines", "step_circles", "lines", "circles"):
        match = getattr(pair, name)
        for kind in ("missed", "false", "part"):
            for row in getattr(match, kind)[:40]:
                told.append(f"    {name} {kind}: " + ", ".join(f"{x:.4f}" for x in row))
    return "\n".join(told)
