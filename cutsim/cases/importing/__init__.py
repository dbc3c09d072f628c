"""Models of other programs as cases."""
