"""The demonstration: the whole loop on a simulated axis, as separate processes, with a page that shows what came of it."""
