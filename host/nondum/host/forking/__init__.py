"""Processes that are forked from one that has imported what they need, and read nothing.

`fork_server.py` is that process, `fork_client.py` the daemon's end. One has the jobs and services,
another one the planners.
"""
