"""Data that a worker is shown, at each level: come and gone while it runs, changed by none."""

from __future__ import annotations

import os
import shutil
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.kit.guest import do, guest_spec
from tests.kit.workers import WorkersUnderTest

from nondum.host.core.effects import HideData, ShowData
from nondum.host.core.records.data import DataRecord
from nondum.host.manager.shown_data import ShownData
from nondum.host.manager.state_folders import Folders
from nondum.host.workers.boxed import Boxed
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.held import Held
from nondum.host.workers.unconfined import Unconfined

pytestmark = pytest.mark.anyio
KEY = "0" * 16
LOOKS = """
data = ctx.data("weights")
seen = os.listdir(ctx.settings["shown"])
if data is None:
    return f"nothing, {seen}"
changes = [
    lambda: open(data.path, "r+b"),
    lambda: os.unlink(data.path),
    lambda: open(data.folder / "more", "wb"),
    lambda: os.rename(data.path, data.folder / "other"),
]
for number, change in enumerate(changes):
    try:
        change()
        return f"could do change {number}"
    except OSError:
        pass
return f"{data.name} {data.version}: {data.path.read_text()}, {seen}"
"""


def levels() -> dict[str, Confinement]:
    bwrap = shutil.which("bwrap") or "bwrap"
    found: dict[str, Confinement] = {"restricted": Held(), "sandboxed": Boxed(bwrap)}
    if os.geteuid() == 0:
        found["sandboxed, own user"] = Boxed(bwrap, has_users=True)
    else:
        found["none"] = Unconfined()  # which stops no root from writing
    return found


@pytest.fixture(params=levels())
async def tested(tmp_path: Path, request: pytest.FixtureRequest) -> AsyncIterator[WorkersUnderTest]:
    tested = WorkersUnderTest(tmp_path, confinement=levels()[request.param])
    yield tested
    await tested.workers.close(grace_s=1.0)


def brought(tested: WorkersUnderTest, text: str) -> DataRecord:
    """Data of one file, as a payload has them."""
    folder = tested.folder / "payload" / text
    folder.mkdir(parents=True)
    (folder / "words.txt").write_text(text)
    (folder / "words.txt").chmod(0o444)
    return DataRecord("k1", "org.words", text, "text", "1", folder, ("words.txt",), len(text))


async def says(tested: WorkersUnderTest) -> str:
    call = do(tested)
    await call.ended()
    return call.reason


async def test_a_worker_sees_what_it_is_shown_and_changes_nothing(tested: WorkersUnderTest) -> None:
    shown = Folders(tested.folder).shown(KEY, "guest")
    data = ShownData(Folders(tested.folder), tested.workers)
    shown.parent.parent.mkdir(parents=True)
    await data.prepare(KEY, ["guest"])
    spec = guest_spec(tested, LOOKS.strip())
    await tested.workers.start(replace(spec, shown=shown, settings={"shown": str(shown)}))
    assert await says(tested) == "nothing, []"
    for text in ("hello", "goodbye"):
        await data.show(ShowData("guest", KEY, "weights", brought(tested, text)))
        assert await says(tested) == f"{text} 1: {text}, ['weights']"
    await data.hide(HideData("guest", KEY, "weights"))
    assert await says(tested) == "nothing, []"
