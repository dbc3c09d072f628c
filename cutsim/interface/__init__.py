"""The law between two faces, closing and opening, and the crack that carries it."""
