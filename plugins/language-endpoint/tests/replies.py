"""What servers say to a request, as bytes.

`LLAMA_CPP` has the fields that llama.cpp was seen to send (xllamacpp 2026.10), with another choice.
`VLLM` and `OLLAMA` are written after their documentation: neither could be run here.
"""

from __future__ import annotations

import json

CHOSEN = '{"goal": {"pattern": "search for {class}", "slots": {"class": "people"}}}'


def http(body: bytes, status: str = "200 OK", kind: str = "application/json") -> bytes:
    """A whole reply."""
    head = f"HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n\r\n"
    return head.encode() + body


def saying(content: str) -> bytes:
    """The least that a server answers."""
    return http(json.dumps({"choices": [{"message": {"content": content}}]}).encode())


def _as(server: dict[str, object], message: dict[str, object]) -> bytes:
    choice = {"index": 0, "finish_reason": "stop", "message": {"role": "assistant", **message}}
    return http(json.dumps({**server, "object": "chat.completion", "choices": [choice]}).encode())


LLAMA_CPP = _as(
    {
        "id": "chatcmpl-97wzfeczH8XBIgejjEwCslk4XKn2gPlL",
        "created": 1795913177,
        "model": "tiny.gguf",
        "system_fingerprint": "b0-unknown",
        "usage": {"completion_tokens": 26, "prompt_tokens": 50, "total_tokens": 76},
        "timings": {"cache_n": 0, "prompt_n": 50, "prompt_ms": 2.636},
    },
    {"content": CHOSEN},
)
VLLM = _as(
    {
        "id": "chatcmpl-1",
        "created": 1795913177,
        "model": "Qwen/Qwen2.5-1.5B-Instruct",
        "usage": {"prompt_tokens": 50, "total_tokens": 76, "completion_tokens": 26},
        "prompt_logprobs": None,
    },
    {"content": CHOSEN, "reasoning_content": None, "tool_calls": []},
)
OLLAMA = _as(
    {
        "id": "chatcmpl-713",
        "created": 1795913177,
        "model": "qwen2.5:1.5b",
        "system_fingerprint": "fp_ollama",
        "usage": {"prompt_tokens": 50, "completion_tokens": 26, "total_tokens": 76},
    },
    {"content": CHOSEN},
)
