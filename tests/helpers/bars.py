"""A bar with a bond in its middle, which snaps back when the bond breaks."""

from dataclasses import dataclass

import numpy as np
from dolfinx import mesh
from mpi4py import MPI

from cutsim import (
    Attachment,
    Bilinear,
    Crack,
    Exponential,
    LinearElastic,
    Mechanics,
    PathFollowing,
    RigidLink,
    State,
    StepControl,
    Support,
    Traction,
    cracked_space,
    run,
)
from helpers.blocks import Blocks

WIDTH = 0.1  # of a bar of unit length, so narrow that it cannot break on one side first
SOFT = 1.5  # Young's modulus at which it snaps back when the bond breaks
BONDS = {
    "exponential": Exponential(strength=1.0, toughness=0.2),
    "bilinear": Bilinear(20.0, 1.0, 0.2, 1.0, 0.2),
}
FINE = PathFollowing(facets=0.03, onset=0.03)


@dataclass
class Bar:
    """A bar with a bond in its middle, whose end is moved by t, or pulled by the traction t."""

    blocks: Blocks
    crack: Crack
    mechanics: Mechanics

    @classmethod
    def build(
        cls, law=BONDS["exponential"], *, pulled=False, linked=False, corners=(), terms=(), comm=MPI.COMM_WORLD, **body
    ):
        b = narrow(comm)
        crack = b.crack(law, young=SOFT, normal="reference")
        terms = [b.solid(LinearElastic(SOFT, 0.0), **body), crack, *(make(b) for make in terms)]
        supports = [Support(b.state, b.face(*at), axis) for at, axis in (((1, 0.0), 1), ((0, 0.0), 0), ((0, WIDTH), 0))]
        top = b.face(1, 1.0)
        if pulled:
            terms.append(Traction(b.state, top, (0.0, 1.0), lambda t: t, name="pull"))
        elif linked:
            motion = {"x": 0.0, "y": lambda t: t, "rz": 0.0}
            terms.append(RigidLink(b.state, [Attachment(top, "y")], (0.0, 1.0), motion=motion))
        else:
            supports.append(Support(b.state, top, 1, lambda t: t, name="top", corners=corners))
        return cls(b, crack, Mechanics(b.state, terms, supports))

    @property
    def state(self):
        return self.blocks.state

    def run(self, until, path=FINE, stop=lambda _: False, step=0.05, **control):
        """Times, openings, tractions of the bond at them, and the reports of the accepted steps."""
        rows = []

        def record(report):
            opening = self.crack.points.maximum(self.crack.point_values("opening"))
            rows.append((report.time, opening, traction(self.crack.law, opening), report))

        run(self.mechanics, until, StepControl(step, step, path=path, **control), record, stop)
        return (*map(np.array, list(zip(*rows, strict=True))[:3]), [row[3] for row in rows])


def narrow(comm):
    """Two halves of a bar of four cells, with the bond between them."""
    corners, ghosts = [(0.0, 0.0), (WIDTH, 1.0)], mesh.GhostMode.shared_facet
    domain = mesh.create_rectangle(comm, corners, [1, 4], mesh.CellType.quadrilateral, ghost_mode=ghosts)
    facets = mesh.locate_entities(domain, 1, lambda x: np.isclose(x[1], 0.5))
    lower, upper = (
        mesh.locate_entities(domain, 2, lambda x, sign=sign: sign * (x[1] - 0.5) > -1e-9) for sign in (-1, 1)
    )
    return Blocks(State(cracked_space(domain, ("Lagrange", 1, (2,)), facets)), facets, lower, upper)


def traction(law, opening):
    """Traction of a law on the way to an opening."""
    return float(law.secants(np.array([opening]), np.zeros(1))[0][0]) * opening
