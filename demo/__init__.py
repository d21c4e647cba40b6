"""Two demonstrations: one running host, rebuilt again and again with payloads it has never seen;
and three hosts that share what they are given (`search`).

They are outsiders: they plug and pull drives, give goals and read views as a person would, through
the host's command line and control socket. Of nondum they import the control client, messages to
listen to, what a fleet's owner does with its keys, and (to rename plugins) what the SDK and the
core vocabulary say.
"""
