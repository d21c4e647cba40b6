"""A signal asks the daemon to stop; another one ends what does not come to its end."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest
from tests.kit.until import PATIENCE_S

from nondum.host.service.stop_signals import STOP

DAEMON = """
import asyncio, os, sys, threading, time
from nondum.host.service.stop_signals import told_to_stop

async def main(number):
    with told_to_stop() as stop:
        os.kill(os.getpid(), number)
        await stop.wait()
    loop = asyncio.get_running_loop()
    loop.run_in_executor(None, time.sleep, 600)  # asyncio.run waits for it
    again = lambda: (print("stopped", flush=True), os.kill(os.getpid(), number))
    threading.Thread(target=again, daemon=True).start()

asyncio.run(main(int(sys.argv[1])))
"""


@pytest.mark.parametrize("number", STOP)
def test_signal_after_the_end_ends_the_process(number: signal.Signals) -> None:
    command = [sys.executable, "-c", DAEMON, str(int(number))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.stdout == "stopped\n"
    assert done.returncode == -number
