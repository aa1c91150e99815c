"""What stands beside fric in ``fric bench peers``: one file per task (a constant ``PEER``).

Those that need the graph or the command line are in :mod:`fric_nodes.peers`, found as a plugin's are.
"""
