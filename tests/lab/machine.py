"""One machine under test: a whole computer, booted, acted upon from outside and from inside."""

from __future__ import annotations

import base64
import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from tests.lab.agent import Agent, CommandFailed, MachineSilent, Outcome
from tests.lab.building import Built
from tests.lab.cache import MODEST, call
from tests.lab.network import FIND, PREFIX, Socket
from tests.lab.qmp import Qmp
from tests.lab.usb import CONTROLLER, Usb

BOOT_S = 400.0
"""Nine seconds on an idle machine; this one may be shared by many."""
PATIENCE_S = 400.0
"""How long a program inside may run, unless its caller says otherwise. All time-outs are those of
an x86_64, and multiplied by the recipe's slowness."""
POLL_S = 0.2
END_S = 1.0
"""From QEMU hanging up until it has ended."""
TICKS_HZ = os.sysconf("SC_CLK_TCK")
T = TypeVar("T")


class Machine:
    """A machine with its own disk, which outlives its boots. Call `close` at last."""

    def __init__(
        self,
        built: Built,
        work: Path,
        *,
        memory_mb: int = 2048,
        drives: tuple[Path, ...] = (),
        socket: Socket | None = None,
    ) -> None:
        """`work` keeps its disk, console and sockets (a short path: see unix(7)); `drives` are
        read-only disks that it has for good, `/dev/vdb` and on; `socket` is where it is plugged
        into a network, if it has one."""
        self.built, self.work, self.socket = built, work, socket
        self._memory_mb, self._drives = memory_mb, drives
        self._qemu: subprocess.Popen[bytes] | None = None
        self._agent: Agent | None = None
        self._qmp: Qmp | None = None
        self._cpu_s = 0.0
        self.replugs = 0
        """How often a stick was plugged in again, because it had stalled."""
        work.mkdir(parents=True, exist_ok=True)
        self._disk = work / "disk.qcow2"
        overlay = ("-q", "-f", "qcow2", "-F", "raw", "-b", built.disk)
        call("qemu-img", "create", *overlay, self._disk)

    # Its life

    def boot(self, *, more: str = "") -> float:
        """Switch it on and wait for the agent; answers how many seconds that took.

        `more` goes on the kernel's command line. Raises `MachineSilent` with its console's end.
        """
        began = time.monotonic()
        self.switch_on(more=more)
        self.until_booted()
        return time.monotonic() - began

    def switch_on(self, *, more: str = "") -> None:
        """The first half of `boot`, so that several boot at once: `until_booted` must follow."""
        with (self.work / "qemu.log").open("ab") as log:
            self._qemu = subprocess.Popen(
                self._command(more), stdin=subprocess.DEVNULL, stdout=log, stderr=log
            )

    def until_booted(self) -> None:
        """The second half of `boot`. Raises `MachineSilent`."""
        try:
            self._qmp = self._connected(lambda: Qmp(self.work / "qmp"))
            self._usb = Usb(self.qmp, self.until)
            self._agent = self._connected(lambda: Agent(self.work / "agent"))
            self._until_up()
        except MachineSilent as error:
            raise MachineSilent(f"{error}{self._status()}\n{self.last_words()}") from None

    def cut_power(self) -> None:
        """End it at once: what its disk was not told to keep is lost."""
        assert self._qemu is not None
        self._cpu_s = self.cpu_s
        self._qemu.send_signal(signal.SIGKILL)
        self._see_end()

    def reset(self) -> None:
        """Press its reset button, and wait for the agent: what is plugged in stays so."""
        self.qmp.do("set-action", reboot="reset")
        self.qmp.do("system_reset")
        self._until_up()

    def shut_down(self, timeout_s: float = BOOT_S) -> None:
        """Have it go down as from its power button's menu."""
        assert self._qemu is not None
        self.agent.run("systemctl", "--no-block", "poweroff")
        self._cpu_s = self.cpu_s
        self._qemu.wait(timeout_s * self.slowness)
        self._see_end()

    def close(self) -> None:
        """End it, if it runs."""
        if self._qemu is not None:
            self.cut_power()

    @property
    def agent(self) -> Agent:
        """What acts in it. Raises `MachineSilent` when it does not run, or not yet."""
        if self._agent is None:
            raise MachineSilent("it is off, or has not booted")
        return self._agent

    @property
    def qmp(self) -> Qmp:
        """Its monitor. Raises `MachineSilent` when it does not run, or not yet."""
        if self._qmp is None:
            raise MachineSilent("it is off")
        return self._qmp

    # What happens inside

    def run(self, command: str, *, timeout_s: float = PATIENCE_S) -> str:
        """Run a line of shell as root; answers its output. Raises `CommandFailed`."""
        outcome = self.attempt(command, timeout_s=timeout_s)
        if outcome.status != 0:
            raise CommandFailed(str(outcome))
        return outcome.out

    def attempt(self, command: str, *, timeout_s: float = PATIENCE_S) -> Outcome:
        """Run a line of shell as root, whatever comes of it."""
        outcome = self.agent.run("/bin/sh", "-c", command, timeout_s=timeout_s * self.slowness)
        with (self.work / "commands.log").open("a", encoding="utf-8") as log:
            log.write(f"$ {command}\n{outcome.out}{outcome.err}[{outcome.status}]\n")
        return outcome

    def put(self, path: str, content: str | bytes, mode: int = 0o644) -> None:
        """Write a file inside."""
        data = content.encode() if isinstance(content, str) else content
        self.agent.put(path, data, mode)

    def get(self, path: str) -> bytes:
        """Read a file inside. Raises `CommandFailed`."""
        outcome = self.agent.run("base64", path, timeout_s=PATIENCE_S)
        if outcome.status != 0:
            raise CommandFailed(str(outcome))
        return base64.b64decode(outcome.out)

    def until(
        self,
        what: str,
        look: Callable[[], T | None],
        timeout_s: float = BOOT_S,
        every_s: float = POLL_S,
    ) -> T:
        """Look until there is something to see. Raises `AssertionError` when there is not."""
        deadline = time.monotonic() + timeout_s * self.slowness
        while (seen := look()) is None:
            if time.monotonic() > deadline:
                raise AssertionError(f"not seen in {timeout_s:.0f} s: {what}")
            time.sleep(every_s)
        return seen

    def wait_for_system(self) -> str:
        """Wait until systemd has started all that it starts; answers its verdict."""
        return self.attempt("systemctl is-system-running --wait", timeout_s=BOOT_S).out.strip()

    # What happens outside

    def plug(self, image: Path, *, port: str | None = None) -> str:
        """Plug a USB stick in, at a free port if none is given (see `usb.py`); answers its name
        for `pull`."""
        return self._usb.plug_stick(image, port)

    def pull(self, name: str) -> None:
        """Pull a stick out, whatever it is doing."""
        self._usb.pull(name)

    def plug_hub(self, port: str | None = None) -> str:
        """Plug a USB hub in, whose ports are then `<port>.1` and on; answers its name."""
        return self._usb.plug_hub(port)

    def unplug(self, name: str) -> None:
        """Pull a hub out, and with it all that is plugged into it."""
        self._usb.pull(name)

    def unplug_all(self) -> None:
        """Pull out all that is plugged in, if it runs."""
        if self._qmp is not None:
            self._usb.pull_all()

    def plug_line(
        self, path: Path | None = None, *, port: str | None = None, serial: str | None = None
    ) -> str:
        """Plug a USB serial adapter in (an FTDI, 0403:6001); answers its name for `pull_line`.

        `path` is the unix socket at which an emulated instrument listens; it is called again
        whenever it hangs up. None: nothing is at the other end.
        """
        return self._usb.plug_line(path, port, serial)

    def plug_device(self, driver: str, *, port: str | None = None) -> str:
        """Plug in what QEMU calls `usb-tablet`, `usb-audio` …; answers its name for `unplug`."""
        return self._usb.plug_device(driver, port)

    def press(self, key: str) -> None:
        """Press and release a key of its keyboard, by QEMU's name for it: `f12`."""
        assert self._qmp is not None, "it runs"
        self._qmp.do("send-key", keys=[{"type": "qcode", "data": key}])

    def pull_line(self, name: str) -> None:
        """Pull a serial adapter out."""
        self._usb.pull(name)

    def cut_cable(self) -> None:
        """Part it from its network, without a word to either."""
        assert self.socket is not None
        self.socket.pull()

    def plug_cable(self) -> None:
        """Join it to its network again."""
        assert self.socket is not None
        self.socket.put_back()

    # What is left to see

    @property
    def slowness(self) -> float:
        """What all time-outs are multiplied by (see `Recipe.slowness`)."""
        return self.built.recipe.slowness

    @property
    def cpu_s(self) -> float:
        """Processor time that it took of the machine it stands on, over all boots."""
        if self._qemu is None or self._qemu.poll() is not None:
            return self._cpu_s
        line = Path(f"/proc/{self._qemu.pid}/stat").read_text(encoding="ascii")
        user, system = line.rpartition(")")[2].split()[11:13]
        return self._cpu_s + (int(user) + int(system)) / TICKS_HZ

    @property
    def console(self) -> Path:
        """All that its terminal showed, over all boots."""
        return self.work / "console.log"

    def last_words(self, lines: int = 30) -> str:
        """The end of its console and of what QEMU said."""
        texts = [self.work / "qemu.log", self.console]
        said = [t.read_text(errors="replace").splitlines()[-lines:] for t in texts if t.exists()]
        return "\n".join(line for part in said for line in part)

    # Inside

    def _status(self) -> str:
        """How QEMU has ended, if it has: 0 when the machine has reset itself."""
        assert self._qemu is not None
        try:
            return f" (status {self._qemu.wait(END_S)})"
        except subprocess.TimeoutExpired:
            return ""

    def _command(self, more: str) -> list[str | Path]:
        recipe = self.built.recipe
        serial = f"file,id=console,path={self.console},append=on"
        disks: list[str] = []
        around, card = (self.socket.around, self.socket.card) if self.socket else ((), ())
        kernel = [f"console={recipe.terminal}", "panic=-1", "quiet", "no_timer_check"]
        kernel.append(f"earlyprintk={recipe.terminal}")  # what it says before there is a console
        if self.socket:
            kernel.append("net.ifnames=0")  # or udev renames its card meanwhile
        for image in self._drives:
            disks += ["-drive", f"file={image},format=raw,if=virtio,readonly=on"]
        return [
            *("setpriv", "--pdeathsig", "KILL", *around, *MODEST, recipe.program),
            *("-nodefaults", "-display", "none", "-no-reboot"),
            *("-accel", "tcg,thread=multi,tb-size=512", *recipe.machine),
            *("-smp", "2", "-m", str(self._memory_mb)),
            *("-kernel", self.built.kernel, "-initrd", self.built.initramfs),
            *("-append", " ".join(filter(None, (*kernel, more)))),
            *("-drive", f"file={self._disk},format=qcow2,if=virtio", *disks),
            *("-chardev", serial, "-serial", "chardev:console"),
            *("-qmp", f"unix:{self.work / 'qmp'},server=on,wait=off"),
            *("-chardev", f"socket,id=agent,path={self.work / 'agent'},server=on,wait=off"),
            *("-device", "virtio-serial"),
            *("-device", "virtserialport,chardev=agent,name=org.nondum.lab"),
            *CONTROLLER,
            *("-device", "virtio-rng", *card),
        ]

    def _until_up(self) -> None:
        self.agent.wait_for_boot(BOOT_S * self.slowness)
        if self.socket is not None:
            self._join(self.socket)

    def _join(self, socket: Socket) -> None:
        """Give its network card its address: nothing else there would."""
        card = self.until("a network card", lambda: self._card(socket) or None)
        self.run(f"ip link set {card} up && ip addr replace {socket.address}/{PREFIX} dev {card}")

    def _card(self, socket: Socket) -> str:
        return self.attempt(FIND.format(mac=socket.mac)).out.strip()

    def _connected(self, connect: Callable[[], T]) -> T:
        deadline = time.monotonic() + BOOT_S * self.slowness
        while time.monotonic() < deadline:
            assert self._qemu is not None
            if self._qemu.poll() is not None:
                raise MachineSilent(f"QEMU exited with {self._qemu.returncode}")
            try:
                return connect()
            except OSError:
                time.sleep(POLL_S)
        raise MachineSilent("QEMU does not listen")

    def _see_end(self) -> None:
        assert self._qemu is not None
        self._qemu.wait()
        self._qemu = None
        for line in (self._agent, self._qmp):
            if line is not None:  # it was heard of before its end
                line.close()
        self._agent = self._qmp = None
