"""Each worker of a daemon that is root is a separate user to the kernel."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.kit.descriptors import descriptors_left, open_descriptors
from tests.kit.golden import Golden
from tests.kit.workers import WorkersUnderTest
from tests.sandbox.guests import open_folder, owner, status

from nondum.host.core.events.workers import WorkerLogged
from nondum.host.manager.state_folders import remove
from nondum.host.sandbox.helper.worker_users import OF_ROOT
from nondum.host.sandbox.levels.users import FIRST_USER, Users, is_workers
from nondum.host.workers import scratch
from nondum.host.workers.boxed import Boxed
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.spare import Spare
from nondum.sdk.errors import WorkerFailed

pytestmark = [
    pytest.mark.anyio,
    pytest.mark.skipif(os.geteuid() != 0, reason="only root can give users to workers"),
]
BWRAP = shutil.which("bwrap") or "bwrap"
NOTHING = "print('here', flush=True)"
PLAYS = """
import os
deep = 'games'
for level in range(40):
    os.mkdir(deep)
    open(f'{deep}/file', 'w').write('x' * 5000)
    deep += '/' + 'd' * 50
for folder, folders, files in os.walk('games', topdown=False):
    for name in (*folders, *files):
        os.chmod(f'{folder}/{name}', 0)
os.chmod('games', 0)
os.chmod('.', 0)
print('here', flush=True)
"""


@pytest.fixture
def has_users() -> bool:
    return True


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder that everybody may go into, unlike those of tests."""
    with open_folder() as folder:
        yield folder


async def started(tested: WorkersUnderTest, component: str, source: str = NOTHING) -> Path:
    """Its scratch folder, once a worker has done its thing."""
    spec = await tested.start(component, source)
    await tested.until(WorkerLogged, lambda e: (e.component, e.message) == (component, "here"))
    return spec.scratch


