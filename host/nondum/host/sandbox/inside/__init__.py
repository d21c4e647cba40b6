"""What runs in a worker's process before the plugin does. Nothing here needs more than Python.

Sandboxed workers see this folder and nothing else of the host, so it imports nothing else of it.
"""
