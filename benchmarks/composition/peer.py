"""Fast Downward's translator on the same text: it parses and grounds in Python, too."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

_PROGRAM = """
import contextlib, io, sys, time
from fast_downward.translate import instantiate, normalize, options, pddl_parser
options.set_options(sys.argv[1:3])
began = time.process_time()
with contextlib.redirect_stdout(io.StringIO()):
    task = pddl_parser.open(sys.argv[1], sys.argv[2])
    normalize.normalize(task)
    instantiate.explore(task)
print((time.process_time() - began) * 1000)
"""


def ground_ms(domain: str, problem: str) -> float:
    """Processor time of parsing and grounding, its imports left out. Needs the distribution
    `fast-downward-translate`."""
    with tempfile.TemporaryDirectory() as folder:
        paths = Path(folder, "domain.pddl"), Path(folder, "problem.pddl")
        for path, text in zip(paths, (domain, problem), strict=True):
            path.write_text(text, encoding="utf-8")
        done = subprocess.run(
            [sys.executable, "-c", _PROGRAM, *map(str, paths)],
            check=True,
            capture_output=True,
            text=True,
        )
    return float(done.stdout)
