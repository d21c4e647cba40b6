"""What a plugin sees of its devices, of a host that tells of all nodes and of one that does not."""

from __future__ import annotations

import types

from nondum.sdk import Context, DeviceNeed, hookimpl
from nondum.sdk.bench import WorkerFactory
from nondum.sdk.workplace import Device, DeviceNode, Place


def plugin() -> types.SimpleNamespace:
    """Speaks the names of its device's nodes."""

    @hookimpl
    def devices() -> list[DeviceNeed]:
        return [DeviceNeed("eye", {"subsystem": "video4linux"})]

    @hookimpl
    async def speak(ctx: Context, text: str) -> None:
        device = ctx.device("eye")
        nodes = device.nodes if device else ()
        ctx.know("nodes", *(f"{node.node}:{node.subsystem}" for node in nodes))

    return types.SimpleNamespace(devices=devices, speak=speak)


def test_all_nodes_of_a_device_are_there(worker: WorkerFactory) -> None:
    bench = worker(plugin())
    kind = {"SUBSYSTEM": "video4linux"}
    bench.attach("eye", "/dev/nondum/eye", kind, ("/dev/nondum/eye.video1", kind))
    bench.ask("speak", text="")
    names = ("/dev/nondum/eye:video4linux", "/dev/nondum/eye.video1:video4linux")
    bench.wait_until(lambda: ("nodes", *names) in bench.facts, "both nodes")
    bench.detach("eye")
    bench.ask("speak", text="")
    bench.wait_until(lambda: ("nodes",) in bench.facts, "no nodes")


def test_host_of_an_older_version_tells_of_one_node_only() -> None:
    told = {"host": "h", "component": "c", "devices": {"eye": {"node": "/dev/x", "properties": {}}}}
    assert Place.from_wire(told).devices == {"eye": Device("/dev/x", {})}
    newer = {**told, "device_nodes": {"eye": [{"node": "/dev/x", "properties": {"A": "1"}}]}}
    (node,) = Place.from_wire(newer).devices["eye"].nodes
    assert node == DeviceNode("/dev/x", {"A": "1"})
