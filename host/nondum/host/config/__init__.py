"""The configuration file as people meet it: where each key stands, what it means, what holds."""
