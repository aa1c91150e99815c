"""What stands beside fric in ``fric bench peers`` and needs the graph or the command line; found as a plugin's is."""
