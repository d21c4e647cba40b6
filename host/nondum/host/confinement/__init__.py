"""Confinement: what a worker's process cannot reach, and how that is known.

`level.py` has the levels, `probe.py` tries them out, `bubblewrap.py`, `landlock.py` and
`seccomp.py` say what is asked of the kernel. What is done inside the process is in
`nondum.host.inside`; `nondum.host.workers.launcher` puts both together.
"""

from nondum.host.confinement.level import Finding, Level, Standing

__all__ = ["Finding", "Level", "Standing"]
