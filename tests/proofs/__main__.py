"""``python -m tests.proofs`` with one of the commands below; without one they are listed."""

from __future__ import annotations

import typer

from tests.proofs.affine_fits import affine_fits
from tests.proofs.arcs import arcs
from tests.proofs.bias import bias
from tests.proofs.boards import boards
from tests.proofs.boxes import boxes
from tests.proofs.bundles import bundles
from tests.proofs.colour import colour
from tests.proofs.conditions import conditions
from tests.proofs.corpus import corpus
from tests.proofs.crowded import crowded
from tests.proofs.emva import emva
from tests.proofs.field_blur import field_blur
from tests.proofs.fits import fits
from tests.proofs.form import form
from tests.proofs.form_poses import form_poses
from tests.proofs.hollow import hollow
from tests.proofs.installed import installed
from tests.proofs.kill import kill
from tests.proofs.kinds import kinds
from tests.proofs.known_sizes import known_sizes
from tests.proofs.large import large
from tests.proofs.lights import lights
from tests.proofs.limbs import limbs
from tests.proofs.mixed import mixed
from tests.proofs.msa import msa
from tests.proofs.pair_bounds import pair_bounds
from tests.proofs.pairs import pairs
from tests.proofs.parts import parts
from tests.proofs.peer import peer
from tests.proofs.photographs import photographs
from tests.proofs.placements import placements
from tests.proofs.processed import processed
from tests.proofs.rate import rate
from tests.proofs.real_noise import real_noise
from tests.proofs.shots import shots
from tests.proofs.splined import splined
from tests.proofs.stations import stations
from tests.proofs.telecentric import telecentric
from tests.proofs.uneven import uneven
from tests.proofs.usable import usable
from tests.proofs.varied import varied

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)
app.command()(affine_fits)
app.command()(arcs)
app.command()(bias)
app.command()(boards)
app.command()(boxes)
app.command()(bundles)
app.command()(colour)
app.command()(conditions)
app.command()(corpus)
app.command()(crowded)
app.command()(emva)
app.command()(field_blur)
app.command()(fits)
app.command()(form)
app.command()(form_poses)
app.command()(hollow)
app.command()(installed)
app.command()(kill)
app.command()(kinds)
app.command()(known_sizes)
app.command()(large)
app.command()(lights)
app.command()(limbs)
app.command()(mixed)
app.command()(msa)
app.command()(pair_bounds)
app.command()(pairs)
app.command()(parts)
app.command()(peer)
app.command()(photographs)
app.command()(placements)
app.command()(processed)
app.command()(rate)
app.command()(real_noise)
app.command()(uneven)
app.command()(usable)
app.command()(varied)
app.command()(shots)
app.command()(splined)
app.command()(stations)
app.command()(telecentric)

if __name__ == "__main__":
    app()
