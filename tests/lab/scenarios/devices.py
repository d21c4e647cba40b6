"""Cameras, sound, I2C, serial lines and HIDs go, whole, to who asks; others are never opened."""

from __future__ import annotations

from typing import Any

from tests.lab.installed import Installed
from tests.lab.lab import Lab
from tests.lab.machine import Machine
from tests.lab.plugins import opener, until_said

from nondum.host.sandbox.helper import worker_users

DROP_IN = "/etc/systemd/system/nondum-helper.service.d/devices.conf"
ALLOWED = """[Service]
ExecStart=
ExecStart=/opt/nondum/bin/python -I -m nondum.host.sandbox.helper --user nondum \
 --allow-subsystem video4linux --allow-subsystem sound --allow-subsystem i2c-dev
"""
"""What does not hang on USB is granted only where root has said so."""
MODULES = {"vivid": "n_devs=1", "snd-aloop": "pcm_substreams=1", "i2c-stub": "chip_addr=0x50"}
"""Modules of the kernel that stand for hardware."""
COMPONENTS = (
    opener("camera", subsystem="video4linux", driver="vivid"),
    opener("loop", subsystem="sound", bus="platform"),
    opener("wire", subsystem="i2c-dev", port="i2c-*"),
    opener("line", usb="0403:6001", serial="LAB?"),
    opener("pad", subsystem="hidraw", ID_MODEL="QEMU_USB_Tablet"),
    opener("voice", interface="audio", usb="46f4:0002"),
    opener("any-hid", subsystem="hidraw"),
)
GRANTED = {"camera": 2, "loop": 5, "wire": 1, "line": 1, "pad": 1, "voice": 2}
"""Component → how many nodes its device has at least."""
WATCH = """
import ctypes, os, struct, sys
libc = ctypes.CDLL(None, use_errno=True)
watching, OPEN = libc.inotify_init(), 0x20
names = {libc.inotify_add_watch(watching, p.encode(), OPEN): p for p in sys.argv[1:]}
print("watching", len(names), flush=True)
while data := os.read(watching, 4096):
    while data:
        watch, _, _, length = struct.unpack_from("iIII", data)
        print("opened", names[watch], flush=True)
        data = data[16 + length:]
"""
WATCHED = "/run/watched"
USERS = """
for pid in $(cat $(find /sys/fs/cgroup/system.slice/nondum.service -name cgroup.procs)); do
  awk '/^Uid/ {print $2}' /proc/$pid/status
done 2>/dev/null; true
"""
"""The kernel's users that processes of the service run as."""
PAD = "/run/nondum-helper/devices/pad/it"
"""The node that the helper makes for a component."""
KEYBOARD, MOUSE = "03:01:01", "03:01:02"
"""Of USB's interface classes, those of QEMU's keyboard and mouse."""


def run(lab: Lab) -> str:
    """Plug all in, see it granted and opened; see that nothing else is; pull all and see it go."""
    host = lab.host()
    try:
        return _seen_through(lab, host)
    finally:
        host.machine.attempt(f"rm -f {DROP_IN}; systemctl daemon-reload")
        host.machine.attempt("systemctl stop nondum-helper.service watch.service")
        host.machine.attempt(f"modprobe -ra {' '.join(MODULES)}")


def _seen_through(lab: Lab, host: Installed) -> str:
    machine = host.machine
    machine.run(f"mkdir -p {DROP_IN.rpartition('/')[0]}")
    machine.put(DROP_IN, ALLOWED)
    machine.run("systemctl daemon-reload; systemctl stop nondum-helper.service")
    machine.run("modprobe -rq i2c-i801; true")  # the board's own bus, where it has one
    for module, options in MODULES.items():
        machine.run(f"modprobe {module} {options}")
    machine.run("modprobe i2c-dev")
    plugged = [machine.plug_device(f"usb-{kind}") for kind in ("tablet", "mouse", "kbd", "audio")]
    line = machine.plug_line(serial="LAB1")
    stick = host.bring(lab.stick("instruments", *COMPONENTS), "org.example.instruments")
    told = {id: until_said(host, id, "opened", least) for id, least in GRANTED.items()}
    _see_left_alone(host)
    for id, least in GRANTED.items():  # by the workers of the daemon that was started again
        until_said(host, id, "opened", least)
    _see_users(machine)
    tablet, *others = plugged
    _see_node_go(machine, tablet)
    machine.pull_line(line)
    for name in others:
        machine.unplug(name)
    machine.run(f"modprobe -r {' '.join(MODULES)}")
    for id in GRANTED:
        host.until_component(id, "waits for it")
        until_said(host, id, "nothing", 1)
    machine.pull(stick)
    host.until_payload("org.example.instruments", "gone")
    return "; ".join(f"{id}: {said}" for id, said in told.items())


def _see_users(machine: Machine) -> None:
    """Each worker runs as a different user, and no system call of the helper was refused."""
    users = {int(user) for user in machine.run(USERS).split()}
    own = users.intersection(worker_users.OF_SERVICE)
    assert len(own) >= len(GRANTED), f"processes of the service run as {sorted(users)}"
    said = machine.run("journalctl -b -o cat --no-pager -u nondum-helper.service")
    assert "31/SYS" not in said, said[-2000:]


def _see_node_go(machine: Machine, tablet: str) -> None:
    """The helper takes a node away by itself: its number may be another device's next."""
    machine.run(f"test -c {PAD}")
    daemon = "$(systemctl show -p MainPID --value nondum.service)"
    machine.run(f"kill -STOP {daemon}")
    try:
        machine.unplug(tablet)
        gone = f"test ! -e {PAD}"
        machine.until("its node is gone", lambda: machine.attempt(gone).status == 0 or None)
    finally:
        machine.run(f"kill -CONT {daemon}")


def _see_left_alone(host: Installed) -> None:
    """Devices that no component has stay closed while a daemon starts and grants the rest again."""
    machine = host.machine
    rows: list[dict[str, Any]] = machine.attempt("nondum devices --json").json()
    kinds = {one["kind"]: row for row in rows for one in row.get("interfaces", ())}
    assert not kinds[MOUSE]["component"], kinds[MOUSE]
    keyboard = kinds[KEYBOARD]
    assert keyboard["left_alone"] == "it is a keyboard", keyboard
    said = machine.run("nondum devices --why " + keyboard["device"])
    assert "any-hid (it): does not match" in said, said
    idle = [
        node["node"]
        for row in rows
        if not row["component"] and row["bus"] == "usb" and row["vendor"] != "1d6b"
        for node in row["nodes"]
    ]
    assert len(idle) >= 4, rows
    machine.put("/run/watch.py", WATCH)
    machine.run(
        f"systemd-run -q --unit watch -p StandardOutput=file:{WATCHED} "
        f"python3 /run/watch.py {' '.join(idle)}"
    )
    machine.until("it watches", lambda: "watching" in machine.attempt(f"cat {WATCHED}").out or None)
    host.stop()
    host.start()
    host.until_component("pad", "ready")
    assert "opened" not in machine.run(f"cat {WATCHED}"), machine.run(f"cat {WATCHED}")
    machine.run(f"dd if={idle[-1]} of=/dev/null count=0 iflag=nonblock 2>/dev/null; true")
    machine.until("an open", lambda: "opened" in machine.run(f"cat {WATCHED}") or None)
