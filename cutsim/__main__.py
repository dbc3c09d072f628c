"""The command `cutsim` as ``python -m cutsim``."""

from cutsim.commands.main import main

main()
