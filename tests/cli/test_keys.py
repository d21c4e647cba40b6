"""An owner's keys and trust file, from the first key to a robot that goes by it."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from tests.kit.beacon import BEACON, BEACON_ID
from tests.kit.command_line import at_terminal, nondum
from tests.kit.golden import Golden
from tests.kit.payloads import Part, make_payload
from tests.kit.running_host import running
from tests.kit.signing import MADE, Key

from nondum.host.trust.anchors import Origin
from nondum.wheelhouse.trust import editing, owners_folder, trust_file
from nondum.wheelhouse.trust.succession import successor

ALICE, BOB, CAROL = Key("alice"), Key("bob"), Key("carol")


@pytest.fixture
def owner(tmp_path: Path) -> Path:
    """A folder with keys and a trust file of which alice is the root."""
    for key in (ALICE, BOB, CAROL):
        key.write(tmp_path)
    known = [ALICE.trusted()]
    trust = editing.begun("survey", known, known, threshold=1, fleets=["survey"], made=MADE)
    owners_folder.create(tmp_path / "trust.toml", trust)
    return tmp_path


def test_a_trust_file_is_begun_and_not_begun_twice(owner: Path) -> None:
    trust, root = owner / "new.toml", owner / "alice.pub"
    begin = ("keys", "init", trust, "--owner", "survey", "--root", root, "--fleet", "survey")
    nondum(*begin).ok()
    assert owners_folder.parsed(trust).roles == owners_folder.parsed(owner / "trust.toml").roles
    nondum(*begin).refused(1, "TRUST_EXISTS")


def test_keys_are_those_of_ssh_keygen(tmp_path: Path) -> None:
    made = nondum("keys", "new", tmp_path / "alice", "--json").ok().json
    listed = subprocess.run(
        ["ssh-keygen", "-lf", tmp_path / "alice"], capture_output=True, check=True, text=True
    )
    assert made["fingerprint"] == listed.stdout.split()[1]
    assert (tmp_path / "alice").stat().st_mode & 0o777 == 0o600
    nondum("keys", "new", tmp_path / "alice").refused(1, "KEY_EXISTS")


def test_a_trust_file_says_who_must_sign_it(owner: Path, golden: Golden) -> None:
    trust = owner / "trust.toml"
    allowed = nondum("keys", "allow", trust, owner / "bob.pub", "--payloads", "com.acme").ok()
    golden.check_line("a trust file lacks a signature", allowed.out, file=trust)
    nondum("keys", "sign", trust, "--key", owner / "bob").refused(1, "KEY_NOT_ROOT")
    assert "signed" in nondum("keys", "sign", trust, "--key", owner / "alice").ok().out
    said = nondum("keys", "list", trust, "--json").ok().json
    assert (said["version"], said["fleets"]) == (1, ["survey"])
    assert [key["name"] for key in said["keys"]] == ["alice", "bob"]
    assert said["keys"][1]["fingerprint"] == BOB.public.fingerprint


def test_versions_that_were_signed_are_kept_and_followed(owner: Path) -> None:
    trust, alice = owner / "trust.toml", owner / "alice"
    nondum("keys", "sign", trust, "--key", alice).ok()
    nondum("keys", "allow", trust, owner / "bob.pub", "--payloads", "com.acme").ok()
    said = nondum("keys", "revoke", trust, "bob", "--why", "lost", "--json").ok().json
    assert said["version"] == 2, "two changes, and one version that robots see"
    nondum("keys", "sign", trust, "--key", alice).ok()
    said = nondum("keys", "rotate", trust, "alice", owner / "carol.pub", "--json").ok().json
    assert said["version"] == 3
    assert len(said["missing"]) == 2, "both the old roots and the new ones"
    nondum("keys", "sign", trust, "--key", alice).ok()
    said = nondum("keys", "sign", trust, "--key", owner / "carol", "--json").ok().json
    assert said["missing"] == []
    first, second, third = owners_folder.versions(trust)
    one = trust_file.parse_bytes(first.data, "")
    three = successor(successor(one, second), third)
    assert [root.key for root in three.roots.keys] == [CAROL.public]
    assert three.revoked[0].fingerprint == BOB.public.fingerprint


MISTAKES = {
    "no key": (("allow", "alice", "--payloads", "a.b"), "FILE"),
    "a file that is none": (("allow", "trust.toml", "--payloads", "a.b"), "FILE"),
    "an id that is none": (("allow", "bob.pub", "--payloads", "Acme"), "TRUST_VALUE"),
    "no permission": (
        ("allow", "bob.pub", "--payloads", "a.b", "--permission", "root"),
        "TRUST_VALUE",
    ),
    "a name that is taken": (
        ("allow", "bob.pub", "--payloads", "a.b", "--name", "alice"),
        "KEY_TAKEN",
    ),
    "no key of that name": (("revoke", "eve"), "KEY_UNKNOWN"),
    "the last root": (("revoke", "alice"), "ROOTS_TOO_FEW"),
    "no key to replace": (("rotate", "eve", "bob.pub"), "KEY_UNKNOWN"),
}


@pytest.mark.parametrize(("arguments", "code"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_change_nothing(owner: Path, arguments: tuple[str, ...], code: str) -> None:
    command, *rest = arguments
    trust = owner / "trust.toml"
    before = trust.read_bytes()
    files = [
        owner / word
        if word.endswith((".pub", ".toml", "alice")) and command == "allow" and word != "alice"
        else word
        for word in rest
    ]
    if command == "rotate":
        files[1] = owner / "bob.pub"
    nondum("keys", command, trust, *files).refused(1, code)
    assert trust.read_bytes() == before


def test_a_key_that_was_revoked_does_not_come_back(owner: Path) -> None:
    trust = owner / "trust.toml"
    nondum("keys", "revoke", trust, owner / "bob.pub").ok()
    nondum("keys", "allow", trust, owner / "bob.pub", "--payloads", "a.b").refused(1, "KEY_REVOKED")


def test_payloads_are_signed_by_many(owner: Path) -> None:
    drive = owner / "drive"
    make_payload(drive, Part("beacon", BEACON), payload_id=BEACON_ID)
    nondum("payload", "sign", drive, "--key", owner / "alice").ok()
    nondum("payload", "sign", drive, "--key", owner / "bob", "--key", owner / "alice").ok()
    (view,) = nondum("payload", "inspect", drive, "--json").ok().json["payloads"]
    assert view["signers"] == [BOB.public.fingerprint, ALICE.public.fingerprint]
    nondum("payload", "sign", drive, "--key", owner / "trust.toml").refused(1, "SSH_KEYGEN")


@pytest.mark.daemon
def test_a_host_is_given_its_trust_and_keeps_to_it(owner: Path, golden: Golden) -> None:
    trust, alice = owner / "trust.toml", owner / "alice"
    drive = owner / "drive"
    make_payload(drive, Part("beacon", BEACON), payload_id=BEACON_ID)
    with running(owner / "host", trust=owner / "etc/trust.toml") as host:
        begin = ("keys", "trust", trust, "--config", host.config)
        golden.check_line("the host trusts no key", host.run("status").ok().out)
        host.run("payload", "install", drive).refused(1, "SIG_MISSING")
        nondum("payload", "sign", drive, "--key", alice).ok()
        host.run("payload", "install", drive).refused(1, "SIG_UNTRUSTED")
        host.run(*begin, "--yes").refused(1, "TRUST_SIGNATURE")
        nondum("keys", "sign", trust, "--key", alice).ok()
        assert "version 1" in host.run(*begin, "--yes").ok().out
        host.run("payload", "install", drive).ok()
        view = host.run("status", "--json").ok().json
        assert view["trust"] == {"owner": "survey", "version": 1, "first": Origin.SIGNED.value}
        (row,) = view["payloads"]
        assert row["signers"] == ["alice"]
        assert row["built"]
        nondum("keys", "rotate", trust, "alice", owner / "carol.pub").ok()
        host.run("keys", "trust", trust).refused(1, "TRUST_SIGNATURE")
        nondum("keys", "sign", trust, "--key", alice).ok()
        nondum("keys", "sign", trust, "--key", owner / "carol").ok()
        assert "version 2" in host.run("keys", "trust", trust).ok().out
        shown = host.run("keys", "list").ok().out
        assert "carol" not in shown
        assert CAROL.public.fingerprint in shown
        assert Origin.SIGNED.value in shown
        assert host.run("keys", "list", "--json").ok().json["first"] == Origin.SIGNED.value


@pytest.mark.daemon
def test_a_carrier_of_the_first_trust_file_adds_no_key(owner: Path) -> None:
    """The genuine roots stay in it, so their fingerprints are the genuine ones."""
    trust, anchor = owner / "trust.toml", owner / "etc/trust.toml"
    nondum("keys", "sign", trust, "--key", owner / "alice").ok()
    carried = owner / "carried.toml"
    carried.write_bytes(trust.read_bytes())
    nondum("keys", "allow", carried, owner / "bob.pub", "--payloads", "org.example").ok()
    with running(owner / "host", trust=anchor) as host:
        begin = ("keys", "trust", carried, "--config", host.config, "--yes")
        host.run(*begin).refused(1, "TRUST_SIGNATURE")
        carried.with_name("carried.toml.sig").write_bytes((owner / "trust.toml.sig").read_bytes())
        host.run(*begin).refused(1, "TRUST_SIGNATURE")
        assert not anchor.exists()
        code, shown = at_terminal(
            "--control", host.control, "keys", "trust", trust, "--config", host.config, typed="n\n"
        )
        before, _, _ = shown.partition("?")
        assert code == 130
        for told in (ALICE.public.fingerprint, "role owner: * by 1 of alice; may have *"):
            assert told in before
        assert not anchor.exists()


@pytest.mark.daemon
def test_a_trust_file_is_written_where_the_callers_configuration_says(owner: Path) -> None:
    """Never where the daemon says, which may be an attacker's by now."""
    trust, theirs, ours = owner / "trust.toml", owner / "theirs/trust.toml", owner / "ours.toml"
    nondum("keys", "sign", trust, "--key", owner / "alice").ok()
    ours.write_text(f'[trust]\nfile = "{owner}/etc/trust.toml"\n')
    with running(owner / "host", trust=theirs) as host:
        host.run("keys", "trust", trust, "--config", ours, "--yes").refused(1, "TRUST_ELSEWHERE")
        assert not theirs.exists()
        assert not (owner / "etc").exists()
        theirs.parent.mkdir()
        theirs.parent.chmod(0o777)
        begin = ("keys", "trust", trust, "--config", host.config, "--yes")
        host.run(*begin).refused(1, "TRUST_OPEN_TO_OTHERS")
        assert not theirs.exists()
