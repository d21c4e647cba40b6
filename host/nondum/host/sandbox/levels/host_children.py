"""What the daemon's own children give up: the ones that read drives, search for plans and carry
streams between hosts. They run the host's code, but on what strangers wrote.

They end with the daemon, gain no privileges, and are refused the system calls that workers are;
files and network are theirs to use. Memory and descriptors are bounded by each itself.
"""

from __future__ import annotations

from collections.abc import Collection

from nondum.host.sandbox.inside import kernel
from nondum.host.sandbox.levels import refusals


def settle(daemon: int, *, keeps: Collection[str] = ()) -> None:
    """Give that up; `keeps` names groups of system calls that are needed (`refusals.GROUPS`).

    Call it first of all, while there is one thread. Raises `SystemExit` where the daemon has ended.
    """
    kernel.end_with(daemon)
    kernel.prctl(kernel.PR_SET_NO_NEW_PRIVS, 1)
    machine = refusals.machine()
    if refusals.is_known(machine):
        kernel.filter_calls(refusals.filter_of(refusals.GROUPS, machine, without=keeps))
