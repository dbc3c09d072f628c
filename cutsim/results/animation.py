"""Animation of a run, and pictures of some of its stages, from what was recorded of it."""

import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cutsim.results.folder import GIF, MP4, STAGES
from cutsim.results.pictures import Look
from cutsim.results.stages import Stage, read_stages, spread

logger = logging.getLogger(__name__)

#: Pictures of stages, evenly spread over the run.
PICTURES = 4
# frames per second, and how often the last one is shown
_RATE, _LAST = 8, 8
# pixels per inch of a frame
_COARSE = 110


def draw_stages(folder: Path | str, number: int = PICTURES) -> list[Path]:
    """Draw some stages of a run, in one frame and with one range of colours.

    Args:
        folder: Folder of the run; the pictures are ``stages/00.png`` and so on in it.
        number: How many there are at most, the last stage among them.

    Returns:
        The pictures; fewer where there are fewer stages or they cannot be drawn, which is logged as a warning.
    """
    stages = [stage.whole() for stage in read_stages(folder)]
    for older in (Path(folder) / STAGES).glob("[0-9][0-9].png"):
        older.unlink()
    drawn: list[Path] = []
    try:
        for index, stage in enumerate(spread(stages, number)):
            path = Path(folder) / STAGES / f"{index:02d}.png"
            Look.of(stages).figure(stage).savefig(path)
            drawn.append(path)
    except Exception as error:  # a picture is never worth a run
        logger.warning("the stages in %s were not drawn: %s", folder, error)
    return drawn


def animate(folder: Path | str) -> list[Path]:
    """Draw the animation of a run from its stages, once as GIF and once as MP4.

    Args:
        folder: Folder of the run; the files are ``animation.gif`` and ``animation.mp4`` in it.

    Returns:
        The files; fewer than two where there are no two stages or a library is missing, which is logged as a warning.
    """
    stages, made = [stage.whole() for stage in read_stages(folder)], list[Path]()
    if len(stages) < 2:
        logger.warning("there is no animation: %s has fewer than two stages", Path(folder) / STAGES)
        return made
    try:
        frames = list(_frames(stages))
    except Exception as error:  # a picture is never worth a run
        logger.warning("there is no animation: %s", error)
        return made
    frames += [frames[-1]] * _LAST
    formats: dict[str, dict[str, Any]] = {
        GIF: {"duration": 1000 // _RATE, "loop": 0},
        MP4: {"fps": _RATE, "macro_block_size": 2, "quality": 7},
    }
    for name, options in formats.items():
        try:
            imageio.imwrite(Path(folder) / name, frames, **options)
            made.append(Path(folder) / name)
        except Exception as error:
            logger.warning("%s was not written: %s", name, error)
    return made


def _frames(stages: Sequence[Stage]) -> Iterator[NDArray[np.uint8]]:
    look = Look.of(stages)
    for stage in stages:
        yield _pixels(look.figure(stage, dpi=_COARSE))


def _pixels(figure: Figure) -> NDArray[np.uint8]:
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]
