"""Who makes the payloads of the demonstrations, and is trusted by their robots: a key and a trust
file, made the first time that they are needed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from demo.robot import nondum

NAME = "demonstrations"


@dataclass(frozen=True, slots=True)
class Maker:
    """Use `at`."""

    key: Path
    """Its secret key; the public one lies beside it."""
    trust: Path
    """The trust file that robots are given before they are started."""

    @classmethod
    def at(cls, folder: Path) -> Maker:
        """The maker who keeps the key in a folder."""
        maker = cls(folder / "key", folder / "trust.toml")
        if not maker.trust.exists():
            if not maker.key.exists():
                nondum("keys", "new", maker.key)
            public = maker.key.with_name("key.pub")
            nondum("keys", "init", maker.trust, "--owner", NAME, "--root", public)
            maker.trust.chmod(0o644)  # whatever the umask: others must not be able to write it
        if not maker.trust_signature.exists():
            nondum("keys", "sign", maker.trust, "--key", maker.key)
        return maker

    @property
    def trust_signature(self) -> Path:
        """The signature of the trust file."""
        return self.trust.with_name("trust.toml.sig")

    @property
    def public(self) -> bytes:
        """The public key, as its file has it."""
        return self.key.with_name("key.pub").read_bytes()
