"""What has happened on a host: frozen values in past tense, the only news that travels inside it.

Sources (drives, devices, workers, people) emit events; the component manager turns them into new
state and effects; executors report back with events again. An event that tells of recomposition
is journalled; those that only tell how the world looks, many a second, are not.
"""
