"""Who is given what of which device: groups, composites, conflicts, late and doubled devices."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st
from tests.host.lifecycle.states import AT, component
from tests.host.sources.devices.sightings import camera_with_microphone, serial_adapter

from nondum.host.core import effects
from nondum.host.core.effects import Effect
from nondum.host.core.events.devices import DeviceAppeared, DeviceChanged, DeviceRemoved
from nondum.host.core.events.event import Event
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.device import DeviceClaim, DeviceRecord
from nondum.host.core.state import HostState
from nondum.host.lifecycle.advance import advance
from nondum.host.sources.devices.hardware import Part, devices
from nondum.host.sources.devices.matching import serving

VIDEO = {"subsystem": "video4linux"}
SOUND = {"interface": "audio"}
LINE = {"usb": "0403:6001"}


def needing(id: str, **needs: dict[str, str]) -> ComponentRecord:
    claims = tuple(DeviceClaim(name, match, False) for name, match in needs.items())
    return replace(component(id), devices=claims)


def host(*components: ComponentRecord) -> HostState:
    return HostState("spot", components={one.id: one for one in components})


def device(parts: list[Part]) -> DeviceRecord:
    (found,) = devices(parts).values()
    return found


def comes(found: DeviceRecord) -> DeviceAppeared:
    return DeviceAppeared(found.id, found)


def after(state: HostState, *happened: Event) -> tuple[HostState, list[Effect]]:
    """The state after all of it, and what the last of it had done."""
    done: list[Effect] = []
    for event in happened:
        state, did, _ = advance(state, event, AT)
        done = list(did)
    return state, done


def has(state: HostState, id: str) -> dict[str, tuple[str | None, list[str]]]:
    return {
        claim.name: (claim.device, [path.name for path in claim.nodes])
        for claim in state.components[id].devices
    }


CAMERA = device(camera_with_microphone())
LEFT = device(serial_adapter("1-1", "ttyUSB0", ID_SERIAL_SHORT="L"))
RIGHT = device(serial_adapter("1-3", "ttyUSB1", ID_SERIAL_SHORT="R"))


def test_nodes_of_a_device_come_together() -> None:
    state, done = after(host(needing("eye", camera=VIDEO)), comes(CAMERA))
    assert has(state, "eye") == {"camera": ("usb:1-2", ["video0", "video1"])}
    assert done == [effects.AttachDevice("eye", "camera", CAMERA.nodes[:2])]


def test_functions_of_a_composite_device_go_to_who_needs_each() -> None:
    state, _ = after(host(needing("audio", mic=SOUND), needing("eye", camera=VIDEO)), comes(CAMERA))
    assert has(state, "audio") == {"mic": ("usb:1-2", ["controlC1", "pcmC1D0c"])}
    assert has(state, "eye") == {"camera": ("usb:1-2", ["video0", "video1"])}
    assert not state.components["eye"].devices[0].contested_by


def test_need_is_given_the_whole_group_or_nothing() -> None:
    """Who comes first has video only; what asks for video and sound cannot have half of it."""
    both = needing("theatre", all={"usb": "046d:0825"})
    state, _ = after(host(needing("eye", camera=VIDEO), both), comes(CAMERA))
    assert has(state, "theatre") == {"all": (None, [])}
    assert state.components["eye"].devices[0].contested_by == ("theatre",)


def test_device_of_which_drivers_come_one_by_one_is_granted_as_they_do() -> None:
    parts = camera_with_microphone()
    early = device(parts[:4])
    state, done = after(host(needing("eye", camera=VIDEO)), comes(device(parts[:1])))
    assert not done
    state, done = after(state, DeviceChanged(early.id, early))
    assert has(state, "eye") == {"camera": ("usb:1-2", ["video0"])}
    state, done = after(state, DeviceChanged(CAMERA.id, CAMERA))
    assert done == [effects.AttachDevice("eye", "camera", CAMERA.nodes[:2])]
    state, done = after(state, DeviceChanged(early.id, early))
    assert done == [effects.AttachDevice("eye", "camera", early.nodes[:1])]
    without = device(parts[:3])
    state, done = after(state, DeviceChanged(without.id, without))
    assert done == [effects.DetachDevice("eye", "camera", "usb:1-2")]


def test_of_two_alike_one_is_taken_and_the_other_steps_in() -> None:
    state, _ = after(host(needing("gauge", line=LINE)), comes(RIGHT), comes(LEFT))
    assert has(state, "gauge")["line"][0] == "usb:1-3"
    state, done = after(state, DeviceRemoved("usb:1-3"))
    assert has(state, "gauge")["line"][0] == "usb:1-1"
    assert [type(effect) for effect in done] == [effects.DetachDevice, effects.AttachDevice]


def test_of_two_alike_the_first_port_goes_first() -> None:
    state = replace(host(), devices={one.id: one for one in (LEFT, RIGHT)})
    state = replace(state, components=host(needing("gauge", line=LINE)).components)
    state, _ = after(state, comes(CAMERA))
    assert has(state, "gauge")["line"][0] == "usb:1-1"


def test_two_needs_of_one_kind_get_one_each_and_keep_it() -> None:
    both = needing("stereo", left=LINE, right=LINE)
    state, _ = after(host(both), comes(LEFT), comes(RIGHT))
    assert [claim.device for claim in state.components["stereo"].devices] == ["usb:1-1", "usb:1-3"]
    state, _ = after(state, DeviceRemoved("usb:1-1"))
    assert [claim.device for claim in state.components["stereo"].devices] == [None, "usb:1-3"]


def test_device_that_moves_is_the_same_and_goes_to_who_had_it() -> None:
    moved = device(serial_adapter("1-4.2", "ttyUSB5", ID_SERIAL_SHORT="L"))
    state, _ = after(host(needing("gauge", line=LINE)), comes(LEFT))
    state, _ = after(state, DeviceRemoved(LEFT.id), comes(moved))
    assert has(state, "gauge") == {"line": ("usb:1-4.2", ["ttyUSB5"])}
    (known,) = state.known_devices.values()
    assert (known.identity, known.device) == ("usb 0403:6001 L", "usb:1-4.2")
    assert len({one.identity for one in (LEFT, moved)}) == 1


def test_device_that_no_component_needs_is_only_known() -> None:
    state, done = after(host(needing("eye", camera=VIDEO)), comes(LEFT))
    assert not done
    assert LEFT.id in state.devices


NEEDS = [needing("a", x=VIDEO), needing("b", x=SOUND, y=LINE), needing("c", x=LINE, y={})]
EVENTS: list[Event] = [
    *(comes(one) for one in (CAMERA, LEFT, RIGHT)),
    *(DeviceRemoved(one.id) for one in (CAMERA, LEFT, RIGHT)),
    *(DeviceChanged(CAMERA.id, device(camera_with_microphone()[:n])) for n in (1, 4, 6, 7)),
]


@given(st.lists(st.sampled_from(EVENTS), max_size=25))
def test_whatever_happens_no_node_has_two_owners_and_none_is_given_without_need(
    happened: list[Event],
) -> None:
    state = host(*NEEDS)
    for event in happened:
        state, _ = after(state, event)
        claims = [claim for one in state.components.values() for claim in one.devices]
        given_out = [path for claim in claims for path in claim.nodes]
        assert len(given_out) == len(set(given_out))
        for claim in claims:
            assert bool(claim.nodes) == (claim.device is not None)
            if claim.device is not None:
                fitting = serving(state.devices[claim.device], claim.match)
                assert set(claim.nodes) <= {node.node for node in fitting}
