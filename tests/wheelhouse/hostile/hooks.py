"""Files that would act before, beside or instead of the plugin's worker."""

from __future__ import annotations

from tests.wheelhouse.hostile.case import HostileWheel, built, planted, with_file
from tests.wheelhouse.hostile_wheels import WHEEL, WheelBuilder

HOOK, SHADOWS, SCHEME = "WHEEL_STARTUP_HOOK", "WHEEL_SHADOWS", "WHEEL_DATA_SCHEME"

WHEELS: tuple[HostileWheel, ...] = (
    planted("pth", HOOK, "evil.pth", line=True),
    planted("pth-in-purelib", HOOK, "evil-1.0.data/purelib/evil.pth", line=True),
    planted("pth-in-platlib", HOOK, "evil-1.0.data/platlib/evil.pth", line=True),
    planted("start-file", HOOK, "evil.start", line=True),
    built("pth-of-editable", HOOK, with_file("__editable__.evil-1.0.pth", b"/tmp/evil\n")),
    planted("sitecustomize", HOOK, "sitecustomize.py"),
    planted("usercustomize-package", HOOK, "usercustomize/__init__.py"),
    planted("sitecustomize-compiled", HOOK, "sitecustomize.pyc"),
    planted("sitecustomize-extension", HOOK, "sitecustomize.cpython-311-x86_64-linux-gnu.so"),
    planted("sitecustomize-in-platlib", HOOK, "evil-1.0.data/platlib/sitecustomize.py"),
    planted("shadows-module", SHADOWS, "json.py"),
    planted("shadows-package", SHADOWS, "asyncio/__init__.py"),
    planted("shadows-extension", SHADOWS, "_ctypes.cpython-311-x86_64-linux-gnu.so"),
    planted("shadows-in-platlib", SHADOWS, "evil-1.0.data/platlib/ssl.py"),
    planted("takes-nondum", SHADOWS, "nondum/__init__.py"),
    planted("takes-nondum-module", SHADOWS, "nondum.py"),
    planted("takes-the-host", SHADOWS, "nondum/host/app.py"),
    planted("takes-the-sdk", SHADOWS, "nondum/sdk/wire.py"),
    built(
        "second-dist-info",
        "WHEEL_STRUCTURE",
        with_file("other-1.0.dist-info/WHEEL", WHEEL),
    ),
    built(
        "entry-points-of-another",
        "WHEEL_STRUCTURE",
        with_file("nondum_sdk-9.dist-info/entry_points.txt", b"[nondum.plugins]\na = b:c\n"),
    ),
    built(
        "second-dist-info-in-purelib",
        "WHEEL_STRUCTURE",
        with_file("evil-1.0.data/purelib/other-1.0.dist-info/METADATA", b"Name: other\n"),
    ),
    built(
        "egg-info-of-another", "WHEEL_STRUCTURE", with_file("pip.egg-info/PKG-INFO", b"Name: pip\n")
    ),
    planted("replaces-python", SCHEME, "evil-1.0.data/data/bin/python3"),
    planted("replaces-python-script", SCHEME, "evil-1.0.data/scripts/python"),
    planted("replaces-pip", SCHEME, "evil-1.0.data/scripts/pip"),
    planted("replaces-activate", SCHEME, "evil-1.0.data/scripts/activate"),
    planted("data-of-another", SCHEME, "other-1.0.data/purelib/evil/b.py"),
    planted("unknown-scheme", SCHEME, "evil-1.0.data/stdlib/evil/b.py"),
    built("data-in-no-scheme", SCHEME, WheelBuilder(files={"evil-1.0.data/evil.py": b"x"})),
)