def users_of(pid: int) -> set[int]:
    """Real, effective, saved and file system user, as the host counts."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("Uid:"):
            return set(map(int, line.split()[1:]))
    raise LookupError(pid)


async def test_two_workers_are_two_users_and_neither_is_the_hosts(
    tested: WorkersUnderTest,
) -> None:
    one, other = await started(tested, "one"), await started(tested, "other")
    pids = tested.workers.pids()
    (first,), (second,) = users_of(pids["one"]), users_of(pids["other"])
    assert is_workers(first) and is_workers(second) and first != second
    assert [owner(one), owner(other)] == [first, second]
    groups = {id: set(status(pid)["Gid"].split()) for id, pid in pids.items()}
    assert groups == {"one": {str(first)}, "other": {str(second)}}


async def test_worker_is_the_same_user_after_a_restart_of_it_and_of_the_host(
    tested: WorkersUnderTest, tmp_path: Path
) -> None:
    user = owner(await started(tested, "one"))
    await tested.workers.stop("one")
    again = WorkersUnderTest(tmp_path, confinement=Boxed(BWRAP, has_users=True))
    shutil.rmtree(tmp_path / "one/site-packages")
    place = await started(again, "one")
    assert owner(place) == user
    await again.workers.close(grace_s=1.0)


def test_no_two_scratch_folders_have_one_user(folder: Path) -> None:
    users, places = Users(OF_ROOT), [folder / f"payload-{n}" / "same" for n in range(40)]
    for place in places:
        place.mkdir(parents=True)
    given = [users.of(place) for place in places]
    assert len(set(given)) == len(places) and all(map(is_workers, given))
    assert [users.of(place) for place in places] == given
    for place, user in zip(places, given, strict=True):
        os.chown(place, user, user)
    assert [Users(OF_ROOT).of(place) for place in reversed(places)] == given[::-1]


def test_user_of_another_folder_is_not_taken_though_it_owns_both(folder: Path) -> None:
    one, other = folder / "a/one", folder / "b/other"
    for place in (one, other):
        place.mkdir(parents=True)
        os.chown(place, FIRST_USER, FIRST_USER)
    assert Users(OF_ROOT).of(one) != FIRST_USER


def test_all_users_may_be_taken(folder: Path) -> None:
    users = Users(range(FIRST_USER, FIRST_USER + 2))
    for name in ("one", "two", "three"):
        (folder / name / "it").mkdir(parents=True)
    assert {users.of(folder / "one/it"), users.of(folder / "two/it")} == {
        FIRST_USER,
        FIRST_USER + 1,
    }
    with pytest.raises(OSError, match="taken"):
        users.of(folder / "three/it")


async def test_scratch_of_another_cannot_be_read_even_by_path(
    tested: WorkersUnderTest, folder: Path
) -> None:
    one, other = await started(tested, "one"), await started(tested, "other")
    for place in (one, other):  # where nothing above keeps anybody out
        (place / "notes").write_text("of one")
        place.rename(folder / place.parent.name)
    for reader, written, may in (("one", "one", True), ("one", "other", False)):
        assert reads(owner(folder / reader), folder / written / "notes") == may


def reads(user: int, file: Path) -> bool:
    """Whether a user of the machine can read a file."""
    cat = subprocess.run(["cat", file], user=user, group=user, capture_output=True)
    return cat.returncode == 0


async def test_nothing_is_left_of_a_scratch_whatever_a_worker_did_to_it(
    tested: WorkersUnderTest,
) -> None:
    place = await started(tested, "guest", PLAYS)
    assert scratch.used_bytes(place) > 40 * 5000
    await tested.workers.stop("guest")
    remove(place)
    assert not place.exists()


async def test_scratch_that_was_the_hosts_is_the_workers_with_all_that_is_in_it(
    tested: WorkersUnderTest, tmp_path: Path
) -> None:
    place = tmp_path / "guest/scratch"
    (place / "inner").mkdir(parents=True)
    (place / "inner/kept").write_text("kept")
    (tmp_path / "elsewhere").write_text("of the host")
    os.link(tmp_path / "elsewhere", place / "linked")
    source = "open('inner/kept', 'a').write(' on')\n" + NOTHING
    await started(tested, "guest", source)
    assert (place / "inner/kept").read_text() == "kept on"
    assert owner(tmp_path / "elsewhere") == 0, "it has a name elsewhere"


async def test_scratch_is_the_hosts_again_where_workers_share_its_user(
    tested: WorkersUnderTest, tmp_path: Path
) -> None:
    place = await started(tested, "guest", "open('kept', 'w').write('kept')\n" + NOTHING)
    await tested.workers.stop("guest")
    shutil.rmtree(tmp_path / "guest/site-packages")
    sharing = WorkersUnderTest(tmp_path, confinement=Boxed(BWRAP))
    await started(sharing, "guest", "open('kept', 'a').write(' on')\n" + NOTHING)
    assert (place / "kept").read_text() == "kept on"
    await sharing.workers.close(grace_s=1.0)


def test_scratch_that_is_too_deep_to_be_given_is_emptied(folder: Path) -> None:
    place = folder / "scratch"
    place.mkdir()
    at = os.open(place, os.O_RDONLY)
    for _ in range(1200):
        os.mkdir("d", dir_fd=at)
        below = os.open("d", os.O_RDONLY, dir_fd=at)
        os.close(at)
        at = below
    os.close(at)
    scratch.give(place, FIRST_USER)
    assert owner(place) == FIRST_USER
    assert not any(place.iterdir())


async def test_worker_works_as_the_hosts_user_where_only_root_may_read_its_code(
    tested: WorkersUnderTest, caplog: pytest.LogCaptureFixture, golden: Golden
) -> None:
    before = os.umask(0o077)
    try:
        place = await started(tested, "guest")
    finally:
        os.umask(before)
    assert owner(place) == 0
    code = tested.folder / "guest/site-packages"
    golden.check_line("the umask hides the store", "\n".join(caplog.messages), code=code)


async def test_hosts_own_mask_does_not_shut_the_worker_out(tested: WorkersUnderTest) -> None:
    spec = tested.spec("guest", NOTHING)
    before = os.umask(0o077)
    try:
        await tested.workers.start(spec)
    finally:
        os.umask(before)
    await tested.until(WorkerLogged, lambda event: event.message == "here")
    assert is_workers(owner(spec.scratch))


async def test_sandbox_that_is_not_there_in_time_is_none(
    tested: WorkersUnderTest, tmp_path: Path
) -> None:
    hangs = tmp_path / "bwrap"
    hangs.write_text("#!/bin/sh\nexec sleep 600\n")
    hangs.chmod(0o755)
    tested.workers.launcher = WorkerLauncher(Boxed(str(hangs), has_users=True), startup_s=0.05)
    with pytest.raises(WorkerFailed) as failed:
        await tested.workers.start(tested.spec("guest", NOTHING))
    assert failed.value.code == "WORKER_HUNG"


def test_no_descriptor_is_left_of_a_sandbox_that_cannot_be_made() -> None:
    boxed = Boxed(BWRAP, has_users=True)
    before = open_descriptors()
    failures = 0
    for left in range(16):
        with descriptors_left(left):
            try:
                Spare(boxed, boxed.ground(None)).close()
            except OSError:
                failures += 1
        assert open_descriptors() == before, left
    assert failures >= 6, "two for orders, four for the namespace"


async def test_worker_inherits_nothing_of_how_it_got_its_user(tested: WorkersUnderTest) -> None:
    source = (
        "import os\n"
        "pipes = [fd for fd in range(3, 64) if os.path.exists(f'/proc/self/fd/{fd}')"
        " and os.readlink(f'/proc/self/fd/{fd}').startswith('pipe:')]\n"
        "print('pipes', pipes, os.getgroups(), flush=True)\n"
        "open('/dev/stdout', 'w').write('by name\\n')\n"
    )
    await tested.start("guest", source)
    said = await tested.until(WorkerLogged, lambda event: event.message.startswith("pipes"))
    assert said.message == "pipes [] []"
    await tested.until(WorkerLogged, lambda event: event.message == "by name")
