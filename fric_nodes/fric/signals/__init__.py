"""What a recording's signals are like, determined once for every room: resolution, noise, stamps, hold of the force."""
