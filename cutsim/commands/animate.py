"""``cutsim animate``: the animation of a run."""

from __future__ import annotations

from cutsim.commands.options import console
from cutsim.commands.resume import FolderArgument

EXAMPLES = ("cutsim animate results/blade",)


def command(folder: FolderArgument) -> None:
    """Write the animation of a run as GIF and MP4 from the stages that it has left; also while it runs.

    Raises:
        FileNotFoundError: There are no stages.
    """
    from cutsim.results.animation import animate

    made = animate(folder)
    if not made:
        raise FileNotFoundError(f"{folder} has no animation: fewer than two stages of a run are in it")
    console().print(*(f"written: {path}" for path in made), sep="\n", markup=False)
