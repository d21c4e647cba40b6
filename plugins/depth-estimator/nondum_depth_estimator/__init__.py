"""Distances in images of one camera, by a network that the operator brings."""
