"""USB sticks for machines: FAT images filled without being mounted."""

from __future__ import annotations

from pathlib import Path

from tests.lab.cache import call

SLACK_MB = 8
MEGABYTE = 1024 * 1024


def fat_stick(image: Path, content: Path | None, *, label: str = "STICK") -> Path:
    """Write the image of a stick that holds what is in a folder (None: nothing)."""
    files = sorted(content.iterdir()) if content is not None else []
    size = sum(f.stat().st_size for f in content.rglob("*") if f.is_file()) if content else 0
    kilobytes = (size // MEGABYTE * 5 // 4 + SLACK_MB) * 1024
    call("mkfs.vfat", "-C", "-n", label, image, str(kilobytes))
    if files:
        call("mcopy", "-i", image, "-s", *files, "::")
    return image
