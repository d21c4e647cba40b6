"""Payloads that are not at work here, as advice sees them: read, but nothing of them is run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from nondum.host.core.records.device import DeviceRecord
from nondum.host.mind.composition import component_facts
from nondum.host.sources.devices.matching import serving
from nondum.planning.explain.advise import Candidate
from nondum.planning.merge.claims import claims_of
from nondum.planning.merge.contribution import Contribution, object_name
from nondum.planning.pddl.facts import fact
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.payload import drive
from nondum.wheelhouse.payload.host_facts import HostFacts
from nondum.wheelhouse.payload.payload import StagedPayload, load
from nondum.wheelhouse.payload.preflight import preflight


@frozen
class Shelved:
    """A payload that is known of."""

    id: str
    version: str
    where: str
    """Where it is, for people."""
    components: Mapping[str, PluginDescription]
    caveats: tuple[Problem, ...] = ()


def on_shelf(folder: Path, facts: HostFacts | None) -> Iterator[Shelved | Problem]:
    """The payloads of a drive, of a folder of payloads or of drives, or of a payload's own folder.

    With `facts`, what keeps them from this machine are caveats. What cannot be read is a problem,
    and so is a folder without any.
    """
    folders = _folders(folder)
    if not folders:
        text, fix = "no payload was found there", "give a drive, or a folder of payloads or drives"
        yield Problem("DRIVE_NOT_PAYLOAD", text, where=str(folder), fix=fix)
    for found in folders:
        try:
            listed = contents.parse(drive.read_contents(found), f"{found.name}/{contents.NAME}")
            payload = load(found, listed)
        except NondumError as error:
            yield from (replace(p, where=f"{found}: {p.where}") for p in error.problems)
            continue
        caveats = _preflight(payload, facts) if facts else ()
        yield Shelved(listed.payload_id, listed.version, str(found), payload.index, caveats)


def _folders(folder: Path) -> Sequence[Path]:
    if (folder / contents.NAME).is_file():
        return (folder,)
    if found := drive.find_payloads(folder):
        return found
    if beside := sorted(path.parent for path in folder.glob(f"*/{contents.NAME}")):
        return beside
    drives = sorted(path.parent for path in folder.glob(f"*/{drive.FOLDER}"))
    return [payload for one in drives for payload in drive.find_payloads(one)]


def _preflight(payload: StagedPayload, facts: HostFacts) -> tuple[Problem, ...]:
    minimum = payload.contents.minimum_nondum
    return preflight(payload.manifest, payload.locks, facts, minimum_nondum=minimum)


def candidate_of(
    payload: Shelved, host: str, devices: Sequence[DeviceRecord] | None = None
) -> Candidate:
    """A payload as it would be on a host, its components healthy.

    Components whose fragments are wrong are left out, as planning leaves them out; caveats say why.
    Of required devices that are not among `devices` a caveat tells; None: it is not known which
    there are.
    """
    facts: set[str] = set()
    caveats = list(payload.caveats)
    sound: list[Contribution] = []
    for component, description in payload.components.items():
        brought = Contribution.from_description(description, host=host, component=component)
        if problems := claims_of(brought).problems:
            caveats += problems
            continue
        sound.append(brought)
        facts |= component_facts(host, component, description, is_ready=True).keys()
        facts.update(_flowing(host, component, description))
        if devices is not None:
            caveats += _missing_devices(component, description, devices)
    return Candidate(
        payload.id,
        payload.version,
        payload.where,
        tuple(sound),
        frozenset(facts),
        tuple(caveats),
    )


def _flowing(host: str, component: str, description: PluginDescription) -> Iterator[str]:
    """Streams that are always produced flow once the component is at work."""
    for unit in description.units:
        for output in unit.outputs:
            if output.always:
                yield fact("flowing", object_name(host, component, output.name))


def _missing_devices(
    component: str, description: PluginDescription, devices: Sequence[DeviceRecord]
) -> Iterator[Problem]:
    for need in description.devices:
        is_there = any(serving(device, need.match) for device in devices)
        if not is_there and not need.optional:
            wanted = ", ".join(f"{name}={pattern}" for name, pattern in need.match.items())
            message = f"{component} needs a device {need.name!r} that is not plugged in"
            yield Problem("DEVICE_MISSING", message, need=wanted, have="none")


def distinct(payloads: Iterable[Shelved]) -> tuple[Shelved, ...]:
    """Each payload in each version once, with all the places it was found at."""
    found: dict[tuple[str, str], Shelved] = {}
    for payload in payloads:
        known = found.get((payload.id, payload.version))
        if known is None:
            found[payload.id, payload.version] = payload
        elif payload.where not in known.where:
            where = f"{known.where}, {payload.where}"
            found[payload.id, payload.version] = replace(known, where=where)
    return tuple(found.values())
