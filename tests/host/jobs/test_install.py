"""What a child refuses to install, though it was let in."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest
from tests.kit.lamp_drive import lamp, told

from nondum.host.jobs.install import install
from nondum.sdk.errors import InstallFailed
from nondum.wheelhouse.store.store import Store


def test_what_was_damaged_in_the_store_is_not_installed(tmp_path: Path) -> None:
    """Its wheel is not on the drive any more, so it is known by the store alone."""
    arguments: dict[str, Any] = {
        "folder": str(lamp(tmp_path / "drive")),
        "venvs": str(tmp_path / "venvs"),
        "store": str(tmp_path / "store"),
        "python": sys.executable,
        "method": "store",
        "reserve_mb": 0,
        "confinement": "none",
        "allow_unsigned": True,
        "headroom": None,
    }
    assert install(arguments, told)["fresh"]
    assert not install(arguments, told)["fresh"]
    store = Store(tmp_path / "store")
    stored = next(wheel for wheel in store.listing() if "lamp" in wheel.filename)
    module = stored.root / "test_lamp.py"
    module.chmod(0o644)
    module.write_text("changed")
    with pytest.raises(InstallFailed) as failed:
        install(arguments, told)
    assert failed.value.code == "STORE_DAMAGED"
    assert store.get(stored.sha256) is None, "so that it is copied the next time"
