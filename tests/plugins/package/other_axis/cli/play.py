"""``fric play``: take the place of one of fric's own verbs, which must not happen."""
