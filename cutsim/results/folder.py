"""Names of what a run leaves in its folder."""

from pathlib import Path

#: Complete case.
CASE = "case.toml"
#: Rows of the accepted steps.
HISTORY = "history.csv"
#: Newton iterations of the accepted steps.
ITERATIONS = "iterations.csv"
#: Verdict and headline numbers.
SUMMARY = "summary.json"
#: Picture of the set-up.
SETUP = "setup.png"
#: Folder of the stages, with pictures of some of them.
STAGES = "stages"
#: Animations.
GIF, MP4 = "animation.gif", "animation.mp4"
#: Page with all of it, also that of a sweep.
REPORT = "report.html"
#: Folder of the checkpoints.
CHECKPOINTS = "checkpoint"


def has_checkpoint(folder: Path) -> bool:
    """Whether a run can be resumed in its folder."""
    return any((folder / CHECKPOINTS).glob("*.h5"))
