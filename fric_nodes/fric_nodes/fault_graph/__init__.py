"""Faults injected into the running graph: separate processes over the real middleware, judged at the drive."""
