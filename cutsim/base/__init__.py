"""What all rests on: compiled forms, kinematics, checks, units, and what a term of the virtual work can do."""
