"""Diagnosis: where a simulation and a recording differ, what physics is missing, and how sure that is."""
