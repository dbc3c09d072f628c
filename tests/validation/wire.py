# # A wire through a block
#
# A wire is pushed through a block along a plane, without friction.  Unlike the halves of a block that a blade holds
# apart, those behind a wire come together again, and the bond that was not opened all the way gives back what it holds.
#
# ## What theory says
#
# Once the cut is steady all that is stored moves along with the wire.  What the force spends is then what the bond has
# lost for good.  A point of it is opened by the diameter of the wire, $x = 2R/\varepsilon$ times the characteristic
# opening $\varepsilon$ of the exponential law, and closes along the secant, so that of its toughness it has lost
#
# $$ s = 1 - (1 + x + x^2/2)\, e^{-x}. $$
#
# Per way the wire cuts a little more than its way, as what is below is compressed: $F (1 + \epsilon/2) =
# (s\,G_c + \text{viscous work per way})(1 + \epsilon)$ per width, with $\epsilon = F/S$.  Apart from $s$ the force does
# not depend on the diameter: Kamyab, Chakrabarti and Williams (1998) measure in cheese what yields in addition, in
# proportion to it.
#
# This holds where the halves close behind the wire.  Between smooth walls they do.  The halves of a strip with free
# sides bend away from a thick wire and stay apart: such a strip of 2 mm needs 4 % more for a wire of 0.8 mm.

import logging
from dataclasses import dataclass
from math import exp
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI

from cutsim import (
    Ball,
    Exponential,
    Faces,
    Mechanics,
    NeoHookean,
    PenaltyContact,
    StepControl,
    Support,
    ToolContact,
    ToolPath,
    cracked_block,
    geometry,
    read_geo,
    run,
)
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.recording import Recording
from cutsim.studies.insertion_work import steady_force

COMM = MPI.COMM_WORLD
SILICONE, VISCOSITY = NeoHookean(0.777, 0.45), 2e-4  # MPa, MPa s at 1 mm/s
BOND = Exponential(strength=0.3, toughness=0.1)  # MPa, N/mm
HALF = 2.0  # of the block, from the plane of the cut to a wall [mm]
BEFORE, STEADY, BELOW = 1.0, 0.7, 2.7  # way below the notch until the cut is steady, way of it, and what is left [mm]


@dataclass(frozen=True)
class Wire:
    """A wire and the size of the elements along its way [mm]."""

    radius: float
    size: float

    @property
    def name(self) -> str:
        """What the results are called."""
        return f"R = {self.radius:g} mm, h = {self.size:g} mm"

    @property
    def notch(self) -> float:
        """Depth of the notch in which it is put."""
        return 4 * self.radius

    @property
    def start(self) -> float:
        """Depth of its centre there."""
        return 0.6 * self.notch

    @property
    def end(self) -> float:
        """Depth of its centre at the end."""
        return self.notch + BEFORE + STEADY

    @property
    def lost(self) -> float:
        """Share of its toughness that the bond loses behind the wire."""
        x = 2 * self.radius * np.e * BOND.strength / BOND.toughness
        return 1 - (1 + x + x**2 / 2) * exp(-x)

    def problem(self) -> tuple[Mechanics, list[ToolContact]]:
        """The block, whose faces are spread by the wire, one half for each, before it is pushed. Collective."""
        sizes = {"dim": 2, "Lx": HALF, "H": self.end + BELOW, "notch": self.notch, "deep": self.end + 1.0}
        sizes |= {"lc": self.size, "band": 0.3, "growth": 1.6}
        domain = read_geo(geometry("block"), COMM, sizes, gdim=2)
        body = cracked_block(domain, SILICONE, BOND, viscosity=VISCOSITY, faces=Faces(symmetric=True, firm=True))
        contacts = []
        for face, aside in (("+", -1.0), ("-", 1.0)):
            places = [(aside * (self.radius + 0.01), -self.start), (0.0, -self.start), (0.0, -self.end)]
            path = ToolPath.polyline([0.0, 1.0, 1.0 + self.end - self.start], places)
            faces = [crack.surface(face) for crack in (body.cracks[0], body.notch)]
            firm = PenaltyContact.automatic(SILICONE.young, self.size, 50.0, blend=0.02 * self.size)
            name = f"wire_{'right' if face == '+' else 'left'}"
            contacts.append(ToolContact(body.state, Ball(self.radius), path, faces, contact=firm, name=name))
        held = [Support(body.state, domain.facets(f"far_{side}"), 0) for side in ("left", "right")]
        held.append(Support(body.state, domain.facets("bottom"), 1))
        return Mechanics(body.state, [*body.terms, *contacts], held), contacts

    def push(self, out: Path) -> dict[str, float]:
        """Mean force of the steady cut over the closed form. Collective."""
        problem, contacts = self.problem()
        until = 1.0 + self.end - self.start

        def columns(columns):
            force = float(sum(contact.force() for contact in contacts)[1])
            return {"depth": (-contacts[0].position.value[1], "length"), "force": (force, "force")}

        control = StepControl(first=0.02, largest=0.1, smallest=1e-6)
        with Recording(out, problem, until, title=self.name, extra=columns, every=0) as recording:
            run(problem, until, control, recording)
        history = recording.columns()
        depth = history["depth"]
        at = np.linspace(self.notch + BEFORE, self.end, 200)
        force = float(np.trapezoid(np.interp(at, depth, history["force"]), at) / STEADY)
        viscous = float(np.diff(np.interp(at[[0, -1]], depth, history["energy_viscous"]))[0]) / STEADY
        nu = SILICONE.poisson
        stiffness = 2 * HALF * SILICONE.young * (1 - nu) / ((1 + nu) * (1 - 2 * nu))  # between walls
        expected = steady_force(self.lost * BOND.toughness + viscous, 1.0, stiffness)
        return {
            "force": force,
            "force over closed form": force / expected,
            "force over toughness": force / BOND.toughness,
            "share lost": self.lost,
            "largest closure": float(np.abs(history["energy_closure"]).max()),
            "unknowns": problem.state.unknowns,
        }


FULL = (Wire(0.25, 0.1), Wire(0.25, 0.05), Wire(0.4, 0.1), Wire(0.4, 0.05))
QUICK = (Wire(0.4, 0.1),)


def main(
    quick: Annotated[bool, typer.Option("--quick", help="the thicker wire and the coarser mesh alone")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/wire"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Push wires of two radii through a block: the force against the toughness."""
    logging.basicConfig(level=logging.ERROR, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    summary = {}
    for wire in QUICK if quick else FULL:
        summary[wire.name] = wire.push(out / f"{wire.radius:g}_{wire.size:g}")
        if COMM.rank == 0:
            found = ", ".join(f"{name} {value:.5g}" for name, value in summary[wire.name].items())
            typer.echo(f"{wire.name}: {found}")
    write_summary(
        out / "summary.json", {**summary, "unknowns": max(found["unknowns"] for found in summary.values())}, COMM
    )


if __name__ == "__main__":
    typer.run(main)
