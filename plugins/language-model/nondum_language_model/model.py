"""A language model in GGUF, run by llama.cpp in this process."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import xllamacpp

from nondum.sdk.errors import BehaviourFailed, ConfigRefused, Problem
from nondum_language_model.settings import Settings

_SOCKET = "llama.sock"


class Model:
    """Answers with JSON of a schema. Not for several threads at once."""

    def __init__(self, weights: Path, settings: Settings, folder: Path) -> None:
        """Load `weights`; takes its time. llama.cpp always listens somewhere: in `folder`, not at a
        port of the host. Raises `ConfigRefused` (WEIGHTS_UNREADABLE)."""
        self._settings = settings
        parameters = xllamacpp.CommonParams()
        parameters.model.path = str(weights)
        parameters.n_ctx = settings.context_tokens
        parameters.n_parallel = 1
        # Threads that spin while they wait for each other stand still where others need the
        # processor: 11 s for 0.2 s of work on two that were busy.
        threads = settings.threads or max(1, len(os.sched_getaffinity(0)) - 1)
        for share in (parameters.cpuparams, parameters.cpuparams_batch):
            share.n_threads, share.poll = threads, 0
        parameters.warmup = parameters.ui = parameters.endpoint_slots = False
        parameters.verbosity = -1
        socket = folder / _SOCKET
        socket.unlink(missing_ok=True)
        # Relative: the address of a socket has 107 bytes.
        parameters.hostnames = [os.path.relpath(socket)]
        try:
            self._server = xllamacpp.Server(parameters)
        except RuntimeError as error:
            raise _refused(str(weights), str(error)) from error

    def answer(self, instructions: str, words: str, schema: Mapping[str, Any]) -> str:
        """What it says to a person's words: JSON of `schema`, but for one that ignores it.

        Raises `BehaviourFailed`: MODEL_OVERDUE when it takes too long, MODEL_REFUSED where
        llama.cpp does, as of more words than fit into the context.
        """
        said: list[str] = []
        refused: list[str] = []
        until = time.monotonic() + self._settings.seconds

        def is_enough(part: Mapping[str, Any]) -> bool:
            if "error" in part:
                refused.append(str(part["error"].get("message", part["error"])))
            for choice in part.get("choices", ()):
                said.append(choice["delta"].get("content") or "")
            return time.monotonic() > until

        form = {"name": "goal", "strict": True, "schema": dict(schema)}
        asked = {
            "messages": [
                {"role": "system", "content": instructions},
                {"role": "user", "content": words},
            ],
            "response_format": {"type": "json_schema", "json_schema": form},
            "max_tokens": self._settings.answer_tokens,
            "temperature": 0,
            "stream": True,
        }
        self._server.handle_chat_completions(asked, is_enough)
        if refused:
            raise BehaviourFailed(f"llama.cpp: {refused[0]}", code="MODEL_REFUSED")
        if time.monotonic() > until:
            raise BehaviourFailed(
                f"no answer within {self._settings.seconds:g} s", code="MODEL_OVERDUE"
            )
        return "".join(said)


def _refused(where: str, why: str) -> ConfigRefused:
    fix = "put a model in GGUF that llama.cpp can read on the drive, and one that fits the memory"
    return ConfigRefused(Problem("WEIGHTS_UNREADABLE", why, where=where, fix=fix))
