"""What an integrator may set; see the README for each."""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import urlsplit


@dataclass(frozen=True, slots=True)
class Settings:
    """Which server is asked, and how."""

    url: str = ""
    """Up to where its paths begin, as `http://mule:8080/v1`; empty: none is asked."""
    model: str = ""
    """The model's name there; most servers of one model take any."""
    key: str = ""
    """What the server knows its clients by; empty: none."""
    authority: str = ""
    """PEM of the certificate that signs the server's, where it is not one of the system's."""
    answer_tokens: int = 256
    """Of the answer: a longer one is cut, and not taken."""
    seconds: float = 9.0
    """For an answer, all in all. The host waits `planning.translate_s`."""

    def __post_init__(self) -> None:
        if self.url and not _is_web(self.url):
            raise ValueError("url must begin with http:// or https:// and name a host, in ASCII")
        for name in ("key", "authority"):  # the message shows no value: it may be a secret
            value = getattr(self, name)
            if not value.isascii() or (name == "key" and not value.isprintable()):
                raise ValueError(f"{name} must be ASCII, a key in one line")
        if self.answer_tokens < 32 or self.seconds <= 0:
            raise ValueError("answer_tokens must be at least 32, seconds above 0")


def _is_web(url: str) -> bool:
    try:
        parts = urlsplit(url)
        if not url.isascii() or not url.isprintable() or " " in url:
            return False
        return parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:  # the port is no number
        return False
