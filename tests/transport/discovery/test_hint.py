"""What strangers announce becomes a hint, or nothing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.errors import ProtocolViolation
from nondum.sdk.wire_fields import MAX_ID
from nondum.transport.discovery import Announcement, Hint, Source
from nondum.transport.discovery.hint import from_txt, instance, to_txt
from nondum.transport.peers.identity import Security
from nondum.transport.peers.keys import HostKeys, PeerKey

KEY = HostKeys.generate().public
OTHER = HostKeys.generate().public
HERE = Announcement(KEY, "rover", 7, ("tcp://[::]:7410",))

names = st.from_regex(r"[a-z0-9]{1,8}(-[a-z0-9]{1,8}){0,3}", fullmatch=True)
ports = st.integers(1, 65_535)
numbers = st.integers(1, MAX_ID)
hosts = st.ip_addresses().map(str)


def read(txt: dict[str, str], *, port: int | None = 7410, near: tuple[str, ...] = ()) -> Hint:
    return from_txt(txt, port, near, source=Source.MULTICAST, security=Security.CURVE)


@given(
    st.builds(
        Announcement,
        st.just(KEY),
        names,
        numbers,
        ports.map(lambda port: (f"tcp://[::]:{port}",)),
        st.none() | ports,
        st.lists(numbers, min_size=1, max_size=16).map(tuple),
    )
)
def test_a_peer_reads_what_a_host_announces(here: Announcement) -> None:
    hint = read(to_txt(here), port=here.port, near=("10.77.0.2",))
    assert (hint.key, hint.name, hint.epoch) == (here.key, here.name, here.epoch)
    assert (hint.pairing_port, hint.versions) == (here.pairing_port, here.versions)
    assert hint.addresses == (f"tcp://10.77.0.2:{here.port}",)


@given(
    st.dictionaries(st.sampled_from(["id", "pk", "epoch", "proto", "pair", "x"]), st.text()),
    st.none() | st.integers(),
    st.lists(st.text() | hosts),
)
def test_anything_else_is_a_hint_or_a_violation(
    changes: dict[str, str], port: int | None, near: list[str]
) -> None:
    try:
        hint = read({**to_txt(HERE), **changes}, port=port, near=tuple(near))
    except ProtocolViolation as error:
        assert error.code in {"HINT_MALFORMED", "HINT_SECURITY"}
    else:
        assert hint.name.isascii() and len(hint.name) <= 63
        assert all(address.isascii() for address in hint.addresses)


@pytest.mark.parametrize(
    "changes",
    [
        {"pk": "~" * 40},
        {"pk": ""},
        {"id": ""},
        {"id": "\x1b[31mrover"},
        {"id": "r" * 64},
        {"epoch": "0"},
        {"epoch": "-1"},
        {"epoch": "٣"},
        {"epoch": str(2**60)},
        {"proto": ""},
        {"proto": ",".join("1" * 17)},
        {"pair": "70000"},
    ],
    ids=str,
)
def test_a_malformed_field_is_refused(changes: dict[str, str]) -> None:
    with pytest.raises(ProtocolViolation) as refused:
        read({**to_txt(HERE), **changes})
    assert refused.value.code == "HINT_MALFORMED"


def test_hosts_with_and_without_keys_have_nothing_to_say_to_each_other() -> None:
    without = to_txt(Announcement(PeerKey("development:rover"), "rover", 7, HERE.listening))
    with pytest.raises(ProtocolViolation, match="HINT_SECURITY"):
        read(without)
    with pytest.raises(ProtocolViolation, match="HINT_SECURITY"):
        from_txt(to_txt(HERE), 7410, [], source=Source.STATIC, security=Security.DEVELOPMENT)


def test_names_on_the_network_are_unique_and_tell_no_key() -> None:
    assert instance(KEY) != instance(OTHER)
    assert KEY not in instance(KEY)


def test_a_scope_stays_with_its_address() -> None:
    hint = read(to_txt(HERE), near=("fe80::1%lan0", "fe80::1%lan0", "no address", "10.0.0.1"))
    assert hint.addresses == ("tcp://[fe80::1%lan0]:7410", "tcp://10.0.0.1:7410")


@pytest.mark.parametrize("name", ["", "r" * 64, "\x1b[31mrover"], ids=["none", "long", "escape"])
def test_the_name_in_a_key_of_development_is_one(name: str) -> None:
    txt = {**to_txt(HERE), "pk": f"development:{name}"}
    with pytest.raises(ProtocolViolation) as refused:
        from_txt(txt, 7410, (), source=Source.STATIC, security=Security.DEVELOPMENT)
    assert refused.value.code == "HINT_MALFORMED"


class TestAnnouncement:
    def test_a_host_that_listens_by_name_does_not_listen_everywhere(self) -> None:
        assert not Announcement(KEY, "rover", 1, ("tcp://lan0:7410",)).is_everywhere

    def test_a_host_that_listens_everywhere_says_so(self) -> None:
        assert HERE.is_everywhere and not HERE.is_on_this_machine_only

    def test_only_addresses_with_the_first_port_are_announced(self) -> None:
        several = ("tcp://10.0.0.1:7410", "tcp://10.0.0.2:7411", "tcp://[::ffff:10.0.0.3]:7410")
        assert Announcement(KEY, "rover", 1, several).hosts == ("10.0.0.1", "10.0.0.3")

    def test_a_host_on_loopback_is_on_this_machine_only(self) -> None:
        here = Announcement(KEY, "rover", 1, ("tcp://127.0.0.1:7410", "tcp://[::1]:7410"))
        assert here.is_on_this_machine_only
