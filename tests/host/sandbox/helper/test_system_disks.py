"""A disk that the machine itself needs is its own as a whole; a person's mount is theirs alone."""

from __future__ import annotations

from pathlib import PurePosixPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.sandbox.helper import mountinfo, system_disks
from nondum.host.sandbox.helper.mountinfo import Mount
from nondum.host.sandbox.helper.system_disks import Block, Use

OURS = PurePosixPath("/run/nondum/mounts")
SYSTEM = Use("it is mounted on /")
PERSON = Use("it is mounted on /media/ann/STICK", is_own=False)
BLOCKS = (
    Block("sda", 1, "sda"),
    Block("sda1", 2, "sda"),
    Block("sda2", 3, "sda"),
    Block("sdb", 4, "sdb"),
    Block("sdb1", 5, "sdb"),
    Block("dm-0", 6, "dm-0"),
)
words = st.text(st.characters(exclude_categories=["Cs"]), max_size=40)


def paths(text: str) -> list[str]:
    return [named.path for named in system_disks.in_fstab(text)]


@pytest.mark.parametrize(
    ("line", "path"),
    [
        ("/dev/sda1 /boot vfat defaults 0 2", "/dev/sda1"),
        ("UUID=AB-CD /var ext4 nofail", "/dev/disk/by-uuid/AB-CD"),
        ('UUID="AB-CD" /var ext4 nofail', "/dev/disk/by-uuid/AB-CD"),
        ("PARTUUID=12-02\t/\text4\tro\t0\t1", "/dev/disk/by-partuuid/12-02"),
        ("  LABEL=DATA none swap sw", "/dev/disk/by-label/DATA"),
    ],
)
def test_every_way_to_name_a_disk_in_fstab_is_known(line: str, path: str) -> None:
    assert paths(f"# a comment\n\n{line}\n") == [path]


def test_label_with_a_blank_is_looked_for_as_udev_writes_it() -> None:
    assert paths("LABEL=MY\\040DISK /srv ext4") == [
        "/dev/disk/by-label/MY DISK",
        "/dev/disk/by-label/MY\\x20DISK",
    ]


@pytest.mark.parametrize("spec", ["server:/export", "//nas/share", "tmpfs", "/srv/image", "proc"])
def test_what_is_no_device_is_not_looked_at(spec: str) -> None:
    """Looking at a path of a network's file system may take for ever."""
    assert paths(f"{spec} /mnt auto") == []


def test_other_places_where_the_machine_names_its_disks_are_read() -> None:
    swaps = "Filename Type Size Used Priority\n/dev/sda3 partition 1 0 -2\n/swapfile file 1 0 -3\n"
    assert [named.path for named in system_disks.in_swaps(swaps)] == ["/dev/sda3"]
    crypttab = "# name device key\ndata UUID=1-2 none luks\n"
    assert [named.path for named in system_disks.in_crypttab(crypttab)] == ["/dev/disk/by-uuid/1-2"]
    line = "console=ttyS0 root=/dev/sda2 resume=UUID=3-4 rootwait"
    found = [named.path for named in system_disks.in_command_line(line)]
    assert found == ["/dev/sda2", "/dev/disk/by-uuid/3-4"]


@given(words)
def test_whatever_these_files_say_only_paths_below_dev_are_named(text: str) -> None:
    for read in (
        system_disks.in_fstab,
        system_disks.in_crypttab,
        system_disks.in_swaps,
        system_disks.in_command_line,
    ):
        assert all(one.path.startswith("/dev/") for one in read(text))
    for what in (text, f"What={text}"):
        assert all(
            named.path.startswith("/dev/") for named in system_disks.in_unit(what, "a.mount")
        )


@given(words)
def test_whatever_mountinfo_says_what_is_no_mount_is_passed_over(text: str) -> None:
    line = "36 35 8:17 / /srv ro - ext4 /dev/sdb1 ro"
    assert Mount(mountinfo.device_number("8:17"), "/srv", "/dev/sdb1") in mountinfo.parsed(
        f"{text}\n{line}\n{text}"
    )


@given(st.from_regex(r"[^\s\\]([^\n\\]{0,30}[^\s\\])?", fullmatch=True))
def test_mount_point_is_read_back_as_it_was_written(name: str) -> None:
    written = "".join(f"\\{ord(c):03o}" if c in " \t\n\\" else c for c in name)
    found = list(mountinfo.parsed(f"36 35 8:17 / /media/{written} ro - vfat /dev/sdb1 ro".strip()))
    if len(name.splitlines()) == 1:
        assert [mount.at for mount in found] == [f"/media/{name}"]


def test_own_mounts_are_no_use() -> None:
    mine = Mount(5, "/run/nondum/mounts/sdb1-7", "/dev/sdb1")
    root = Mount(2, "/", "/dev/sda1")
    assert list(system_disks.mounted([mine, root], OURS)) == [(root, SYSTEM)]


@pytest.mark.parametrize("place", ["/media/ann/STICK", "/run/media/ann/STICK", "/mnt/look"])
def test_what_is_mounted_where_people_look_is_not_the_machine_s_own(place: str) -> None:
    ((_, use),) = system_disks.mounted([Mount(5, place, "/dev/sdb1")], OURS)
    assert not use.is_own
    assert place in use.why


def test_one_partition_of_the_machine_s_own_makes_the_whole_disk_its_own() -> None:
    found = system_disks.uses(BLOCKS, {3: SYSTEM})
    assert found.keys() == {"sda", "sda1", "sda2"}
    assert all(use.is_own for use in found.values())
    assert "sda2" in found["sda1"].why


def test_person_s_mount_is_that_partition_s_alone() -> None:
    assert system_disks.uses(BLOCKS, {5: PERSON}) == {"sdb1": PERSON}


def test_part_of_another_device_is_the_machine_s_own() -> None:
    member = Block("sdb1", 5, "sdb", holders=("dm-0",))
    found = system_disks.uses([*BLOCKS[:4], member, BLOCKS[5]], {})
    assert found.keys() == {"sdb", "sdb1"}
    assert "dm-0" in found["sdb1"].why


@given(st.dictionaries(st.integers(1, 6), st.sampled_from([SYSTEM, PERSON])))
def test_nothing_that_is_needed_is_ever_free(direct: dict[int, Use]) -> None:
    found = system_disks.uses(BLOCKS, direct)
    for block in BLOCKS:
        if block.number in direct:
            assert found[block.name].is_own >= direct[block.number].is_own
    own_disks = {block.disk for block in BLOCKS if block.name in found and found[block.name].is_own}
    assert all(found[b.name].is_own for b in BLOCKS if b.disk in own_disks)
    assert system_disks.uses(BLOCKS, direct) == system_disks.uses(tuple(reversed(BLOCKS)), direct)
