"""Runs what the laboratory asks for: JSON lines over a virtio serial port, in and out.

    {"id": 1, "run": ["nondum", "status"], "stdin": "", "timeout_s": 60}
    {"id": 1, "status": 0, "out": "…", "err": "…"}          (base64; status 124: it took too long)
    {"id": 2, "put": "/etc/nondum/host.toml", "data": "…", "mode": 420}

Each request runs in its own thread, so that one may watch while another acts.
"""

import base64
import json
import os
import subprocess
import threading
import time
from pathlib import Path

PORT = Path("/dev/virtio-ports/org.nondum.lab")
TOO_LONG = 124
ENVIRONMENT = {
    "PATH": "/opt/nondum/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
    "HOME": "/root",
    "LANG": "C.UTF-8",
    "COLUMNS": "200",
}


def main() -> None:
    """Serve until the machine goes down."""
    while not PORT.exists():
        time.sleep(0.05)
    line = os.open(PORT, os.O_RDWR)
    lock = threading.Lock()

    def answer(reply: dict) -> None:  # type: ignore[type-arg]
        left = json.dumps(reply).encode() + b"\n"
        with lock:
            while left:
                left = left[os.write(line, left) :]

    answer({"hello": Path("/proc/sys/kernel/random/boot_id").read_text().strip()})
    pending = b""
    while True:
        chunk = os.read(line, 65536)
        if not chunk:  # no process is at the other end
            time.sleep(0.1)
        *lines, pending = (pending + chunk).split(b"\n")
        for request in lines:
            serving = (json.loads(request), answer)
            threading.Thread(target=serve, args=serving, daemon=True).start()


def serve(request: dict, answer) -> None:  # type: ignore[no-untyped-def,type-arg]
    """Do one thing, and say how it went."""
    try:
        reply = run(request) if "run" in request else put(request)
    except Exception as error:  # whatever it is, who asked must hear of it
        reply = {"status": 126, "out": "", "err": encoded(f"{error!r}\n".encode())}
    answer({"id": request["id"], **reply})


def run(request: dict) -> dict:  # type: ignore[type-arg]
    """Run a program."""
    with subprocess.Popen(
        request["run"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=ENVIRONMENT,
        cwd="/root",
        start_new_session=True,
    ) as process:
        try:
            out, err = process.communicate(
                base64.b64decode(request.get("stdin", "")), request["timeout_s"]
            )
            status = process.returncode
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, 9)
            out, err = process.communicate()
            status = TOO_LONG
    return {"status": status, "out": encoded(out), "err": encoded(err)}


def put(request: dict) -> dict:  # type: ignore[type-arg]
    """Write a file, and the folders that lead to it."""
    path = Path(request["put"])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(base64.b64decode(request["data"]))
    path.chmod(request["mode"])
    return {"status": 0, "out": "", "err": ""}


def encoded(data: bytes) -> str:
    """Bytes as JSON can have them."""
    return base64.b64encode(data).decode()


if __name__ == "__main__":
    main()
