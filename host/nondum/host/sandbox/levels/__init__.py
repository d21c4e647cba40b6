"""Confinement: what a worker's process cannot reach, and how that is known.

`nondum.wheelhouse.format.confinement` names the levels, `workers/confinement_probe.py` tries them
out, `config/confinement_level.py` tells what was found; `bubblewrap.py`, `landlock.py` and
`refusals.py` say what is asked of the kernel. What is done inside the process is in
`nondum.host.sandbox.inside`; `workers/launcher.py` puts both together.
"""
