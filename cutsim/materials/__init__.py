"""Strain energies of solids: a frozen dataclass of parameters each."""
