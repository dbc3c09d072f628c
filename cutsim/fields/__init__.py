"""Meshes, the cracked function space, and the fields on it with their trial and committed values."""
