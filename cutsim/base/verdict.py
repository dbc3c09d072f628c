"""Verdict on a result: whether it can be trusted, and the reasons against it."""

from cutsim.base.log import collective_logger
from cutsim.base.memory import Memory

logger = collective_logger(__name__)

#: Allowed gap of an audit of energy or heat, relative to its largest turnover.
CLOSURE = 0.02
#: Kind of doubt of a run that was interrupted before its end.
INTERRUPTED = "interrupted"


class Verdict:
    """Reasons against a result, collected during the run; a result without any is trusted.

    Whoever sees something wrong says so in words: this is warned of once, when it is first seen, and the worst case is
    kept.  Every rank has to say the same.

    Args:
        memory: Memory of the run, which keeps the reasons whether or not a step is accepted.
    """

    def __init__(self, memory: Memory) -> None:
        none: dict[str, tuple[float, str]] = {}
        self._reasons = memory.value("verdict: reasons", none)
        self._pending = memory.value("verdict: pending", dict[str, str]())
        self._warned: set[str] = set()

    def doubt(self, kind: str, words: str, measure: float = 0.0) -> None:
        """Say what makes the result questionable.

        Args:
            kind: What it is about, such as "crack: penetration"; warned of once each.
            words: The reason, with numbers.
            measure: How bad it is; of one kind the worst is kept.
        """
        self._warn(kind, words)
        known = self._reasons.committed.get(kind)
        if known is None or measure > known[0]:
            self._reasons.set(self._reasons.committed | {kind: (measure, words)})

    def suppose(self, kind: str, words: str, *, aloud: bool = False) -> None:
        """Say what makes the result questionable unless it is withdrawn before the end.

        Args:
            kind: What it is about.
            words: The reason, with numbers.
            aloud: Whether it is warned of, the first time.
        """
        if aloud:
            self._warn(kind, words)
        self._pending.set(self._pending.committed | {kind: words})

    def withdraw(self, kind: str) -> None:
        """Take back what was supposed; nothing happens if nothing was."""
        self._pending.set({k: words for k, words in self._pending.committed.items() if k != kind})

    def _warn(self, kind: str, words: str) -> None:
        if kind not in self._warned:
            logger.warning("%s", words)
            self._warned.add(kind)

    @property
    def doubts(self) -> dict[str, str]:
        """What speaks against the result: kind → reason, in the order in which it was seen."""
        return {kind: words for kind, (_, words) in self._reasons.committed.items()} | self._pending.committed

    @property
    def reasons(self) -> tuple[str, ...]:
        """What speaks against the result, in words."""
        return tuple(self.doubts.values())

    @property
    def trusted(self) -> bool:
        """Whether nothing speaks against the result."""
        return not self.reasons

    def record(self) -> dict[str, str | list[str]]:
        """The fields "verdict", "reasons" and their "kinds" of a summary."""
        verdict = "trusted" if self.trusted else "questionable"
        return {"verdict": verdict, "reasons": list(self.reasons), "kinds": list(self.doubts)}

    def __str__(self) -> str:
        return "trusted" if self.trusted else "questionable: " + "; ".join(self.reasons)
