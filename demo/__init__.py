"""The demonstration: one running host, rebuilt three times with payloads it has never seen.

It is an outsider: it plugs and pulls drives, gives goals and reads views as a person would, through
the host's command line and control socket, and imports nothing of nondum but the control client.
"""
