"""Online estimators: one per file, each with a constant ``ESTIMATOR``."""
