"""One target in a separate process under atheris.

`python -m tests.fuzz.guided TARGET CASES DIR SECONDS`: it ends after CASES cases or SECONDS
seconds (0: no limit of time).

DIR/corpus keeps what reached new code, DIR/report.json says how it went, DIR/crash-… holds an input
that broke a rule.
"""

from __future__ import annotations

import atexit
import json
import resource
import sys
import time
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["nondum", "packaging"]):
    from tests.fuzz.targets import TARGETS
    from tests.fuzz.trial import MOST_BYTES, tried

REPORT_EVERY = 2000


class Fuzzing:
    """Counts what is tried."""

    def __init__(self, name: str, report: Path) -> None:
        self.target = next(target for target in TARGETS if target.name == name)
        self.codes: set[str] = set()
        self.inputs, self.longest_s = 0, 0.0
        self._report, self._begun = report, time.monotonic()
        self._base = _peak_bytes()

    def one(self, data: bytes) -> None:
        """Try an input; raises what must not be."""
        trial = tried(self.target, data)
        self.inputs += 1
        self.codes.add(trial.refused)
        self.longest_s = max(self.longest_s, trial.cpu_s)
        if not trial.is_within_bounds or _peak_bytes() - self._base > MOST_BYTES:
            raise AssertionError(f"out of bounds: {trial}")
        if self.inputs % REPORT_EVERY == 0:
            self.write()

    def write(self) -> None:
        """Keep how it goes; libFuzzer ends the process by itself."""
        told = {
            "inputs": self.inputs,
            "codes": len(self.codes - {""}),
            "longest_ms": self.longest_s * 1000,
            "grown_mb": (_peak_bytes() - self._base) / 1024**2,
            "seconds": time.monotonic() - self._begun,
        }
        self._report.write_text(json.dumps(told))


def _peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def main(name: str, cases: int, folder: Path, seconds: int) -> None:
    """Fuzz; does not return."""
    corpus = folder / "corpus"
    corpus.mkdir(exist_ok=True)
    fuzzing = Fuzzing(name, folder / "report.json")
    seeds = [*fuzzing.target.seeds(), *fuzzing.target.refused()]
    for number, seed in enumerate(seeds):
        (corpus / f"seed-{number}").write_bytes(seed)
    words = folder / "tokens"  # libFuzzer refuses a dictionary without a word
    lines = ("".join(f"\\x{byte:02x}" for byte in token) for token in fuzzing.target.tokens)
    words.write_text("".join(f'"{line}"\n' for line in lines))
    atexit.register(fuzzing.write)
    arguments = [
        *(sys.argv[0], str(corpus), f"-runs={cases}", f"-max_len={fuzzing.target.longest}"),
        *([f"-dict={words}"] if fuzzing.target.tokens else []),
        *(f"-artifact_prefix={folder}/", "-rss_limit_mb=2048", "-timeout=30"),
        f"-max_total_time={seconds}",
    ]
    atheris.Setup(arguments, fuzzing.one)
    atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]), int(sys.argv[4]))
