"""Case put together: from tables to a problem that can be run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.staggered import ThermoMechanics
from cutsim.analysis.stepping import Recorder, run
from cutsim.analysis.steps import Control
from cutsim.base.kinematics import Expr
from cutsim.base.terms import Columns
from cutsim.base.units import Units
from cutsim.cases.bodies import solids
from cutsim.cases.document import Document
from cutsim.cases.domains import Domain
from cutsim.cases.heating import coupled, temperature
from cutsim.cases.holding import loads, supports
from cutsim.cases.insertions import inserted
from cutsim.cases.interfaces import cracks, pairs
from cutsim.cases.measures import columns_of, measures, tool_measures
from cutsim.cases.parts import Parts
from cutsim.cases.refusals import refused, refusing
from cutsim.cases.rigs import links
from cutsim.cases.schema import CaseTables
from cutsim.cases.tools import tools
from cutsim.cases.validation import validated
from cutsim.fields.meshing import TaggedMesh
from cutsim.results.field_files import Format
from cutsim.results.setup_picture import draw_setup
from cutsim.solvers.convergence import Tolerances
from cutsim.studies.insertion import Insertion


@dataclass(frozen=True)
class Simulation:
    """Simulation: a case put together, ready to run.

    Attributes:
        title: What is simulated, in a few words.
        units: Units of all numbers.
        domain: The mesh with its groups.
        problem: The problem.
        parts: Bodies, cracks, pairs and tools by name.
        until: Time at which the run ends [time].
        control: Step control.
        columns: Further columns of the history.
        derived: Further fields for output by name.
        curve: Columns of the history that tell most: abscissa and ordinate.
        mirror: Planes of symmetry through the origin, by the axes normal to them.
        every: Fields are written every so many steps.
        format: Format of their files.
        insertion: The insertion, if it is one.
    """

    title: str
    units: Units
    domain: TaggedMesh
    problem: Mechanics | ThermoMechanics
    parts: Parts
    until: float
    control: Control
    columns: Callable[[Columns], Columns]
    derived: Mapping[str, Expr]
    curve: tuple[str, str]
    mirror: tuple[str, ...] = ()
    every: int = 5
    format: Format | None = None
    insertion: Insertion | None = None

    @property
    def mechanics(self) -> Mechanics:
        """The mechanical problem."""
        return self.problem if isinstance(self.problem, Mechanics) else self.problem.mechanics

    def draw(self, path: Path | str) -> None:
        """Draw the set-up: mesh, cracks, tools where they begin, and what is held. Collective.

        Args:
            path: The PNG, PDF or SVG; folders are made.
        """
        draw_setup(path, self.problem, self.mechanics.supports, self.units)

    def run(self, record: Recorder) -> None:
        """Run to the end, from the committed time on. Collective.

        Args:
            record: Called on all ranks after each accepted step.

        Raises:
            Interrupted: A signal has ended the run.
            StepError: No step succeeds; says when, where and why.
        """
        run(self.problem, self.until, self.control, record)


def build(tables: CaseTables, document: Document, comm: MPI.Comm) -> Simulation:
    """Put a case together: mesh it and compile its forms. Collective.

    Args:
        tables: The case.
        document: Its text, for messages.
        comm: Communicator of the run.

    Raises:
        CaseError: On all ranks: a group is missing in the mesh, or parts do not fit.
    """
    domain = Domain.of(tables, document, comm)
    validated(CaseTables, document, domain.tagged.names)
    return _insertion(domain) if tables.insertion is not None else _general(domain)


def _insertion(domain: Domain) -> Simulation:
    """The ready-made problem."""
    table = domain.tables.insertion
    assert table is not None
    cut, value = inserted(domain, _mechanics_options(domain))
    parts = Parts(
        cut.body.solids,
        {crack.name: crack for crack in cut.body.cracks},
        tools={table.tool: cut.contacts},
    )
    problem = cut.mechanics if value is None else coupled(domain, cut.mechanics, parts, value)
    with refusing(domain.document, "insertion"):
        end = None if table.depth is None else cut.time_of(table.depth, table.push)
    found = measures(domain, parts)

    def columns(row: Columns) -> Columns:
        own = cut.columns(row)
        return own | columns_of(domain, found, {**row, **own})

    return _simulation(domain, problem, parts, end, columns, ("depth", "force"), _mirror(cut), cut)


def _mirror(cut: Insertion) -> tuple[str, ...]:
    """Planes of symmetry of an insertion into a part of a body, if axes are normal to them."""
    frame = cut.frame
    planes = [frame.normal] if cut.body.mirrored else []
    if cut.edge_factor == 2 and frame.edge is not None:
        planes.append(frame.edge)
    return tuple(axis for n in planes for axis, along in zip("xyz", n, strict=False) if abs(along) == 1)


def _general(domain: Domain) -> Simulation:
    """A problem of named parts."""
    state = domain.state()
    value = temperature(domain, state, domain.split)
    bodies = solids(domain, state, value)
    faces = cracks(domain, bodies, value)
    joined, rigid = pairs(domain, bodies, faces, value), tools(domain, bodies, faces, value)
    parts = Parts(bodies, faces, joined, {name: [tool] for name, tool in rigid.items()})
    touching = [*faces.values(), *joined.values(), *rigid.values()]
    terms = [*bodies, *touching, *links(domain, state, faces), *loads(domain, state, bodies)]
    held = supports(domain, state, faces)
    with refusing(domain.document):
        mechanics = Mechanics(state, terms, held, **_mechanics_options(domain))
    problem = mechanics if value is None else coupled(domain, mechanics, parts, value)
    found = measures(domain, parts)
    end = domain.tables.analysis.until
    found |= tool_measures(rigid, 1.0 if end is None else end)
    return _simulation(domain, problem, parts, None, partial(columns_of, domain, found), _curve(domain, rigid), ())


def _mechanics_options(domain: Domain) -> dict[str, Any]:
    analysis, solver = domain.tables.analysis, domain.tables.solver
    with refusing(domain.document, "solver"):
        tolerances = Tolerances(solver.rtol, solver.dtol, solver.etol)
    return {
        "analysis": analysis.type,
        "scheme": analysis.scheme,
        "mass": analysis.mass,
        "petsc_options": dict(solver.petsc),
        "tolerances": tolerances,
    }


def _simulation(
    domain: Domain,
    problem: Mechanics | ThermoMechanics,
    parts: Parts,
    end: float | None,
    columns: Callable[[Columns], Columns],
    curve: tuple[str, str],
    mirror: Sequence[str],
    cut: Insertion | None = None,
) -> Simulation:
    tables = domain.tables
    u = problem.state.u
    single = parts.solids[0] if len(parts.solids) == 1 else None
    derived = {"cauchy_stress": single.cauchy_stress(u)} if tables.output.stress and single is not None else {}
    return Simulation(
        title=tables.title,
        units=tables.units,
        domain=domain.tagged,
        problem=problem,
        parts=parts,
        until=_end(domain) if end is None else end,
        control=tables.steps,
        columns=columns,
        derived=derived,
        curve=tables.output.curve or curve,
        mirror=tuple(tables.output.mirror or mirror),
        every=tables.output.every,
        format=tables.output.format,
        insertion=cut,
    )


def _end(domain: Domain) -> float:
    until = domain.tables.analysis.until
    if until is None:
        raise refused(domain.document, ("analysis", "until"), "missing, must be given: the time at which the run ends")
    return until


def _curve(domain: Domain, rigid: Mapping[str, Any]) -> tuple[str, str]:
    """Columns that tell most of a problem of named parts: of its first tool, or of what moves first."""
    if rigid:
        name = next(iter(rigid))
        return f"{name}_travel", f"{name}_resistance"
    for name, table in domain.tables.supports.items():
        if table.value != 0.0:
            axis = "_x" if table.direction == "all" else ""
            return f"{name}{axis}_displacement", f"{name}{axis}_force"
    for name, link in domain.tables.links.items():
        for coordinate, value in link.motion.items():
            if value != 0.0:
                return f"{name}_{coordinate}", f"{name}_{coordinate}_{'moment' if coordinate[0] == 'r' else 'force'}"
    return "time", "work_external"
