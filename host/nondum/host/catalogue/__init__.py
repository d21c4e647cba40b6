"""The host's database of what it knows: payloads, components, devices, mounts, and the journal."""
