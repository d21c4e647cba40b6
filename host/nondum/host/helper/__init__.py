"""The root helper: a small process with a handful of fixed verbs, for a daemon that is not root."""

from nondum.host.helper.client import HelperClient
from nondum.host.helper.privileged import InProcess, Privileged, Unprivileged, privileged

__all__ = ["HelperClient", "InProcess", "Privileged", "Unprivileged", "privileged"]
