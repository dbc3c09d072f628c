"""Rigid tools: shapes, paths, and their contact with a body."""
