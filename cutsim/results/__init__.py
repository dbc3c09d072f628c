"""What a run shows and leaves behind: progress, history, fields, figures."""
