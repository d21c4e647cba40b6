"""What is verified where, and which tests guard it: nearest first."""

from __future__ import annotations

from collections.abc import Mapping

_W, _TW = "wheelhouse/nondum/wheelhouse", "tests/wheelhouse"

GUARDS: Mapping[str, tuple[str, ...]] = {
    f"{_W}/trust/wire.py": (f"{_TW}/trust",),
    f"{_W}/trust/public_key.py": (f"{_TW}/trust",),
    f"{_W}/trust/sshsig.py": (f"{_TW}/trust",),
    f"{_W}/trust/trust_file.py": (f"{_TW}/trust",),
    f"{_W}/trust/judging.py": (f"{_TW}/trust",),
    f"{_W}/contents.py": (f"{_TW}/test_contents.py",),
    f"{_W}/names.py": (f"{_TW}/test_contents.py", f"{_TW}/test_lock.py", f"{_TW}/test_wheel.py"),
    f"{_W}/drive.py": (f"{_TW}/test_drive.py",),
    f"{_W}/tables.py": (f"{_TW}/test_manifest.py",),
    f"{_W}/manifest.py": (f"{_TW}/test_manifest.py",),
    f"{_W}/lock.py": (f"{_TW}/test_lock.py",),
    f"{_W}/index.py": (f"{_TW}/test_payload.py",),
    f"{_W}/payload.py": (f"{_TW}/test_payload.py",),
    f"{_W}/preflight.py": (f"{_TW}/test_preflight.py",),
    f"{_W}/archive.py": (f"{_TW}/test_wheel.py", f"{_TW}/hostile"),
    f"{_W}/wheel.py": (f"{_TW}/test_wheel.py", f"{_TW}/hostile"),
    f"{_W}/dist_info.py": (f"{_TW}/test_wheel.py", f"{_TW}/hostile"),
    f"{_W}/record.py": (f"{_TW}/test_wheel.py", f"{_TW}/hostile"),
    "plugins/sdk/nondum/sdk/wire.py": ("tests/sdk/test_wire.py",),
    "plugins/sdk/nondum/sdk/wire_fields.py": ("tests/sdk/test_wire.py",),
}
"""Module → tests. The packages of what is plugged in, from its signature to its last wheel."""
