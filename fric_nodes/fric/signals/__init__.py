"""What a recording's signals are like, asked by every room and answered once: resolution, noise, stamps, hold of the force."""
