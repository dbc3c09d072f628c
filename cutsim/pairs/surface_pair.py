"""Large sliding between two outer surfaces with different meshes (docs/theory.md §3.5; thesis 4.28–4.57)."""

from collections.abc import Sequence

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.checks import positive, require, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.fields.sizes import facet_size, normal_size
from cutsim.fields.state import State
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.doubts import doubt_law, doubt_penetration
from cutsim.interface.friction import FrictionLaw
from cutsim.interface.slip import check_friction, completed
from cutsim.pairs.outer_surface import SharedSurface, SlaveSurface
from cutsim.pairs.pair_law import PairLaws
from cutsim.pairs.partners import PairKinematics
from cutsim.pairs.surface_pass import SurfacePass, slave_points

_AXES = "xyz"


class SurfacePair(Term):
    """Contact, friction or cohesion between two outer surfaces; their meshes need not match.

    The traction is integrated over the slave surface.  In two passes each surface is slave once, with half of the
    traction: a uniform pressure is then transmitted almost uniformly.

    Args:
        state: Displacement, of degree 1 or 2, and time.
        slave_facets: Local exterior facets of the slave surface, ghosts included; the finer or softer one.
        master_facets: Those of the master surface.
        law: Cohesive law, with small sliding only; None for contact only.
        young: Young's modulus of the softer body, for the automatic penalty [stress].
        contact: Contact law; by default a penalty of 10 E/h.
        friction: Friction law, or the coefficient of Coulomb's, None for none; without a tangential penalty of its own
            it takes that of the contact.
        small_sliding: Whether each point keeps its partner of the reference configuration, as bonds do.
            Otherwise partners are found in the current configuration.
        allowed_penetration: If given, Uzawa augmentation until no facet penetrates more than this, in the mean
            [length].
        allowed_slip: If given, augmentation until no sticking facet slides more than this in a step, in the mean
            [length].
        two_pass: Whether each surface is slave once.
        search: Largest distance of a partner, on either side [length]; by default the mean size of the slave facets.
            Points that lie in the other body from the start, or come into it in a step, find theirs at any depth.
        name: Name in messages and output.

    Attributes:
        passes: The slave against the master, and with two passes the other way round.
        facets: Local facets of slave and master, ghosts included.
        entities: Rows (cell, local facet), flattened, of the facets of both surfaces on this rank.
        contact: The contact law.
        normal_size: Mean size of the cells normal to the slave surface, the h of the penalty [length].

    Raises:
        ValueError: A parameter is outside its range, a surface has no facets, both share a facet, or points lie in the
            other body from the start without facing its surface.
    """

    symmetric = False

    @checked
    def __init__(
        self,
        state: State,
        slave_facets: NDArray[np.int32],
        master_facets: NDArray[np.int32],
        law: CohesiveLaw | None = None,
        *,
        young: float,
        contact: PenaltyContact | None = None,
        friction: FrictionLaw | float | None = None,
        allowed_penetration: float | None = None,
        allowed_slip: float | None = None,
        small_sliding: bool = False,
        two_pass: bool = False,
        search: float | None = None,
        name: str = "pair",
    ) -> None:
        require_number("young", young, positive)
        check_friction("friction", friction)
        require_number("allowed_penetration", allowed_penetration, positive.or_none)
        require_number("allowed_slip", allowed_slip, positive.or_none)
        require_number("search", search, positive.or_none)
        require("small_sliding", small_sliding, small_sliding or law is None, "True with a cohesive law")
        shared = state.mesh.comm.allreduce(len(np.intersect1d(slave_facets, master_facets)))
        require("slave_facets", shared, shared == 0, "no facet of master_facets")
        self.name, self.state, self.law = name, state, law
        given = {"slave_facets": slave_facets, "master_facets": master_facets}
        measures = [state.measures.exterior(facets, parameter) for parameter, facets in given.items()]
        points = [slave_points(state, facets, ds) for facets, ds in zip(given.values(), measures, strict=True)]
        sizes = [p.mean(facet_size(state.mesh, p.facets)) for p in points]
        self.normal_size = points[0].mean(normal_size(state.mesh, points[0].facets))
        self.contact = contact or PenaltyContact.automatic(young, self.normal_size)
        if law is not None:
            doubt_law(state.verdict, name, law, young, sizes[0])
        rubbing = completed(friction, self.contact.stiffness) if friction else None
        laws = PairLaws(law, self.contact, rubbing, allowed_penetration, allowed_slip)
        surfaces = [SlaveSurface(state.V, p) for p in points]
        self.facets = tuple(p.facets for p in points)
        self.entities = np.concatenate([np.column_stack([s.cells, s.local])[s.owned].ravel() for s in surfaces])
        masters = [SharedSurface(s) for s in surfaces]
        self.passes = tuple(
            SurfacePass(
                state,
                f"{name} pass {i + 1}",
                points[i],
                PairKinematics(
                    state.memory,
                    f"{name} pass {i + 1}",
                    surfaces[i],
                    masters[1 - i],
                    small_sliding=small_sliding,
                    search=search or sizes[0],
                    size=sizes[i],
                ),
                laws,
                weight=0.5 if two_pass else 1.0,
            )
            for i in range(1 + two_pass)
        )

    @property
    def facet_energy(self) -> float:
        """Energy that breaks a facet of mean size in opening; 0 without a law."""
        points = self.passes[0].points
        return self.law.toughness * points.mean(points.weights.sum(axis=1)) if self.law is not None else 0.0

    def residual(self, v: Expr) -> ufl.Form:
        """No form: all forces are those of the passes."""
        return ufl.Form([])

    @property
    def assemblers(self) -> Sequence[SurfacePass]:
        """The passes."""
        return self.passes

    def begin(self) -> None:
        """The slide of the step counts from the committed displacement."""
        for p in self.passes:
            p.begin()

    def augment(self) -> bool:
        """Uzawa step where a facet penetrates, or slides while it sticks, by more than is allowed. Collective."""
        # every pass takes part: a list, because any() would stop at the first
        return any([p.augment() for p in self.passes])

    def evaluate(self) -> None:
        """Trial history, forces and work of the step. Collective."""
        for p in self.passes:
            p.evaluate()

    def energies(self) -> dict[str, float]:
        """Energy of the penalties, friction work, stored and dissipated work of the bond. Collective."""
        total: dict[str, float] = {}
        for p in self.passes:
            for entry, value in p.energies().items():
                total[entry] = total.get(entry, 0.0) + value
        return total

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""
        return max(p.history.damage_increment() for p in self.passes)

    def force(self) -> NDArray[np.float64]:
        """Force on the slave surface in the trial state, each pass counted with its share [force]."""
        return np.asarray(sum(p.force * sign for p, sign in zip(self.passes, (1.0, -1.0), strict=False)))

    def penetration(self) -> float:
        """Largest penetration of a point over the normal mesh size. Collective."""
        depth = max(p.points.maximum(-p.history.trial["opening"]) for p in self.passes)
        return max(depth, 0.0) / self.normal_size

    def watch(self) -> None:
        """Doubt surfaces that lie deep in each other. Collective."""
        blend = self.contact.blend / self.normal_size
        doubt_penetration(self.state.verdict, self.name, self.penetration(), blend)

    def diagnose(self) -> str | None:
        """Say how deep the surfaces penetrate, and whether any point has a partner at all. Collective."""
        return f"{self.name}: largest penetration {self.penetration():.3g} of the mesh size in the last accepted state"

    def record(self) -> dict[str, tuple[float, str]]:
        """Force on the slave, pressed area, penetration, areas that stick and slip, broken area. Collective."""
        kind = self.state.facet_measure
        first, name = self.passes[0], self.name
        pressed = first.history.trial["pressure"] > 0
        columns = {f"{name}_force_{a}": (float(f), "force") for a, f in zip(_AXES, self.force(), strict=False)}
        columns[f"{name}_pressed"] = (first.points.integral(pressed.astype(float)), kind)
        columns[f"{name}_penetration"] = (self.penetration(), "one")
        if first.slip is not None:
            areas = zip(("sticking", "slipping"), first.slip.areas(), strict=True)
            columns |= {f"{name}_{what}": (area, kind) for what, area in areas}
        if self.law is not None:
            columns[f"{name}_broken"] = (first.points.integral(first.history.trial["damage"]), kind)
        return columns
