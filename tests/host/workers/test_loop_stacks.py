"""Where a worker's loop stood, read from what faulthandler writes."""

from __future__ import annotations

from nondum.host.workers.loop_stacks import Standstill

SITE = "/state/venvs/k/gps/lib/python3.11/site-packages"
DUMP = f"""\
Timeout (0:00:04)!
Thread 0x00007f0000000001 (most recent call first):
  File "{SITE}/gps/reader.py", line 3 in read
  File "/usr/lib/python3.11/threading.py", line 975 in run

Thread 0x00007f0000000002 (most recent call first):
  File "/usr/lib/python3.11/socket.py", line 706 in readinto
  File "{SITE}/requests/api.py", line 59 in get
  File "{SITE}/gps/plugin.py", line 33 in watch
  File "{SITE}/nondum/sdk/running.py", line 22 in call
  File "/usr/lib/python3.11/asyncio/events.py", line 80 in _run
  File "{SITE}/nondum/sdk/worker.py", line 30 in main
"""


def taken(text: str, package: str = "gps") -> Standstill:
    found = Standstill(package)
    for line in text.splitlines():
        assert found.take(line), line
    return found


def test_the_plugins_own_frame_on_the_loop_is_told() -> None:
    assert taken(DUMP).place == "watch, gps/plugin.py:33"


def test_another_packages_frame_is_told_where_the_plugin_has_none() -> None:
    assert taken(DUMP, "radar").place == "get, requests/api.py:59"


def test_what_is_written_otherwise_is_no_part_of_it() -> None:
    found = taken(DUMP)
    assert not found.take("the end")
    assert not found.take(f'  File "{SITE}/gps/plugin.py", line 1 in later')
    assert found.place == "watch, gps/plugin.py:33"
    assert not Standstill("gps").take("Thread 0x1 (most recent call first):")


def test_loop_that_goes_on_stands_nowhere() -> None:
    found = taken(DUMP)
    found.forget()
    assert found.place == ""
    assert taken("Timeout (0:00:04)!\n").place == ""
