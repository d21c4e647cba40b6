"""Workers: the processes that run plugins, from launch to the end of their last child."""

from nondum.host.workers.call import Call
from nondum.host.workers.launcher import Launcher, WorkerLauncher
from nondum.host.workers.leftovers import end_leftovers
from nondum.host.workers.logs import LogLine, Logs
from nondum.host.workers.spec import Limits, Timing, WorkerSpec, base_interpreter
from nondum.host.workers.workers import Workers

__all__ = [
    "Call",
    "Launcher",
    "Limits",
    "LogLine",
    "Logs",
    "Timing",
    "WorkerLauncher",
    "WorkerSpec",
    "Workers",
    "base_interpreter",
    "end_leftovers",
]
