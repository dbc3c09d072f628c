"""Results of a run: progress, history, fields, figures."""
