"""What is done with each recording: one verb per file, found by its constant ``TASK``."""
