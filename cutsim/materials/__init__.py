"""Materials: strain energies of solids, each a frozen dataclass of its parameters."""
