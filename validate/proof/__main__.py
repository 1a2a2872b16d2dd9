"""``python -m validate.proof kill`` and ``python -m validate.proof rate``."""

from __future__ import annotations

import typer

from validate.proof.kill import kill
from validate.proof.rate import rate

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)
app.command()(kill)
app.command()(rate)

if __name__ == "__main__":
    app()
