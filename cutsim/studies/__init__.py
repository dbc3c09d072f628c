"""Studies: ready-made problems, such as an insertion, and the evaluation of their results."""
