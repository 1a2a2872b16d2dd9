"""STEP files for tests, made by the kernel itself."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any


def drilled(size: tuple[float, float, float], holes: list[tuple[float, float, float]], bosses: list[tuple] = ()) -> Any:
    """A plate with a corner at the origin, through holes (x, y, radius) and square bosses (x, y, side, height)."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.collections import List_TopoDS_Shape
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    plate = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), *size).Shape()
    blocks = [BRepPrimAPI_MakeBox(gp_Pnt(x, y, size[2]), s, s, h).Shape() for x, y, s, h in bosses]
    drills = [
        BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, -1), gp_Dir(0, 0, 1)), r, size[2] + 2).Shape() for x, y, r in holes
    ]
    for tools, kind in ((blocks, BRepAlgoAPI_Fuse), (drills, BRepAlgoAPI_Cut)):
        if tools:
            step, first, other = kind(), List_TopoDS_Shape(), List_TopoDS_Shape()
            first.Append(plate)
            for tool in tools:
                other.Append(tool)
            step.SetArguments(first)
            step.SetTools(other)
            step.Build()
            plate = step.Shape()
    return plate


def cut(size: tuple[float, float, float], tools: list[tuple[str, tuple, tuple]]) -> Any:
    """A block with a corner at the origin less tools: ("box", corner, size) or ("bore", foot, (radius, height))."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain

    body = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), *size).Shape()
    for kind, place, dimensions in tools:
        if kind == "box":
            tool = BRepPrimAPI_MakeBox(gp_Pnt(*place), *dimensions).Shape()
        else:
            tool = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*place), gp_Dir(0, 0, 1)), *dimensions).Shape()
        body = BRepAlgoAPI_Cut(body, tool).Shape()
    whole = ShapeUpgrade_UnifySameDomain(body, True, True, False)
    whole.Build()
    return whole.Shape()


def flange(radius: float = 40.0, bore: float = 12.0, bolts: int = 6, circle: float = 28.0, bolt: float = 4.0) -> Any:
    """A disc of 10 mm with a bore, a bolt circle, and a cone, a sphere's cap and a torus on other bodies left out."""
    import math

    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    up = gp_Dir(0, 0, 1)
    body = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, 0), up), radius, 10.0).Shape()
    tools = [BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, -1), up), bore, 12.0).Shape()]
    tools.append(BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(0, 0, 8), up), bore - 1, bore + 3, 4.0).Shape())
    for k in range(bolts):
        x, y = (circle * f(2 * math.pi * k / bolts) for f in (math.cos, math.sin))
        tools.append(BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, -1), up), bolt, 12.0).Shape())
    for tool in tools:
        body = BRepAlgoAPI_Cut(body, tool).Shape()
    return body


def written(shape: Any, path: Path, names: dict[int, str] | None = None, unit: str = "MM") -> Path:
    """Write it; ``names`` for faces by their number in the file."""
    from OCP.Interface import Interface_Static
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    Message.DefaultMessenger_s().ChangePrinters().Clear()  # it prints what it does
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    text, count = path.read_text(), iter(range(10**6))
    named = re.sub(r"ADVANCED_FACE\(''", lambda _: f"ADVANCED_FACE('{(names or {}).get(next(count), '')}'", text)
    path.write_text(named)
    return path
