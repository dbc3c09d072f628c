"""Check of a simulation before it is run: sizes, penalties, what it will need, and whether all is held."""

import resource
from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil
from time import perf_counter

import numpy as np
from mpi4py import MPI

from cutsim.analysis.staggered import ThermoMechanics
from cutsim.analysis.steps import begin
from cutsim.cases.building import Simulation
from cutsim.cases.sizes import element_sizes, group_area, kind_of_cells
from cutsim.fields.sizes import facet_size
from cutsim.interface.cohesive import process_zone_element
from cutsim.interface.crack import Crack
from cutsim.interface.doubts import DEEP
from cutsim.pairs.surface_pair import SurfacePair
from cutsim.solvers.iterations import Outcome
from cutsim.tools.tool_contact import ToolContact

# iterations of Newton's method in a step of usual difficulty
_USUAL = 5
# how far a step is taken, as a part of the run, if the first one needs no iteration
_SHARES = (0.1, 0.2, 0.4, 0.6)
# ends of kinds of doubt that are found here, with more numbers, or that mean nothing before a run
_FOUND = (": process zone", ": radius", ": untouched")
_KIBIBYTE, _MEGABYTE = 1024, 1e6


@dataclass(frozen=True)
class Finding:
    """Something that is found of a simulation.

    Attributes:
        topic: What it is about, such as "mesh" or "crack glue".
        what: What is found, in words.
        value: How much, with its unit.
        doubt: What speaks against it, in words; empty if nothing does.
    """

    topic: str
    what: str
    value: str
    doubt: str = ""


@dataclass(frozen=True)
class Check:
    """Check of a simulation.

    Attributes:
        rows: What is found.
    """

    rows: tuple[Finding, ...]

    @property
    def doubts(self) -> tuple[str, ...]:
        """What speaks against a run, in words."""
        return tuple(f"{row.topic}: {row.doubt}" for row in self.rows if row.doubt)


def check(simulation: Simulation) -> Check:
    """Check a simulation that has not been run; its first step is tried and given up, to measure its cost. Collective.

    Args:
        simulation: The simulation, which is not to be run afterwards.
    """
    found = [*_mesh(simulation), *_bodies(simulation), *_interfaces(simulation), *_tools(simulation)]
    found += [Finding("verdict", "so far", "questionable", words) for words in _further(simulation)]
    held = _held(simulation)
    found.append(held)
    return Check((*found, *(() if held.doubt else _cost(simulation))))


def _mesh(simulation: Simulation) -> Iterator[Finding]:
    mesh, units = simulation.domain.mesh, simulation.units
    tdim = mesh.topology.dim
    cells = mesh.topology.index_map(tdim).size_global
    yield Finding("mesh", kind_of_cells(simulation), str(cells))
    smallest, largest = element_sizes(mesh)
    yield Finding("mesh", "diameters of the elements", f"{smallest:.3g} to {largest:.3g} {units.of('length')}")
    kinds = {tdim: "cells", tdim - 1: "facets", 0: "vertices"}
    for (dim, name), entities in simulation.domain.groups.items():
        owned = entities < mesh.topology.index_map(dim).size_local
        number = mesh.comm.allreduce(int(np.count_nonzero(owned)))
        words = f"{number} {kinds.get(dim, 'entities')}"
        if dim == tdim - 1:
            kind, size = group_area(simulation, name)
            words += f", {kind} {size:.6g} {units.of(kind)}"
        yield Finding("groups", name, words)


def _bodies(simulation: Simulation) -> Iterator[Finding]:
    for solid in simulation.parts.solids:
        stiffness = f"{solid.material.young:.4g} {simulation.units.of('stress')}"
        yield Finding(f"body {solid.name}", f"Young's modulus of {type(solid.material).__name__}", stiffness)


