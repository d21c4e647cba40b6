"""A recorded world for robots without one: a clip played to and fro as a panorama."""
