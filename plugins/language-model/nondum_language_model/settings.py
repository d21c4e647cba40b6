"""What an integrator may set; see the README for each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Settings:
    """How the model that is shown is run."""

    threads: int = 0
    """Threads that llama.cpp may use; 0: one for each processor but one."""
    context_tokens: int = 4096
    """Of what can be said and of the answer together; each takes memory."""
    answer_tokens: int = 256
    """Of the answer: a longer one is cut, and not taken."""
    seconds: float = 9.0
    """For an answer, loading left out. The host waits `planning.translate_s`."""

    def __post_init__(self) -> None:
        if self.threads < 0 or self.answer_tokens < 32 or self.seconds <= 0:
            raise ValueError("threads must be at least 0, answer_tokens 32, seconds above 0")
        if self.context_tokens < 2 * self.answer_tokens:
            raise ValueError("context_tokens must be at least twice answer_tokens")
