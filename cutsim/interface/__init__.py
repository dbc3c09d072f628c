"""Interface laws between two faces, for closing and opening, and the crack to which they apply."""
