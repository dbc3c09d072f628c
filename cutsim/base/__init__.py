"""Foundations: compiled forms, kinematics, checks, units, and the terms of the virtual work."""
