"""The checks of recordings: one fault of a recording per file, found by being here (a constant ``CHECK``)."""
