"""The second demonstration: three hosts that share what is plugged into them, and lose one.

A robot, a compute node, and later a small robot. A person speaks to the node; the robot that can
searches with components of both; the node says aloud what was found; then it vanishes.
"""

from demo.search.three_hosts import main

__all__ = ["main"]
