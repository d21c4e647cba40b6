"""One run: rounds in which every way is taken once, side by side, in changing order."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from benchmarks.recompose import image as images
from benchmarks.recompose import insertion
from benchmarks.recompose.image import Image
from benchmarks.recompose.payloads import CONTENT, Carried
from benchmarks.recompose.podman import Podman
from benchmarks.recompose.processes import await_calm, pss_mb
from benchmarks.recompose.results import FIRST, KNOWN, LOAD, START, Container, Findings

CALM_TIMEOUT_S = 30.0
Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Containers:
    """The container half: podman, and an image of each payload."""

    podman: Podman
    images: dict[str, Image]


def containers(payloads: Sequence[Carried], work: Path, say: Say) -> Containers:
    """Make the container half ready."""
    storage = work / "storage"
    podman = Podman(storage)
    made = {}
    for payload in payloads:
        say(f"image of the {payload.name} payload")
        folder = work / f"image-{payload.name}-{payload.digest}"
        folder.mkdir(exist_ok=True)
        made[payload.name] = images.build(
            payload.component, payload.module, payload.component, payload.wheels, folder, podman
        )
    return Containers(podman, made)


def measure(
    payloads: Sequence[Carried], half: Containers | None, rounds: int, work: Path, say: Say
) -> tuple[Findings, ...]:
    """Take every way with every payload in every round."""
    found = {payload.name: _begin(payload, half) for payload in payloads}
    for number in range(rounds):
        for payload in payloads:
            say(f"round {number + 1} of {rounds}, {payload.name} payload")
            ways = [partial(_insert, payload, found[payload.name], work / "host")]
            if half is not None:
                ways.append(partial(_contain, payload, found[payload.name], half))
            for way in ways if number % 2 else reversed(ways):
                way()
    return tuple(found.values())


def _begin(payload: Carried, half: Containers | None) -> Findings:
    findings = Findings(payload.name, CONTENT[payload.name])
    findings.bytes["payload"] = payload.bytes
    if half is not None:
        image = half.images[payload.name]
        findings.bytes["image, gzip -6"] = image.packed.stat().st_size
        findings.bytes["image"] = image.tar.stat().st_size
    return findings


def _insert(payload: Carried, findings: Findings, work: Path) -> None:
    shutil.rmtree(work, ignore_errors=True)
    with insertion.fresh_host(work) as robot:
        for way in (FIRST, KNOWN):
            _settle(findings)
            done = insertion.insert(robot, payload.drive, payload.component, payload.goal)
            findings.insertions.setdefault(way, []).append(done)
            if way == KNOWN:
                findings.memory.append(insertion.at_rest(robot, payload.component))
            insertion.remove(robot, payload.drive)


def _settle(findings: Findings) -> None:
    """What others have yet to write, or are doing, is not the burden of what comes next."""
    os.sync()
    findings.calm.append(await_calm(timeout_s=CALM_TIMEOUT_S))


def _contain(payload: Carried, findings: Findings, half: Containers) -> None:
    image = half.images[payload.name]
    for way in (LOAD, START):
        _settle(findings)
        began_s = time.monotonic()
        if way == LOAD:
            half.podman.load(image.tar)
        with half.podman.running(image.name) as container:
            findings.starts_s.setdefault(way, []).append(container.ready_s - began_s)
            if way == START:
                sizes = pss_mb(container.pid), pss_mb(container.conmon_pid)
                findings.containers.append(Container(*sizes))
    half.podman.forget(image.name)
