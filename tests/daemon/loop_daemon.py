"""A daemon that also takes loop devices for drives: those on images in one folder, no others.

`python -m tests.daemon.loop_daemon FOLDER --config FILE`. What is shipped takes USB drives only.
"""

from __future__ import annotations

import argparse
import asyncio
import logging
from pathlib import Path

import pyudev

from nondum.host.app import run_host
from nondum.host.config.host_config import user_config
from nondum.host.config.parsing import load
from nondum.host.sources.drives.blocks import BlockSource


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--config", type=Path)
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO)
    config = load(options.config, user_config())

    def accepts(device: pyudev.Device) -> bool:
        backing = Path(device.sys_path) / "loop/backing_file"
        return backing.exists() and backing.read_text().startswith(f"{options.folder}/")

    loops = BlockSource(config.host.state / "mounts", accepts=accepts)
    asyncio.run(run_host(config, more_drives=[loops]))


if __name__ == "__main__":
    main()
