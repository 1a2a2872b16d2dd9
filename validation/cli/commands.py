"""Which commands there are; the module of one is loaded only when it is asked for."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import typer._click.shell_completion
import typer.core
from typer.core import TyperGroup
from typer.main import get_command_from_info

COMMANDS = {
    "validate": ("batch", "Predict, render and measure every setting, and judge the predictions."),
    "plan": ("plan", "Find where sensor and light should stand, and check it by rendering."),
    "render": ("render", "Render one image of a scene."),
    "measure": ("measure", "Measure an image: a scene's measurands, or what a photograph shows."),
    "fit": ("fit", "Fit a scene's camera, poses, light and noise to photographs of its part."),
    "predict": ("predict", "Predict how precisely a scene's measurands are measured, without an image."),
    "new": ("scene", "Write a commented scene of a mesh file."),
    "show": ("scene", "List and draw the vertices, edges and circles that a scene has to name."),
    "scenes": ("scene", "List the bundled scenes."),
    "effects": ("effects", "Which effects a scene calls for, why, their influence and cost."),
    "calibrate": ("calibrate", "Measure the position noise of every locator."),
    "calibrate-camera": ("calibrate_camera", "Calibrate a camera from photographs of a board."),
    "budget": ("budget", "The uncertainty of every measurand: all sources, shares, and U = k u."),
    "catalogue": ("catalogue", "Check a catalogue of sensors, lenses and lights for contradictions."),
    "design": ("design", "Which camera, lens and light to buy for a drawing's tolerances, at the least cost."),
    "msa": ("msa", "Measurement system analysis: %GRR, ndc, Cg, Cgk predicted, and a study beside them."),
    "export": ("export", "A recipe that measures one picture at a known place with NumPy alone."),
    "dossier": ("dossier", "The validation of this software for one scene, as an assessor reads it."),
    "cost": ("cost", "Measure what each parameter costs and gives on this machine."),
    "explore": ("explore", "A page on which camera and lights are dragged and the prediction answers."),
    "hard": ("hard", "Answers beside references where numbers lose their digits."),
    "merge": ("merge", "Put the parts of a run together that machines made (`ice validate --shard`)."),
    "report": ("report", "Write report.html, report.md and tables of a run."),
    "compare": ("compare", "Which settings changed beyond chance from one run to another?"),
}


class Commands(TyperGroup):
    """A group of commands that are loaded one at a time: help and errors do not wait for the renderer."""

    def list_commands(self, ctx) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx, cmd_name: str):
        if cmd_name not in COMMANDS:
            return None
        module = import_module(f"validation.cli.{COMMANDS[cmd_name][0]}")
        (info,) = (known for known in module.commands.registered_commands if known.name == cmd_name)
        return get_command_from_info(info, pretty_exceptions_short=False, rich_markup_mode=None)

    def format_commands(self, ctx, formatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])

    def shell_complete(self, ctx, incomplete: str) -> list:
        command: Any = TyperGroup.__mro__[1]
        found = command.shell_complete(self, ctx, incomplete)  # options, as of any command
        item = typer._click.shell_completion.CompletionItem
        return [item(name, help=text) for name, (_, text) in COMMANDS.items() if name.startswith(incomplete)] + found
