"""A fleet of hosts that meet, by mesh and by way of a Zenoh router."""
