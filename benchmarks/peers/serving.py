"""The process that is called: `python -m benchmarks.peers.serving KIND KEYS`.

It tells where it listens, and answers every call alike; by the peer link, also as a task that could
be cancelled.
"""

from __future__ import annotations

import asyncio
import importlib
import json
import sys
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

import msgpack
import zmq
import zmq.asyncio
from benchmarks import zmq_calls
from benchmarks.measuring import REPLY

from nondum.transport.peers import (
    Admission,
    HostKeys,
    Identity,
    IncomingCall,
    Lease,
    Loss,
    PeerKey,
    PeerNode,
    Trust,
)
from nondum.transport.peers.allowance import Allowance
from nondum.transport.peers.events import PeerEvent

SERVING_NAME = "serving"
ZENOH_KEY = "bench/call"
Keys = Mapping[str, str]


class Answering:
    """Serves one thing; at once, or as a task that can be cancelled."""

    def serve(self, incoming: IncomingCall) -> dict[str, str] | Awaitable[dict[str, str]]:
        return REPLY if incoming.method == "now" else self.later()

    async def later(self) -> dict[str, str]:
        return REPLY

    def notice(self, caller: Admission, method: str, args: dict[str, Any]) -> None: ...

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        return Lease.STOP


def node(mine: Identity, theirs: PeerKey, on_event: Callable[[PeerEvent], None]) -> PeerNode:
    """One of two ends, which may call as often as it can."""
    trust = Trust().with_paired(theirs, "other")
    unbounded = Allowance(per_s=1e9, burst=1e9)
    return PeerNode(mine, trust, Answering(), on_event=on_event, allowance=unbounded)


async def by_peers(keys: Keys) -> None:
    pair = HostKeys(PeerKey(keys["public"]), keys["secret"]) if keys["secret"] else None
    serving = node(Identity(SERVING_NAME, pair), PeerKey(keys["client"]), lambda event: None)
    tell(*await serving.start(["tcp://127.0.0.1:0"]))
    await asyncio.Event().wait()


async def by_zmq(keys: Keys) -> None:
    router = zmq.asyncio.Context.instance().socket(zmq.ROUTER)
    router.curve_server, router.curve_secretkey = True, keys["secret"].encode()
    tell(f"tcp://127.0.0.1:{router.bind_to_random_port('tcp://127.0.0.1')}")
    await zmq_calls.answer(router, REPLY)


async def by_grpc(_keys: Keys) -> None:
    grpc: Any = importlib.import_module("grpc")

    async def answer(request: bytes, _context: object) -> bytes:
        msgpack.unpackb(request)
        return bytes(msgpack.packb(REPLY))

    server = grpc.aio.server()
    handler = grpc.unary_unary_rpc_method_handler(answer)
    generic = grpc.method_handlers_generic_handler("Bench", {"Call": handler})
    server.add_generic_rpc_handlers((generic,))
    tell(f"127.0.0.1:{server.add_insecure_port('127.0.0.1:0')}")
    await server.start()
    await server.wait_for_termination()


async def by_zenoh(keys: Keys) -> None:
    """Zenoh's own thread answers, without a hop to the loop."""

    def answer(query: Any) -> None:
        msgpack.unpackb(query.payload.to_bytes())
        query.reply(ZENOH_KEY, msgpack.packb(REPLY))

    with zenoh_session({"listen/endpoints": [keys["listen"]]}) as session:
        session.declare_queryable(ZENOH_KEY, answer, complete=True)
        tell(keys["listen"])
        await asyncio.Event().wait()


def zenoh_session(settings: Mapping[str, object]) -> Any:
    """A session of two peers over TCP, without a router and without discovery."""
    zenoh: Any = importlib.import_module("zenoh")
    config = zenoh.Config()
    alone = {
        "mode": "peer",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
    }
    for name, value in {**alone, **settings}.items():
        config.insert_json5(name, json.dumps(value))
    return zenoh.open(config)


def tell(address: str) -> None:
    """Where to call."""
    sys.stdout.write(f"{address}\n")
    sys.stdout.flush()


SERVING = {"peers": by_peers, "zmq": by_zmq, "grpc": by_grpc, "zenoh": by_zenoh}

if __name__ == "__main__":
    asyncio.run(SERVING[sys.argv[1]](json.loads(sys.argv[2])))
