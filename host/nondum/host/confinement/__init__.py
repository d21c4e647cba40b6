"""Confinement: what a worker's process cannot reach, and how that is known.

`nondum.wheelhouse.confinement` names the levels, `probe.py` tries them out, `level.py` tells what
was found; `bubblewrap.py`, `landlock.py` and `refusals.py` say what is asked of the kernel. What is
done inside the process is in `nondum.host.inside`; `nondum.host.workers.launcher` puts both
together.
"""

from nondum.host.confinement.level import Finding, Standing

__all__ = ["Finding", "Standing"]