def _interfaces(simulation: Simulation) -> Iterator[Finding]:
    length, stress = simulation.units.of("length"), simulation.units.of("stress")
    for term in (t for t in simulation.problem.terms if isinstance(t, Crack | SurfacePair)):
        name = f"{'crack' if isinstance(term, Crack) else 'pair'} {term.name}"
        contact, h, law = term.contact, term.normal_size, term.law
        yield Finding(name, "penalty of the contact", f"{contact.stiffness:.3g} {stress}/{length}")
        if isinstance(term, Crack) and law is not None:
            allowed = process_zone_element(law, term.young)
            words = f"{allowed:.3g} {length} or less is needed for the process zone" if term.size > allowed else ""
            yield Finding(name, "elements along it", f"{term.size:.3g} {length}", words)
        yield Finding(name, "elements across it", f"{h:.3g} {length}")


def _further(simulation: Simulation) -> Iterator[str]:
    """What speaks against the result already, beside what is found here."""
    for kind, words in simulation.problem.state.verdict.doubts.items():
        if not kind.endswith(_FOUND):
            yield words


def _tools(simulation: Simulation) -> Iterator[Finding]:
    for name, contacts in simulation.parts.tools.items():
        shaped = [tool for tool in contacts if isinstance(tool, ToolContact)]
        if shaped and np.isfinite(shaped[0].shape.resolution):
            yield _tool(f"tool {name}", shaped, simulation.units.of("length"))
        if shaped:
            yield _start(f"tool {name}", shaped)


def _tool(topic: str, contacts: list[ToolContact], length: str) -> Finding:
    """Whether the elements under a tool resolve its radius. Collective."""
    radius, mesh = contacts[0].shape.resolution, contacts[0].state.mesh
    points = [patch.surface.points for tool in contacts for patch in tool.patches]
    smallest = min(-p.maximum(-facet_size(mesh, p.facets)) for p in points)
    coarse = f"{radius:.3g} {length} or less is needed" if smallest > (1 + 1e-6) * radius else ""
    return Finding(topic, f"elements under its radius of {radius:.3g} {length}", f"{smallest:.3g} {length}", coarse)


def _start(topic: str, contacts: list[ToolContact]) -> Finding:
    """Whether a tool begins within the body, where it would push before it moves. Collective."""
    depth, blend = max(tool.penetration() for tool in contacts), contacts[0].blend
    words = "it lies in the body before it moves: let it begin farther away" if depth - blend > DEEP else ""
    return Finding(topic, "at the start, deepest point of the body in it", f"{max(depth, 0.0):.2g} elements", words)


def _held(simulation: Simulation) -> Finding:
    try:
        simulation.problem.check()
    except ValueError as error:
        return Finding("supports", "rigid motions", "free", str(error))
    return Finding("supports", "rigid motions", "none: every body is held")


def _cost(simulation: Simulation) -> Iterator[Finding]:
    """Time and memory, measured on a step that needs iterations. Collective."""
    comm = simulation.problem.state.mesh.comm
    end, outcome, seconds = _tried(simulation)
    memory = comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _KIBIBYTE / _MEGABYTE)
    control = simulation.control
    steps = ceil(simulation.until / getattr(control, "largest", control.first))
    one = seconds / max(outcome.iterations, 1)
    problem = simulation.problem
    mechanics = problem.mechanics if isinstance(problem, ThermoMechanics) else problem
    yield Finding("cost", "unknowns", str(simulation.problem.state.unknowns))
    yield Finding("cost", "linear solver", mechanics.problem.linear_solver)
    yield Finding("cost", f"a step to time {end:.3g}", f"{seconds:.2g} s, {outcome.iterations} iterations")
    yield Finding("cost", "memory of all ranks so far", f"{memory:.0f} MB")
    yield Finding("cost", "steps, if none is cut", str(steps))
    yield Finding("cost", f"time of these at {_USUAL} iterations each", _duration(one * _USUAL * steps))


def _tried(simulation: Simulation) -> tuple[float, Outcome, float]:
    """Time, outcome and duration [s] of a step that was given up: the first one, or a longer one that needs work."""
    problem = simulation.problem
    for end in (simulation.control.first, *(share * simulation.until for share in _SHARES)):
        begun = perf_counter()
        begin(problem, end)
        outcome = problem.solve()
        problem.state.rollback()
        if outcome.iterations:
            break
    return end, outcome, problem.state.mesh.comm.allreduce(perf_counter() - begun, MPI.MAX)


def _duration(seconds: float) -> str:
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"about {seconds / size:.0f} {unit}"
    return f"about {seconds:.0f} s"
