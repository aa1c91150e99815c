"""Nodes of the graph, one executable each."""
