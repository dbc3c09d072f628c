"""Large sliding between two surfaces with different meshes (docs/theory.md §3.5; thesis 4.28–4.57)."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.checks import positive, require, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.memory import Memory
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.fields.faces import Face, mean_size, rows
from cutsim.fields.sizes import facet_size, largest_extent, normal_size
from cutsim.fields.state import State
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.doubts import doubt_law, doubt_penetration
from cutsim.interface.rubbing import AnyFriction, check_friction, completed
from cutsim.pairs.bond_fields import BondFields
from cutsim.pairs.material_partners import MaterialPartners
from cutsim.pairs.outer_surface import OuterSurface, SharedSurface, SlaveSurface
from cutsim.pairs.pair_law import PairLaws
from cutsim.pairs.partners import CurrentPartners, PairKinematics
from cutsim.pairs.segments import SegmentPoints
from cutsim.pairs.surface_pass import SurfacePass, slave_points

_AXES = "xyz"

#: A surface: local exterior facets, ghosts included, or faces of cuts, or parts of both kinds.
Parts = NDArray[np.int32] | Face | Sequence[NDArray[np.int32] | Face]


class SurfacePair(Term):
    """Contact, friction and cohesion between two surfaces, or of one with itself; their meshes need not match.

    The traction is integrated over the slave surface, by parts of its facets that face one facet of the master each in
    the reference configuration.  In two passes each surface is slave once, with half of the traction.  A surface that
    meets itself is slave and master, with half of the traction at each of its points.

    Args:
        state: Displacement, of degree 1 or 2, and time.
        slave_facets: The slave surface, the finer or softer one: local exterior facets, ghosts included, a face of a
            crack (`Crack.face`) or of an open cut (`cutsim.fields.faces.Face.cut`), or a sequence of these.
        master_facets: The master surface; None for a surface that may fold and meet itself.
        law: Cohesive law of a bond between the points that face each other in the reference configuration, wherever
            they slide; None for contact only.
        young: Young's modulus of the softer body, for the automatic penalty [stress].
        contact: Contact law; by default a penalty of 10 E/h.
        friction: Friction, a friction law, or the coefficient of Coulomb's, None for none.
        small_sliding: Whether contact and friction, too, act between the points that face each other in the reference
            configuration. Otherwise their partners are found in the current configuration.
        allowed_penetration: If given, Uzawa augmentation until no facet penetrates more than this, in the mean
            [length].
        two_pass: Whether each surface is slave once; one that meets itself always is.
        search: Largest distance of a partner, on either side [length]; by default the mean size of the slave facets.
            Points that lie in the other body from the start, or come into it in a step, find theirs at any depth.
        name: Name in messages and output.

    Attributes:
        passes: Each part of the slave against the master, and with two passes the other way round.
        signs: For each pass 1 if its points are on the slave surface, −1 if on the master.
        folding: Whether the surface meets itself.
        sides: Slave and master surface.
        closed_elsewhere: Local facets of cuts whose faces another term presses on each other (`Face.closing`).
        entities: Rows (cell, local facet), flattened, of the facets of both surfaces on this rank.
        contact: The contact law.
        normal_size: Mean size of the cells normal to the slave surface, the h of the penalty [length].

    Raises:
        ValueError: A parameter is outside its range, a surface has no facets, a side of a facet is there twice,
            points lie in the other body from the start without facing its surface, or no point of a bond has a partner.
    """

    symmetric = False

    @checked
    def __init__(
        self,
        state: State,
        slave_facets: Parts,
        master_facets: Parts | None = None,
        law: CohesiveLaw | None = None,
        *,
        young: float,
        contact: PenaltyContact | None = None,
        friction: AnyFriction = None,
        allowed_penetration: float | None = None,
        small_sliding: bool = False,
        two_pass: bool = False,
        search: float | None = None,
        name: str = "pair",
    ) -> None:
        require_number("young", young, positive)
        check_friction("friction", friction)
        require_number("allowed_penetration", allowed_penetration, positive.or_none)
        require_number("search", search, positive.or_none)
        self.folding = master_facets is None
        lasting = self.folding and small_sliding
        require("small_sliding", small_sliding, not lasting, "False for a surface that meets itself")
        require("law", law, law is None or not self.folding, "None for a surface that meets itself")
        self.name, self.state, self.law = name, state, law
        slaves = _faces(state, slave_facets, "slave_facets")
        masters = [] if master_facets is None else _faces(state, master_facets, "master_facets")
        _check_apart(state, [*slaves, *masters])
        size = mean_size(state.mesh, slaves, facet_size)
        self.normal_size = mean_size(state.mesh, slaves, normal_size)
        self.contact = contact or PenaltyContact.automatic(young, self.normal_size)
        if law is not None:
            doubt_law(state.verdict, name, law, young, size, largest_extent(state.mesh))
        laws = PairLaws(law, self.contact, completed(friction, self.contact.stiffness), allowed_penetration)
        self.sides = Face.joined(slaves), Face.joined(masters or slaves)
        self.closed_elsewhere = self.sides[0].facets[self.sides[0].cuts > 0]
        owned = state.mesh.topology.index_map(state.mesh.topology.dim).size_local
        self.entities = rows([*slaves, *masters], owned).ravel()
        back = masters if two_pass else []
        self.signs = (1,) * len(slaves) + (-1,) * len(back)
        shared = [SharedSurface(OuterSurface(state.V, side)) for side in (self.sides if back else self.sides[1:])]
        self.passes = tuple(
            self._pass(i, face, shared[-1 if i < len(slaves) else 0], laws, small_sliding, search or size)
            for i, face in enumerate((*slaves, *back))
        )
        if law is not None:
            bonded = sum(p.points.integral(p.bonded) for p in self.passes)
            require("search", search or size, bonded > 0, "as large as the gap that the law bonds: it has no partners")

    def _pass(
        self, i: int, face: Face, master: SharedSurface, laws: PairLaws, small_sliding: bool, search: float
    ) -> SurfacePass:
        """A part of one surface over all of the other one. Collective."""
        state, name = self.state, f"{self.name} pass {i + 1}"
        named = "slave_facets" if self.signs[i] > 0 else "master_facets"
        # what a surface is going to meet, once it folds, is not what is near it now
        divided = partial(SegmentPoints, master=master, search=search, sliding=not small_sliding)
        points = (slave_points if self.folding else divided)(state, face, named)
        surfaces = SlaveSurface(state.V, face, points), master
        lengths, bonds = (search, mean_size(state.mesh, [face], facet_size)), (laws.cohesive is not None, small_sliding)
        kinematics = _partners(state.memory, name, surfaces, lengths, bonds, folding=self.folding)
        weight = 0.5 if self.folding or -1 in self.signs else 1.0
        return SurfacePass(state, name, points, kinematics, laws, weight=weight)

    @property
    def facets(self) -> Sequence[NDArray[np.int32]]:
        """Local facets of slave and master, ghosts included."""
        return [side.facets for side in self.sides]

    @property
    def facet_energy(self) -> float:
        """Energy that breaks a facet of mean size in opening; 0 without a law."""
        points = self.passes[0].points
        return self.law.toughness * points.mean(points.weights.sum(axis=1)) if self.law is not None else 0.0

    def residual(self, v: Expr) -> ufl.Form:
        """No form: all forces are those of the passes."""
        return ufl.Form([])

    @property
    def companions(self) -> Sequence[Term]:
        """The fields of the bond, on each part of the slave."""
        slaves = [p for p, sign in zip(self.passes, self.signs, strict=True) if sign > 0] if self.law else []
        names = [f"{self.name}_bond{i + 1 if len(slaves) > 1 else ''}" for i in range(len(slaves))]
        return [BondFields(n, p.points, p.history.point_values) for n, p in zip(names, slaves, strict=True)]

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

    @property
    def viscous_work(self) -> float:
        """Work of the viscosity of the bond up to the trial state [energy]."""
        return self.energies().get("cohesive_viscous", 0.0)

    def rate_forces(self) -> NDArray[np.float64] | None:
        """Forces of the viscosity of the bond, owned entries. Collective."""
        forces = [f for p in self.passes if (f := p.rate_forces()) is not None]
        return np.sum(forces, axis=0) if forces else None

    def path_measure(self) -> tuple[float, NDArray[np.float64]]:
        """What the bond loses in the step, see `cutsim.base.terms.Dissipating`. Collective."""
        losses, slopes = zip(*(p.path_measure() for p in self.passes), strict=True)
        return sum(losses), np.sum(slopes, axis=0)

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step; 0 without a law. Collective."""
        return 0.0 if self.law is None else max(p.history.damage_increment() for p in self.passes)

    def force(self) -> NDArray[np.float64]:
        """Force on the slave surface in the trial state, each pass counted with its share [force].

        That on a surface which meets itself is balanced: what is left of it says how unlike the two sides are.
        """
        return np.asarray(sum(p.force * sign for p, sign in zip(self.passes, self.signs, strict=True)))

    def penetration(self) -> float:
        """Largest penetration of a point over the normal mesh size. Collective."""
        depth = max(p.points.maximum(-p.history.trial["opening"]) for p in self.passes)
        return max(depth, 0.0) / self.normal_size

    def watch(self) -> None:
        """Doubt surfaces that lie deep in each other. Collective."""
        doubt_penetration(self.state.verdict, self.name, self.penetration(), self.contact.blend / self.normal_size)

    def diagnose(self) -> str | None:
        """Say how deep the surfaces penetrate, and whether any point has a partner at all. Collective."""
        return f"{self.name}: largest penetration {self.penetration():.3g} of the mesh size in the last accepted state"

    def record(self) -> dict[str, tuple[float, str]]:
        """Force on the slave, pressed area, penetration, areas that stick and slip, broken area. Collective."""
        return _columns(self)


