"""The root helper: a small process with a handful of fixed verbs, for a daemon that is not root."""

from nondum.host.sandbox.helper.client import HelperClient
from nondum.host.sandbox.helper.privileged import InProcess, Privileged, Unprivileged, privileged

__all__ = ["HelperClient", "InProcess", "Privileged", "Unprivileged", "privileged"]
