"""A package as somebody else writes it: one member of every catalogue of fric, and no change to fric."""
