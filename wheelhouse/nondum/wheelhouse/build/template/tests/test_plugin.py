"""The plugin, run in this process over the protocol that hosts speak."""

from __future__ import annotations

import pytest
from nondum.sdk.bench import WorkerFactory

from $module.lamp import Lamp


def test_the_payload_is_one_that_hosts_take(worker: WorkerFactory) -> None:
    worker.check()


def test_shines_until_it_is_halted(worker: WorkerFactory) -> None:
    lamp = worker("$module.plugin")
    call = lamp.behave("shine", u="lamp", h="robot")
    call.wait_established()
    call.halt()
    assert [text for _, text in lamp.logs] == ["lamp on", "lamp off"]


def test_fails_when_the_lamp_goes_out(
    worker: WorkerFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Lamp, "switch_on", lambda self: None)
    lamp = worker("$module.plugin", settings={"check_period_s": 0.001})
    lamp.behave("shine", u="lamp", h="robot").assert_failed()
