"""A host with a trust file, and drives of signers that it trusts or not."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator
from pathlib import Path

from tests.kit.host import LAMP, HostInProcess, host_in_process
from tests.kit.payloads import Part, make_payload, seal
from tests.kit.signing import Key, sign_payload, signed, trust_of

from nondum.host.core.events.drives import DriveRead
from nondum.host.manager.install_options import InstallOptions
from nondum.host.manager.payload_trust import TrustOptions
from nondum.wheelhouse.trust.succession import SignedFile
from nondum.wheelhouse.trust.trust import Trust

LAMP_ID = "org.example.lamp"
ROOT, ALICE, BOB, MALLORY = Key("root"), Key("alice"), Key("bob"), Key("mallory")
FIRST = trust_of(
    roots=[ROOT],
    roles={"maker": (["org.example"], [ALICE, BOB])},
    permissions=["network"],
    fleets=["survey"],
)


def lamp(drive: Path, *signers: Key, release: int = 1, manifest: str = "", text: str = "") -> Path:
    """A drive with a lamp, signed by some; with other `text` it is another lamp."""
    part = Part("lamp", source=LAMP + text, manifest=manifest)
    folder = make_payload(drive, part, payload_id=LAMP_ID, release=release)
    if signers:
        sign_payload(folder, *signers)
    return drive


def resealed(drive: Path, *signers: Key, release: int) -> Path:
    """The same drive with another release of the same lamp."""
    folder = drive / "nondum" / LAMP_ID
    (folder / "CONTENTS.sig").unlink()
    seal(folder, payload_id=LAMP_ID, release=release)
    sign_payload(folder, *signers)
    return drive


def with_trust(drive: Path, *files: SignedFile) -> Path:
    """Put trust files on a drive."""
    folder = drive / "nondum-trust"
    folder.mkdir(parents=True, exist_ok=True)
    for number, file in enumerate(files):
        (folder / f"{number}.toml").write_bytes(file.data)
        if file.signature is not None:
            (folder / f"{number}.toml.sig").write_bytes(file.signature)
    return drive


def enrol(root: Path, trust: Trust = FIRST) -> Path:
    """Put the first trust file where the host looks for it."""
    anchor = root / "etc/trust.toml"
    anchor.parent.mkdir(exist_ok=True)
    anchor.write_bytes(signed(trust).data)
    return anchor


@contextlib.asynccontextmanager
async def trusting(
    root: Path, trust: Trust | None = FIRST, *, stop: bool = True
) -> AsyncIterator[HostInProcess]:
    """A host that goes by a trust file, from the first time it runs under `root`."""
    anchor = root / "etc/trust.toml"
    if trust is not None and not anchor.exists():
        enrol(root, trust)
    options = InstallOptions(trust=TrustOptions(anchor, stop=stop))
    async with host_in_process(root, options=options) as host:
        yield host


async def refusal(host: HostInProcess) -> list[str]:
    """Codes of what a lamp is refused for, once it is."""

    def is_refused() -> bool:
        record = host.payload(LAMP_ID)
        return record is not None and record.step.value == "refused"

    await host.until(is_refused)
    record = host.payload(LAMP_ID)
    assert record is not None
    assert all(problem.fix for problem in record.problems)
    return [problem.code for problem in record.problems]


async def until_read(host: HostInProcess, drive: str = "a") -> None:
    """Wait until a drive was looked through."""
    await host.until(
        lambda: any(isinstance(e, DriveRead) and e.drive.endswith(drive) for e in host.heard)
    )
