"""All axes over time: what changed, what drifts, what differs from its twins, and which of it to look at first."""