def _columns(pair: SurfacePair) -> dict[str, tuple[float, str]]:
    """Columns of the history of a pair. Collective."""
    name, kind = pair.name, pair.state.facet_measure
    slaves = [p for p, sign in zip(pair.passes, pair.signs, strict=True) if sign > 0]
    # of a surface that meets itself two sides of what is pressed are slaves
    share = 0.5 if pair.folding else 1.0
    columns = {}
    if not pair.folding:
        columns = {f"{name}_force_{a}": (float(f), "force") for a, f in zip(_AXES, pair.force(), strict=False)}
    pressed = sum(p.points.integral((p.history.trial["pressure"] > 0).astype(float)) for p in slaves)
    columns[f"{name}_pressed"] = (share * pressed, kind)
    columns[f"{name}_penetration"] = (pair.penetration(), "one")
    areas = [p.slip.areas() for p in slaves if p.slip is not None]
    for what, parts in zip(("sticking", "slipping"), zip(*areas, strict=True), strict=False):
        columns[f"{name}_{what}"] = (share * sum(parts), kind)
    if pair.law is not None:
        broken = sum(p.points.integral(p.history.trial["damage"]) for p in slaves)
        columns[f"{name}_broken"] = (share * broken, kind)
    return columns


def _partners(
    memory: Memory,
    name: str,
    surfaces: tuple[SlaveSurface, SharedSurface],
    lengths: tuple[float, float],
    bonds: tuple[bool, bool],
    *,
    folding: bool,
) -> list[PairKinematics]:
    """What finds the partners of contact, then those of a bond where they are others. Collective."""
    (search, size), (bonded, small_sliding) = lengths, bonds
    found: list[PairKinematics] = []
    if not small_sliding:
        found.append(CurrentPartners(memory, name, *surfaces, search=search, size=size, folding=folding))
    if small_sliding or bonded:
        found.append(MaterialPartners(memory, f"{name} bond", *surfaces, search=search, size=size))
    return found


def _faces(state: State, given: Parts, name: str) -> list[Face]:
    """The faces of a surface, the parameter of a name. Collective."""
    parts = [given] if isinstance(given, np.ndarray | Face) else list(given)
    require(name, given, bool(parts), "facets, a face, or a sequence of these that is not empty")
    faces = [part if isinstance(part, Face) else Face.outer(state.mesh, part, name) for part in parts]
    empty = [i for i, face in enumerate(faces) if not state.mesh.comm.allreduce(len(face.facets))]
    require(name, given, not empty, "surfaces that have facets")
    return faces


def _check_apart(state: State, faces: Sequence[Face]) -> None:
    """Refuse surfaces that share a side of a facet, which would meet itself. Collective."""
    sides = rows(faces, state.mesh.topology.index_map(state.mesh.topology.dim).size_local)
    twice = state.mesh.comm.allreduce(len(sides) - len(np.unique(sides, axis=0)))
    require("slave_facets", f"{twice} facets", twice == 0, "no facet of master_facets, and none twice")
