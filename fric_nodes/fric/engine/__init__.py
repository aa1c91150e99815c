"""The engine: from a model's structure to compiled loops, and the exact mechanics that every plant shares."""
