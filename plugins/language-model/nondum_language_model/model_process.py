"""The process that holds the model: `python -m nondum_language_model.model_process`.

llama.cpp is not given to the worker's own process: it holds the interpreter while it loads, minutes
on a slow card, and a crash of it would be the worker's. Requests come in by standard input and are
answered on standard output, one after the other, a line of JSON each; the first line says whether
the model could be loaded.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import xllamacpp

from nondum_language_model.settings import Settings

_SOCKET = "llama.sock"


def main() -> None:
    """Load, and answer until standard input ends."""
    out = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever else is printed

    def say(said: Mapping[str, Any]) -> None:
        out.write(f"{json.dumps(said)}\n")
        out.flush()

    weights, settings, folder = sys.argv[1:]
    try:
        model = _Model(Path(weights), Settings(**json.loads(settings)), Path(folder))
    except RuntimeError as error:
        say({"refused": str(error)})
        return
    say({})
    for line in sys.stdin:
        say(model.answer(**json.loads(line)))
    os._exit(0)  # llama.cpp's threads are not waited for


class _Model:
    def __init__(self, weights: Path, settings: Settings, folder: Path) -> None:
        """llama.cpp always listens somewhere: in `folder`, not at a port of the host. Raises
        `RuntimeError`."""
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
        self._server = xllamacpp.Server(parameters)

    def answer(self, instructions: str, words: str, schema: Mapping[str, Any]) -> dict[str, Any]:
        """`answer`: JSON of the schema, but for one that ignores it; or `refused`, why llama.cpp
        does, as of more words than fit into the context; or `is_overdue`."""
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
            return {"refused": refused[0]}
        if time.monotonic() > until:
            return {"is_overdue": True}
        return {"answer": "".join(said)}


if __name__ == "__main__":
    main()
