"""How far places lie off the faces of a STEP file, asked of OpenCASCADE alone: are two files of one part the same?"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

_ON = 1e-5  # mm: no nearer face matters


def distances(path: Path, places: np.ndarray) -> np.ndarray:
    """Of places (n, 3) from the nearest face of a file, (n,), mm; of those below `_ON` any one."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt

    faces = _faces(path)
    low, high = (np.array(ends) for ends in zip(*map(_box, faces), strict=True))
    found = np.full(len(places), np.inf)
    for i, place in enumerate(places):
        least = np.linalg.norm(np.maximum(0, np.maximum(low - place, place - high)), axis=1)
        vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*place.tolist())).Vertex()
        for k in np.argsort(least, kind="stable"):
            if found[i] <= max(_ON, least[k]):
                break
            apart = BRepExtrema_DistShapeShape(vertex, faces[k])
            if apart.IsDone():
                found[i] = min(found[i], apart.Value())
    return found


def _faces(path: Path) -> list[Any]:
    from OCP import TopAbs, TopExp, TopoDS
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    explorer = TopExp.TopExp_Explorer(reader.OneShape(), TopAbs.TopAbs_ShapeEnum.TopAbs_FACE)
    found = []
    while explorer.More():
        found.append(TopoDS.TopoDS.Face(explorer.Current()))
        explorer.Next()
    return found


def _box(face: Any) -> tuple[list[float], list[float]]:
    """Lower and upper ends of a box around a face."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.Add_s(face, box, False)
    low, high = ([corner.X(), corner.Y(), corner.Z()] for corner in (box.CornerMin(), box.CornerMax()))
    return low, high
