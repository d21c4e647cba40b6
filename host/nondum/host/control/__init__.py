"""How people and tools talk to a running daemon: JSON lines over a local socket."""
