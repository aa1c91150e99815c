"""What ``import fric`` offers: recordings in, results out; each function does the whole of a task."""
