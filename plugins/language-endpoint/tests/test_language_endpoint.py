"""The plugin on the bench, against servers that answer well, badly, without end, or not at all."""

from __future__ import annotations

import datetime
import ipaddress
import json
import socket
import ssl
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tiny_model
import xllamacpp
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from nondum.sdk import WorkerFailed

from . import replies
from .replies import CHOSEN, http, saying
from .scripted_server import Reply, Scripted, scripted

PLUGIN = "nondum_language_endpoint.plugin:LanguageEndpoint"
VOCABULARY = {
    "host": "robot",
    "phrases": [
        {"words": "follow me", "slots": {}},
        {"words": "search for {class}", "slots": {"class": ["people", "pedestrians"]}},
    ],
}


def begin(worker: Any, server: Scripted, scheme: str = "http", **settings: Any) -> Any:
    url = f"{scheme}://127.0.0.1:{server.port}/v1"
    return worker(PLUGIN, settings={"url": url, "seconds": 30.0, **settings})


def ask(bench: Any, words: str = "is anybody in here?") -> str | None:
    return bench.ask("translate_goal", words=words, vocabulary=VOCABULARY).get("words")  # type: ignore[no-any-return]


def always(said: bytes) -> Callable[[Scripted], Reply]:
    return lambda _server: lambda client: client.sendall(said)


def dripping(head: bytes, drop: bytes) -> Callable[[Scripted], Reply]:
    """Says something at once, and the rest a bit at a time until the test is over."""

    def reply(server: Scripted) -> Reply:
        def drip(client: socket.socket) -> None:
            client.sendall(head)
            while not server.is_over.wait(0.01):
                client.sendall(drop)

        return drip

    return reply


@pytest.mark.parametrize("said", [replies.LLAMA_CPP, replies.VLLM, replies.OLLAMA])
def test_servers_that_people_run_are_understood(worker: Any, said: bytes) -> None:
    with scripted(always(said)) as server:
        assert ask(begin(worker, server)) == "search for people"


def test_server_is_asked_for_a_phrase_and_nothing_else(worker: Any) -> None:
    with scripted(always(saying(CHOSEN))) as server:
        ask(begin(worker, server, key="secret", model="tiny"), "anybody?")
    head, _, body = server.requests[0].partition(b"\r\n\r\n")
    asked = json.loads(body)
    assert head.startswith(b"POST /v1/chat/completions ")
    assert b"\r\nAuthorization: Bearer secret" in head
    assert (asked["model"], asked["temperature"], asked["stream"]) == ("tiny", 0, False)
    assert asked["messages"][1] == {"role": "user", "content": "anybody?"}
    assert "search for {class}" in asked["messages"][0]["content"]
    assert asked["response_format"]["json_schema"]["strict"] is True


def test_llama_cpp_itself_is_understood(worker: Any, tmp_path: Path) -> None:
    """With random weights, which choose by chance."""
    parameters = xllamacpp.CommonParams()
    parameters.model.path = str(tiny_model.write(tmp_path / "tiny.gguf"))
    parameters.hostnames, parameters.port = ["127.0.0.1"], 0
    parameters.n_ctx, parameters.n_parallel, parameters.verbosity = 2048, 1, -1
    parameters.cpuparams.n_threads = parameters.cpuparams_batch.n_threads = 1
    parameters.warmup = parameters.ui = False
    server = xllamacpp.Server(parameters)
    bench = worker(PLUGIN, settings={"url": f"{server.listening_address}/v1", "seconds": 30.0})
    chosen = ask(bench)
    assert chosen in {"follow me", "search for people", "search for pedestrians", None}
    assert ask(bench) == chosen


@pytest.mark.parametrize(
    "content",
    [
        "I would search for people.",
        CHOSEN[:-3],
        '{"goal": {"pattern": "drive away", "slots": {}}}',
        '{"goal": {"pattern": "search for {class}", "slots": {"class": "tanks"}}}',
        '{"goal": "unknown"}',
        f"```json\n{CHOSEN}\n```",
    ],
)
def test_answer_that_is_no_choice_is_not_taken(worker: Any, content: str) -> None:
    with scripted(always(saying(content))) as server:
        assert ask(begin(worker, server)) is None


@pytest.mark.parametrize(
    ("said", "code"),
    [
        (http(b"<html>Sign in</html>", kind="text/html"), "ENDPOINT_ANSWER"),
        (http(b'{"choices": []}'), "ENDPOINT_ANSWER"),
        (http(b'{"choices": [{"message": {"content": null}}]}'), "ENDPOINT_ANSWER"),
        (http(b'{"choices": [{"mess'), "ENDPOINT_ANSWER"),
        (http(b"[" * 100_000), "ENDPOINT_ANSWER"),
        (http(b"{}")[:-1], "ENDPOINT_ANSWER"),
        (b"SSH-2.0-OpenSSH_9.2\r\n", "ENDPOINT_ANSWER"),
        (b"", "ENDPOINT_ANSWER"),
        (http(b"no such model", "404 Not Found"), "ENDPOINT_STATUS"),
        (http(b"", "302 Found\r\nLocation: http://127.0.0.1:1/"), "ENDPOINT_STATUS"),
        (http(b"", "500 Internal Server Error"), "ENDPOINT_STATUS"),
        (http(b"x" * 10_000_000), "ENDPOINT_TOO_LONG"),
    ],
    ids=lambda value: value[:30] if isinstance(value, bytes) else None,
)
def test_wrong_answers_have_one_code_each(worker: Any, said: bytes, code: str) -> None:
    with scripted(always(said)) as server, pytest.raises(WorkerFailed) as caught:
        ask(begin(worker, server))
    assert caught.value.code == code


