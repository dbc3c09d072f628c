"""A rank of an MPI run; see cutsim/commands/rank.py."""

from cutsim.commands.rank import main

main()
