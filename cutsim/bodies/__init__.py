"""Terms of the bodies: strain energy, inertia, loads, supports."""
