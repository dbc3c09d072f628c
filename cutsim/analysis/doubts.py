"""What makes a step questionable whatever the terms are: the energy audit, and friction on a path back in time."""

from collections.abc import Mapping

from cutsim.analysis.energy import EnergyAudit
from cutsim.base.log import collective_logger
from cutsim.base.verdict import CLOSURE, Verdict
from cutsim.fields.state import State

logger = collective_logger(__name__)

# growth of the turnover in a step from which on nothing is said aloud: the audit has just begun
_BEGUN = 2.0
# friction on the way back in time, over the turnover, that counts as none
_RUBBED = 1e-6
#: What a viscosity may take of the work that is done, and a brake of what is lost, without a word.
VISCOUS = 0.01
#: What the penalties of contacts may hold of the work that is done, without a word: a force is too small by up to twice
#: as much where a tool is driven apart from the body by them.
GIVING = 0.02


def doubt_audit(verdict: Verdict, before: EnergyAudit, after: EnergyAudit, viscous: float, cushion: float) -> None:
    """Doubt an audit that does not close, a viscosity that a load has to overcome, and contacts that give way.

    Args:
        verdict: The verdict.
        before: Audit at the start of a step ...
        after: ... and at its end.
        viscous: Work so far against what may only help the solver. What a body sets free when a crack runs by itself
            is not counted: some viscosity has to take it, and however small it is it takes as much [energy].
        cushion: What contacts hold at the end though surfaces do not give way by it: their pressure begins before they
            touch [energy].
    """
    verdict.withdraw("closure")
    if after.worst_closure > CLOSURE:
        words = f"{after.worst_closure:.1%} of the energy is missing in the audit: smaller steps are needed"
        verdict.suppose("closure", words, aloud=after.scale < _BEGUN * before.scale)
    verdict.withdraw("viscosity")
    if viscous > VISCOUS * after.scale:
        # in the first steps it may be much of it: what counts is how much it is in the end
        verdict.suppose("viscosity", f"the viscosity takes {viscous / after.scale:.1%} of the work that is done")
    verdict.withdraw("contact")
    held = after.entries["contact"] - cushion
    if held > GIVING * after.scale:
        words = f"contacts hold {held / after.scale:.1%} of the work that is done, and give way: firmer ones are needed"
        verdict.suppose("contact", words)


def doubt_distortions(verdict: Verdict, worst: Mapping[str, tuple[float, str]], scale: float) -> None:
    """Doubt elements that have lost their shape, if they have held as much energy as may be missing in the audit.

    Args:
        verdict: The verdict.
        worst: Kind of doubt → most strain energy so far, and words with a place for the ``{share}``.
        scale: Work that is done: the largest turnover of the audit [energy].
    """
    for kind, (energy, words) in worst.items():
        verdict.withdraw(kind)
        if energy > CLOSURE * scale:
            share = f"{energy / scale:.1%}" if scale > 0 else "all"  # nothing has been done yet
            verdict.suppose(kind, words.format(share=f"{share} of the work that is done"))


def warn_of_jump(carrier: str, entry: str, before: EnergyAudit, after: EnergyAudit, time: float) -> None:
    """Warn once of a carrier that takes part in what is lost: where a run jumps this is what the body sets free."""
    shares = [_share(audit, entry) for audit in (before, after)]
    if shares[0] <= VISCOUS < shares[1]:
        logger.warning(
            "the run jumps about time %.6g, where %s takes more than %.0f %% of the energy that is lost so far; "
            "see energy_%s",
            time,
            carrier,
            100 * VISCOUS,
            entry,
        )


def _share(audit: EnergyAudit, entry: str) -> float:
    taken = audit.entries[entry]
    lost = taken + audit.entries["fracture"] + audit.entries["friction"]
    return taken / lost if lost > 0 else 0.0


def doubt_way_back(state: State, before: EnergyAudit, after: EnergyAudit) -> None:
    """Doubt friction in a step back in time: no tool goes back when a bond breaks."""
    rubbed = after.entries["friction"] - before.entries["friction"]
    if state.time < state.time_old and rubbed > _RUBBED * after.scale:
        words = f"surfaces slide back at time {state.time:.6g}, where the path leads back in time: no real tool does so"
        state.verdict.doubt("way back", words)
