"""A Compton camera on a serial line: where the radiation comes from."""
