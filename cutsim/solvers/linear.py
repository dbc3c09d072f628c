"""Linear solver of a problem: the preset that fits it, and a more robust one when it fails."""

from petsc4py import PETSc

from cutsim.base.log import collective_logger
from cutsim.base.machine import memory_per_rank
from cutsim.base.options import Options
from cutsim.solvers.preconditioners import LaggedPC, Preset, fallback_for, preset_for
from cutsim.solvers.strips import create_lagged
from cutsim.solvers.system import System

log = collective_logger(__name__)

#: Part of a rank's memory that a kept factor may take; mesh, matrices and vectors need some, too.
FACTOR_SHARE = 0.6


#: The presets in words.
DESCRIPTIONS = {
    "native": "a factorisation without pivots, kept while it serves",
    "direct": "a factorisation, kept while it serves",
    "bulk": "multigrid",
    "factor": "a kept factor, and an exact one of the strip along the crack",
    "crack": "multigrid, and an exact factor of the strip along the crack",
    "saddle": "multigrid, and elimination of the multipliers",
}


class LinearSolver:
    """Krylov method and preconditioner of a SNES, unless the options of the user say what to use. Collective.

    Args:
        snes: The solver that uses it.
        options: Options of the user, which win over those of the presets.
        system: The equations.

    Attributes:
        preconditioner: The preconditioner of the preset; None if the user's options name one.
    """

    def __init__(self, snes: PETSc.SNES, options: Options, system: System) -> None:
        self._snes, self._options, self._system = snes, options, system
        self.preconditioner: LaggedPC | None = None
        self._preset: Preset | None = None
        if "pc_type" not in options and "ksp_type" not in options:
            self._install(self._fitting())

    @property
    def name(self) -> str:
        """Name of the preset in use, empty if the user's options name a preconditioner."""
        return "" if self._preset is None else self._preset.name

    @property
    def description(self) -> str:
        """The preset in use in words, with the memory that a kept factor is expected to need."""
        if self._preset is None or self.preconditioner is None:
            return "as the PETSc options say"
        memory = self.preconditioner.memory
        return DESCRIPTIONS[self.name] + (f", {memory:.0f} MB on a rank" if memory else "")

    def use(self, name: str) -> None:
        """Use the preset of this `name`, which a problem of the same kind has come to."""
        preset = self._preset
        while preset is not None and preset.name != name:
            preset = self._fallback(preset)
        if preset is not None and preset.name != self.name:
            self._install(preset)

    def observe(self) -> None:
        """Take note of a linear solve that met its tolerance."""
        if self.preconditioner is not None:
            self.preconditioner.observe(self._snes.getKSP().getIterationNumber())

    def forget_pattern(self) -> None:
        """What was factorised is of no use for a matrix with another sparsity pattern."""
        if self.preconditioner is None:
            self._snes.getKSP().reset()
        else:
            self.preconditioner.refresh(pattern=True)

    def improve(self) -> bool:
        """After a failed solve: rebuild the preconditioner, or else factorise; False if neither is left."""
        if self._preset is None or self.preconditioner is None or not self._system.tangent.finite:
            return False
        was_fresh = self.preconditioner.fresh
        self.preconditioner.refresh()
        if not was_fresh:  # it was made for an older tangent; one made for this tangent may do
            return True
        fallback = self._fallback(self._preset)
        if fallback is None:
            return False
        trouble = self.preconditioner.trouble
        log.warning("Linear solver %r failed%s: %r from now on", self.name, trouble and f", {trouble}", fallback.name)
        self._install(fallback)
        return True

    def _fitting(self) -> Preset:
        """The preset for the size and kind of the system."""
        system, structure = self._system, self._system.structure
        return preset_for(
            system.size,
            structure.symmetric,
            system.comm.size,
            structure.interface_dofs is not None,
            system.V.mesh.geometry.dim,
            saddle_point=bool(structure.multipliers or structure.borders),
            memory=FACTOR_SHARE * memory_per_rank(system.comm),
        )

    def _fallback(self, failed: Preset) -> Preset | None:
        """What to use where a preset has failed."""
        system = self._system
        return fallback_for(failed, system.size, system.structure.symmetric, system.comm.size)

    def _install(self, preset: Preset) -> None:
        self._preset = preset
        self._options.default(preset.ksp)
        self._options.default(preset.kept, preset.name + "_")
        self._options.default(preset.strip, "strip_")
        structure = self._system.structure
        self.preconditioner = create_lagged(
            preset, self._options.prefix, self._system.V, structure.interface_dofs, structure.symmetric
        )
        pc = self._snes.getKSP().getPC()
        pc.setType(PETSc.PC.Type.PYTHON)
        pc.setPythonContext(self.preconditioner)
