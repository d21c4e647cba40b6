"""The plugin on the bench, with llama.cpp itself and models of random weights.

Such a model understands nothing: what it chooses is by chance, and must be one of what there is.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
from pathlib import Path
from typing import Any

import pytest
import tiny_model

from nondum.sdk import WorkerFailed

PLUGIN = "nondum_language_model.plugin:LanguageModel"
VOCABULARY = {
    "host": "robot",
    "phrases": [
        {"words": "follow me", "slots": {}},
        {"words": "search for {class}", "slots": {"class": ["people", "pedestrians"]}},
    ],
}
SAID = {"follow me", "search for people", "search for pedestrians", None}


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("models")
    return [tiny_model.write(folder / f"{seed}.gguf", seed) for seed in range(6)]


def begin(worker: Any, model: Path, **settings: Any) -> Any:
    return worker(PLUGIN, data={"model": model}, settings={"threads": 1, **settings})


def ask(bench: Any, words: str = "look for somebody", **vocabulary: Any) -> str | None:
    said = bench.ask("translate_goal", words=words, vocabulary={**VOCABULARY, **vocabulary})
    assert set(said) <= {"words"}
    return said.get("words")  # type: ignore[no-any-return]


def test_what_it_chooses_is_what_there_is(worker: Any, models: list[Path]) -> None:
    answers = [ask(begin(worker, model)) for model in models]
    assert set(answers) <= SAID
    assert any(answers), "none of six chose a phrase"


def test_it_chooses_the_same_again(worker: Any, models: list[Path]) -> None:
    bench = begin(worker, models[0])
    assert ask(bench) == ask(bench)


def processes(model: Path) -> list[int]:
    """Those that hold a model."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            words = (folder / "cmdline").read_bytes().split(b"\0")
            if b"nondum_language_model.model_process" in words and str(model).encode() in words:
                found.append(int(folder.name))
    return found


def process_ended(pid: int) -> bool:
    """Wait for the end of a process."""
    watched = os.pidfd_open(pid)
    try:
        return bool(select.select([watched], [], [], 30)[0])
    finally:
        os.close(watched)


def test_crash_of_the_model_costs_one_answer(worker: Any, models: list[Path]) -> None:
    bench = begin(worker, models[0])
    before = ask(bench)
    (process,) = processes(models[0])
    os.kill(process, signal.SIGKILL)
    with pytest.raises(WorkerFailed) as caught:
        ask(bench)
    assert caught.value.code == "MODEL_ENDED"
    assert ask(bench) == before


def test_model_that_is_pulled_is_not_held(worker: Any, models: list[Path]) -> None:
    bench = begin(worker, models[0])
    ask(bench)
    (process,) = processes(models[0])
    bench.hide("model")
    assert process_ended(process)
    assert ask(bench) is None


def test_model_ends_with_its_worker(worker: Any, models: list[Path]) -> None:
    bench = begin(worker, models[0])
    ask(bench)
    bench.stop()
    assert processes(models[0]) == []


def test_robot_that_knows_no_phrases_is_not_helped(worker: Any, models: list[Path]) -> None:
    assert ask(begin(worker, models[0]), phrases=[]) is None


def test_model_is_loaded_in_advance(worker: Any, models: list[Path]) -> None:
    bench = begin(worker, models[0])
    call = bench.behave("load", u="model", h=bench.host)
    call.wait_established()
    assert ask(bench) in SAID
    assert call.halt().state == "halted"


@pytest.mark.parametrize("content", [b"", b"GGUF", b"\x00" * 4096])
def test_file_that_is_no_model_is_told(worker: Any, tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.gguf"
    path.write_bytes(content)
    bench = begin(worker, path)
    call = bench.behave("load", u="model", h=bench.host)
    call.assert_failed("WEIGHTS_UNREADABLE")
    with pytest.raises(WorkerFailed) as caught:
        ask(bench)
    assert caught.value.code == "WEIGHTS_UNREADABLE"


def test_cut_model_is_told(worker: Any, tmp_path: Path, models: list[Path]) -> None:
    path = tmp_path / "cut.gguf"
    path.write_bytes(models[0].read_bytes()[:200_000])
    bench = begin(worker, path)
    bench.behave("load", u="model", h=bench.host).assert_failed("WEIGHTS_UNREADABLE")


def test_more_words_than_fit_are_refused(worker: Any, models: list[Path]) -> None:
    bench = begin(worker, models[0], context_tokens=512)
    with pytest.raises(WorkerFailed) as caught:
        ask(bench, "please " * 500)
    assert caught.value.code == "MODEL_REFUSED"


def test_answer_that_takes_too_long_is_broken_off(worker: Any, models: list[Path]) -> None:
    bench = begin(worker, models[0], seconds=1e-9)
    with pytest.raises(WorkerFailed) as caught:
        ask(bench)
    assert caught.value.code == "MODEL_OVERDUE"


def test_other_weights_are_taken(worker: Any, models: list[Path], tmp_path: Path) -> None:
    bench = begin(worker, models[0])
    ask(bench)
    bad = tmp_path / "bad.gguf"
    bad.write_bytes(b"no model")
    bench.hide("model")
    assert ask(bench) is None
    bench.show("model", bad)
    with pytest.raises(WorkerFailed) as caught:
        ask(bench)
    assert caught.value.code == "WEIGHTS_UNREADABLE"


@pytest.mark.parametrize("settings", [{"threads": -1}, {"context_tokens": 300}, {"seconds": 0}])
def test_wrong_settings_are_refused(
    worker: Any, models: list[Path], settings: dict[str, Any]
) -> None:
    with pytest.raises(WorkerFailed):
        begin(worker, models[0], **settings)
