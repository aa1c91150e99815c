"""What the benchmark ``compensation`` consists of: axes, methods, and their meeting."""
