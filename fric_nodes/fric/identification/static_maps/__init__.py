"""Static maps: what a recording of slow or constant motion says without any dynamics, part by part."""
