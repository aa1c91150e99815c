"""Recordings with known faults, and without any, to see what the checks make of them."""
