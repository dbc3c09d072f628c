"""Bodies: strain energy, inertia, loads and supports."""
