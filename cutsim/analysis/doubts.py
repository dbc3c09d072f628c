"""What makes a step questionable whatever the terms are: the energy audit, and friction on a path back in time."""

from cutsim.analysis.energy import EnergyAudit
from cutsim.base.verdict import CLOSURE, Verdict
from cutsim.fields.state import State

# growth of the turnover in a step from which on nothing is said aloud: the audit has just begun
_BEGUN = 2.0
# friction on the way back in time, over the turnover, that counts as none
_RUBBED = 1e-6
#: What a viscosity may take of the energy that is lost.
VISCOUS = 0.01


def doubt_audit(verdict: Verdict, before: EnergyAudit, after: EnergyAudit, viscous: float) -> None:
    """Doubt an audit that does not close, and a viscosity that takes part in what is lost.

    Args:
        verdict: The verdict.
        before: Audit at the start of a step ...
        after: ... and at its end.
        viscous: Work so far of what may only help the solver [energy].
    """
    verdict.withdraw("closure")
    if after.worst_closure > CLOSURE:
        words = f"{after.worst_closure:.1%} of the energy is missing in the audit: smaller steps are needed"
        verdict.suppose("closure", words, aloud=after.scale < _BEGUN * before.scale)
    lost = after.entries["fracture"] + after.entries["friction"]
    verdict.withdraw("viscosity")
    if lost > 0 and viscous > VISCOUS * (lost + viscous):
        # before anything breaks it is all of it: what counts is how much it is in the end
        share = viscous / (lost + viscous)
        verdict.suppose("viscosity", f"the viscosity takes {share:.1%} of the energy that is lost")


def doubt_way_back(state: State, before: EnergyAudit, after: EnergyAudit) -> None:
    """Doubt friction in a step back in time: no tool goes back when a bond breaks."""
    rubbed = after.entries["friction"] - before.entries["friction"]
    if state.time < state.time_old and rubbed > _RUBBED * after.scale:
        words = f"surfaces slide back at time {state.time:.6g}, where the path leads back in time: no real tool does so"
        state.verdict.doubt("way back", words)
