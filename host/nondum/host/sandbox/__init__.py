"""Confinement of workers: levels, mounts, system-call filters, cgroups and the root helper."""
