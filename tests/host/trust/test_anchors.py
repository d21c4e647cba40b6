"""The first trust file on a host's disk: who vouches for it, and where one is written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from tests.kit.golden import Golden
from tests.kit.signing import Key, signed, trust_of

from nondum.host.trust import anchors
from nondum.host.trust.anchors import Origin
from nondum.sdk.errors import TrustRefused
from nondum.wheelhouse.trust import sshsig, trust_file
from nondum.wheelhouse.trust.succession import SignedFile

ROOT, ALICE, MALLORY = Key("root"), Key("alice"), Key("mallory")
TRUST = trust_of(roots=[ROOT], roles={"maker": (["org.example"], [ALICE])})
FILE = signed(TRUST, ROOT)
IS_ROOT = os.geteuid() == 0
needs_root = pytest.mark.skipif(not IS_ROOT, reason="giving files away needs root")


@pytest.fixture
def etc(tmp_path: Path) -> Path:
    """A folder that only its owner can change."""
    folder = tmp_path / "etc"
    folder.mkdir(mode=0o755)
    return folder


@pytest.fixture
def anchor(etc: Path) -> Path:
    """A first trust file without signatures."""
    path = etc / "trust.toml"
    path.write_bytes(FILE.data)
    path.chmod(0o644)
    return path


def beside(anchor: Path) -> Path:
    return anchor.with_name("trust.toml.sig")


def refusal(anchor: Path) -> list[str]:
    with pytest.raises(TrustRefused) as refused:
        anchors.load(anchor)
    assert all(problem.fix for problem in refused.value.problems)
    return [problem.code for problem in refused.value.problems]


# Reading


def test_file_that_its_roots_have_signed_says_so(anchor: Path) -> None:
    beside(anchor).write_bytes(FILE.signature or b"")
    found = anchors.load(anchor)
    assert (found.trust, found.origin) == (TRUST, Origin.SIGNED)


def test_file_without_signatures_is_believed_and_says_who_placed_it(anchor: Path) -> None:
    found = anchors.load(anchor)
    assert (found.trust, found.origin) == (TRUST, Origin.ROOT if IS_ROOT else Origin.USER)


WRONG = {
    "of others": signed(TRUST, MALLORY).signature,
    "of another file": signed(trust_of(roots=[ROOT], version=2), ROOT).signature,
    "for payloads": signed(TRUST, ROOT, namespace=sshsig.PAYLOAD).signature,
    "that is none": b"signed",
    "that is empty": b"",
}


@pytest.mark.parametrize("signature", WRONG.values(), ids=WRONG)
def test_file_with_a_wrong_signature_is_not_believed(anchor: Path, signature: bytes) -> None:
    beside(anchor).write_bytes(signature)
    assert refusal(anchor) == ["TRUST_SIGNATURE"]


def test_signature_that_leads_nowhere_does_not_count_as_none(anchor: Path) -> None:
    beside(anchor).symlink_to("nowhere")
    assert refusal(anchor) == ["IO_ERROR"]


def test_file_that_is_not_there_is_told(etc: Path) -> None:
    assert refusal(etc / "trust.toml") == ["TRUST_MISSING"]


@pytest.mark.parametrize("mode", [0o664, 0o646])
def test_file_that_other_users_can_write_to_is_not_believed(anchor: Path, mode: int) -> None:
    anchor.chmod(mode)
    assert refusal(anchor) == ["TRUST_OPEN_TO_OTHERS"]


@needs_root
def test_file_of_another_user_is_not_believed(anchor: Path) -> None:
    os.chown(anchor, 65534, -1)
    assert refusal(anchor) == ["TRUST_OPEN_TO_OTHERS"]


@pytest.mark.parametrize(
    ("suffix", "size"), [("", trust_file.MAX_BYTES), (".sig", sshsig.MAX_BYTES)]
)
def test_file_that_is_too_long_is_not_parsed(
    anchor: Path, suffix: str, size: int, golden: Golden
) -> None:
    """It was replaced on purpose."""
    anchor.with_name(anchor.name + suffix).write_bytes(b"\n" * (size + 1))
    with pytest.raises(TrustRefused) as refused:
        anchors.load(anchor)
    (problem,) = refused.value.problems
    assert problem.code == "TOO_LARGE"
    golden.check("the first trust file is too large", problem.fix)


# Writing


def place(anchor: Path, file: SignedFile = FILE) -> str:
    """Write it; the code of what is in the way, or nothing."""
    try:
        anchors.place(anchor, file)
    except TrustRefused as refused:
        assert all(problem.fix for problem in refused.problems)
        return refused.code
    return ""


def test_file_is_written_with_its_signature_and_read_again(etc: Path) -> None:
    anchor = etc / "new/deeper/trust.toml"
    assert place(anchor) == ""
    assert anchors.load(anchor).origin is Origin.SIGNED
    assert {path.name for path in anchor.parent.iterdir()} == {"trust.toml", "trust.toml.sig"}
    for path in anchor.parent.iterdir():
        assert path.stat().st_mode & 0o777 == 0o644
    assert anchor.parent.stat().st_mode & 0o022 == 0


def test_links_that_are_there_are_replaced_not_followed(etc: Path, tmp_path: Path) -> None:
    victim = tmp_path / "authorized_keys"
    victim.write_text("mine")
    for name in ("trust.toml", "trust.toml.sig", ".trust.toml.part", ".trust.toml.sig.part"):
        (etc / name).symlink_to(victim)
    assert place(etc / "trust.toml") == ""
    assert victim.read_text() == "mine"
    assert anchors.load(etc / "trust.toml").origin is Origin.SIGNED
    assert not (etc / "trust.toml").is_symlink()


@pytest.mark.parametrize("mode", [0o775, 0o757, 0o1777])
def test_nothing_is_written_to_a_folder_that_other_users_can_change(etc: Path, mode: int) -> None:
    etc.chmod(mode)
    assert place(etc / "trust.toml") == "TRUST_OPEN_TO_OTHERS"
    assert not list(etc.iterdir())


@pytest.mark.parametrize("mode", [0o775, 0o757])
def test_nothing_is_written_below_a_folder_that_other_users_can_change(
    etc: Path, mode: int
) -> None:
    etc.chmod(mode)
    assert place(etc / "inner/trust.toml") == "TRUST_OPEN_TO_OTHERS"
    assert not list(etc.iterdir())


def test_sticky_folder_may_lead_to_one_that_other_users_cannot_change(etc: Path) -> None:
    etc.chmod(0o1777)
    assert place(etc / "inner/trust.toml") == ""


@needs_root
@pytest.mark.parametrize("which", ["etc", "etc/inner"])
def test_nothing_is_written_below_a_folder_of_another_user(tmp_path: Path, which: str) -> None:
    (tmp_path / "etc/inner").mkdir(parents=True, mode=0o755)
    os.chown(tmp_path / which, 65534, -1)
    assert place(tmp_path / "etc/inner/trust.toml") == "TRUST_OPEN_TO_OTHERS"
    assert not list((tmp_path / "etc/inner").iterdir())


def test_links_on_the_way_are_followed(etc: Path, tmp_path: Path) -> None:
    (tmp_path / "usr").mkdir(mode=0o755)
    (tmp_path / "usr/relative").symlink_to("../etc")
    (tmp_path / "absolute").symlink_to(tmp_path / "usr")
    assert place(tmp_path / "absolute/relative/trust.toml") == ""
    assert anchors.load(etc / "trust.toml").origin is Origin.SIGNED


def test_links_that_other_users_can_change_are_not_followed(etc: Path, tmp_path: Path) -> None:
    """Another user would choose where root writes, among the safe places."""
    shared = tmp_path / "shared"
    shared.mkdir()
    (shared / "way").symlink_to(etc)
    shared.chmod(0o777)
    assert place(shared / "way/trust.toml") == "TRUST_OPEN_TO_OTHERS"
    assert not list(etc.iterdir())


@needs_root
def test_links_that_other_users_have_made_are_not_followed(etc: Path, tmp_path: Path) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    (shared / "way").symlink_to(etc)
    shared.chmod(0o1777)
    assert place(shared / "way/trust.toml") == ""
    os.chown(shared / "way", 65534, -1, follow_symlinks=False)
    assert place(shared / "way/trust.toml") == "TRUST_OPEN_TO_OTHERS"


def test_links_to_where_other_users_can_write_are_not_followed(etc: Path, tmp_path: Path) -> None:
    etc.chmod(0o777)
    (tmp_path / "way").symlink_to(etc)
    assert place(tmp_path / "way/trust.toml") == "TRUST_OPEN_TO_OTHERS"
    assert not list(etc.iterdir())


def test_links_without_end_are_an_error(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(OSError, match="symbolic links"):
        anchors.place(tmp_path / "a/trust.toml", FILE)


def test_file_in_place_of_a_folder_is_an_error(etc: Path) -> None:
    (etc / "file").write_text("")
    with pytest.raises(NotADirectoryError):
        anchors.place(etc / "file/trust.toml", FILE)
    with pytest.raises(NotADirectoryError):
        anchors.place(etc / "file/inner/trust.toml", FILE)