def test_answer_without_end_is_cut(worker: Any) -> None:
    endless = dripping(b"HTTP/1.1 200 OK\r\n\r\n", b"x" * 500_000)
    with scripted(endless) as server, pytest.raises(WorkerFailed) as caught:
        ask(begin(worker, server))
    assert caught.value.code == "ENDPOINT_TOO_LONG"


@pytest.mark.parametrize(
    "head", [b"", b"HTTP/1.1 200 OK\r\nX-A: ", b"HTTP/1.1 200 OK\r\nContent-Length: 99\r\n\r\n{"]
)
def test_server_that_drips_is_left_in_time(worker: Any, head: bytes) -> None:
    """And nothing of the worker goes on waiting: it answers the next one."""
    with scripted(dripping(head, b" ")) as slow:
        bench = begin(worker, slow, seconds=0.5)
        for _ in range(3):
            with pytest.raises(WorkerFailed) as caught:
                ask(bench)
            assert caught.value.code == "ENDPOINT_OVERDUE"


def test_server_without_an_answer_to_tls_is_left_in_time(worker: Any) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"https://127.0.0.1:{silent.getsockname()[1]}/v1"
        bench = worker(PLUGIN, settings={"url": url, "seconds": 0.5})
        with pytest.raises(WorkerFailed) as caught:
            ask(bench)
    assert caught.value.code == "ENDPOINT_OVERDUE"


def test_server_that_is_not_there_is_told(worker: Any) -> None:
    with scripted(always(b"")) as gone:
        pass
    with pytest.raises(WorkerFailed) as caught:
        ask(begin(worker, gone))
    assert caught.value.code == "ENDPOINT_UNREACHABLE"


def test_host_name_that_is_none_is_told(worker: Any) -> None:
    bench = worker(PLUGIN, settings={"url": "http://mule..local:1/v1"})
    with pytest.raises(WorkerFailed) as caught:
        ask(bench)
    assert caught.value.code == "ENDPOINT_UNREACHABLE"


def test_no_server_is_asked_where_none_is_named(worker: Any) -> None:
    assert ask(worker(PLUGIN)) is None


@pytest.mark.parametrize(
    "settings",
    [
        *({"url": url} for url in ("mule:8080", "ftp://mule", "http://", "http://mule:x/v1")),
        *({"url": url} for url in ("http://mule/v 1", "http://mule/ü", "http://mule/\n")),
        *({"key": "two\nlines"}, {"key": "schlüssel"}, {"authority": "ü"}),
        *({"seconds": 0}, {"answer_tokens": 1}),
    ],
)
def test_wrong_settings_are_refused(worker: Any, settings: dict[str, Any]) -> None:
    with pytest.raises(WorkerFailed):
        worker(PLUGIN, settings=settings)


def certificate(folder: Path, name: x509.GeneralName) -> tuple[ssl.SSLContext, str]:
    """A server's context with a certificate that signs itself, and that certificate's PEM."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "mule")])
    now = datetime.datetime.now(datetime.UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([name]), critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    pem = made.public_bytes(serialization.Encoding.PEM)
    private = key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    file = folder / "server.pem"
    file.write_bytes(private + pem)
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.load_cert_chain(file)
    return context, pem.decode()


def address(text: str) -> x509.GeneralName:
    return x509.IPAddress(ipaddress.ip_address(text))


def test_server_that_proves_itself_is_asked(worker: Any, tmp_path: Path) -> None:
    context, pem = certificate(tmp_path, address("127.0.0.1"))
    with scripted(always(saying(CHOSEN)), context) as server:
        assert ask(begin(worker, server, "https", authority=pem)) == "search for people"


@pytest.mark.parametrize("is_known", [True, False])
def test_another_hosts_certificate_is_refused(worker: Any, tmp_path: Path, is_known: bool) -> None:
    name = address("127.0.0.2") if is_known else address("127.0.0.1")
    context, pem = certificate(tmp_path, name)
    settings = {"authority": pem} if is_known else {}
    with scripted(always(saying(CHOSEN)), context) as server:
        bench = begin(worker, server, "https", **settings)
        with pytest.raises(WorkerFailed) as caught:
            ask(bench)
    assert caught.value.code == "ENDPOINT_TLS"
    assert server.requests == []


def test_authority_that_is_no_certificate_is_told(worker: Any) -> None:
    with scripted(always(b"")) as server, pytest.raises(WorkerFailed) as caught:
        ask(begin(worker, server, "https", authority="-----BEGIN"))
    assert caught.value.code == "ENDPOINT_TLS"
