"""The demonstration: one running host, rebuilt again and again with payloads it has never seen.

It is an outsider: it plugs and pulls drives, gives goals and reads views as a person would, through
the host's command line and control socket. Of nondum it imports the control client, messages to
listen to, and (to rename plugins) what the SDK and the core vocabulary say.
"""
