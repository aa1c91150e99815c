"""Whole friction laws of the literature, where they are more than one effect or a plain sum of effects."""
