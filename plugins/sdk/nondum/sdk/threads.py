"""Plain functions as behaviours: each has its own thread, and a context whose calls wait."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import logging
import threading
from collections.abc import Callable, Coroutine, Iterator, Mapping
from pathlib import Path
from typing import Any, Generic, TypeVar

from nondum.sdk.context import Context, InputStream, OutputStream
from nondum.sdk.messages import Message
from nondum.sdk.workplace import Data, Device

_T = TypeVar("_T")
_M = TypeVar("_M", bound=Message)


class Crossing:
    """The way from a behaviour's thread to the worker's loop, until the behaviour is halted."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._waiting: set[concurrent.futures.Future[Any]] = set()
        self._lock = threading.Lock()
        self.is_halted = False

    def wait(self, work: Coroutine[Any, Any, _T]) -> _T:
        """Run a coroutine on the loop and wait for it. Raises `CancelledError` once halted."""
        with self._lock:
            if self.is_halted:
                work.close()
                raise asyncio.CancelledError
            future = asyncio.run_coroutine_threadsafe(work, self._loop)
            self._waiting.add(future)
        try:
            return future.result()
        except concurrent.futures.CancelledError:
            raise asyncio.CancelledError from None
        finally:
            with self._lock:
                self._waiting.discard(future)

    def call(self, function: Callable[..., _T], *arguments: Any, **keywords: Any) -> _T:
        """Call a function on the loop and wait for its result."""

        async def called() -> _T:
            return function(*arguments, **keywords)

        return self.wait(called())

    def halt(self) -> None:
        """Wake what waits, and refuse all that comes."""
        with self._lock:
            self.is_halted = True
            waiting = tuple(self._waiting)
        for future in waiting:
            future.cancel()


class ThreadOutputStream:
    """An `OutputStream` for a thread."""

    def __init__(self, stream: OutputStream, crossing: Crossing) -> None:
        self._stream, self._crossing = stream, crossing

    @property
    def stream(self) -> str:
        """The stream's object name."""
        return self._stream.stream

    def send(self, message: Message) -> None:
        """Hand a message to everyone who reads the stream (see `OutputStream.send`)."""
        stream = self._stream
        stream.faults.watch(stream.pass_on, message, carry=self._crossing.call)


class ThreadInputStream(Generic[_M]):
    """An `InputStream` for a thread: `for message in stream`, newest wins."""

    def __init__(self, stream: InputStream[_M], crossing: Crossing) -> None:
        self._stream, self._crossing = stream, crossing

    @property
    def is_connected(self) -> bool:
        """Whether a producer is wired to it now."""
        return self._stream.is_connected

    @property
    def latest(self) -> _M | None:
        """The newest message; None when there is none (any more)."""
        return self._crossing.call(lambda: self._stream.latest)

    def next(self, timeout_s: float | None = None) -> _M:
        """Wait for a new message. Raises `TimeoutError` when none comes within `timeout_s`."""
        return self._crossing.wait(self._stream.next(timeout_s))

    def __iter__(self) -> Iterator[_M]:
        while True:
            yield self.next()


class ThreadContext:
    """What a plain function is given: a `Context` whose calls wait.

    When the behaviour is halted, every call raises `asyncio.CancelledError`; a function that
    computes for long looks at `is_halted` in between.
    """

    def __init__(self, context: Context, crossing: Crossing) -> None:
        self._context, self._crossing = context, crossing
        self.unit = context.unit
        """Object name of the acting unit; empty in hooks and conditions."""
        self.arguments: Mapping[str, str] = context.arguments
        """The action's parameters, without question marks → objects."""
        self.log: logging.Logger = context.log
        """Goes to the host's logs."""
        self.host = context.host
        """The host's name, which is also its object and body frame."""
        self.component = context.component
        """The component's id."""
        self.objects = context.objects
        """Local names of units and output slots → objects."""
        self.settings = context.settings
        """The component's settings."""
        self.scratch: Path = context.scratch
        """A folder of the component's own."""

    @property
    def is_halted(self) -> bool:
        """Whether the behaviour has been halted and the function should return."""
        return self._crossing.is_halted

    def device(self, name: str) -> Device | None:
        """See `Context.device`."""
        return self._crossing.call(self._context.device, name)

    def data(self, name: str) -> Data | None:
        """See `Context.data`."""
        return self._crossing.call(self._context.data, name)

    def input(self, stream: str) -> ThreadInputStream[Any]:
        """See `Context.input`."""
        opened = self._crossing.call(self._context.input, stream)
        return ThreadInputStream(opened, self._crossing)

    def optional_input(self, slot: str, unit: str | None = None) -> ThreadInputStream[Any]:
        """See `Context.optional_input`."""
        opened = self._crossing.call(self._context.optional_input, slot, unit)
        return ThreadInputStream(opened, self._crossing)

    def output(self, name: str) -> ThreadOutputStream:
        """See `Context.output`."""
        return ThreadOutputStream(self._crossing.call(self._context.output, name), self._crossing)

    def established(self) -> None:
        """See `Context.established`."""
        self._crossing.wait(self._context.established())

    def progress(self, fraction: float, text: str = "") -> None:
        """See `Context.progress`."""
        self._crossing.call(self._context.progress, fraction, text)

    def know(self, predicate: str, *objects: str, value: Message | None = None) -> None:
        """See `Context.know`."""
        context, carry = self._context, self._crossing.call
        context.faults.watch(context.say, predicate, *objects, value=value, carry=carry)

    def forget(self, predicate: str, *objects: str) -> None:
        """See `Context.forget`."""
        self._crossing.call(self._context.forget, predicate, *objects)

    def value(self, predicate: str, *objects: str) -> Any:
        """See `Context.value`."""
        return self._crossing.call(self._context.value, predicate, *objects)

    def transform(self, value: _M, to: str) -> _M:
        """See `Context.transform`."""
        return self._crossing.call(lambda: self._context.transform(value, to))

    def sleep(self, seconds: float) -> None:
        """Wait; ends early, with `CancelledError`, when halted."""
        self._crossing.wait(asyncio.sleep(seconds))


async def run_in_thread(
    function: Callable[..., Any], context: Context, *arguments: Any, **keywords: Any
) -> Any:
    """Call `function(thread context, …)` in a new thread and wait for its end.

    Cancelled, it halts the thread and still waits for it: a behaviour has not ended while its
    code runs. The thread is a daemon: one that never ends does not keep the process.
    """
    loop = asyncio.get_running_loop()
    crossing = Crossing(loop)
    ended: asyncio.Future[Any] = loop.create_future()

    def settle(result: Any, error: BaseException | None) -> None:
        if error is not None:
            ended.set_exception(error)
        else:
            ended.set_result(result)

    def run() -> None:
        outcome: tuple[Any, BaseException | None]
        try:
            outcome = (function(ThreadContext(context, crossing), *arguments, **keywords), None)
        except asyncio.CancelledError:
            outcome = (None, RuntimeError("cancelled itself without being halted"))
        except StopIteration as error:  # which a future cannot carry
            outcome = (None, RuntimeError(f"StopIteration: {error}"))
        except Exception as error:
            outcome = (None, error)
        except BaseException as error:  # SystemExit would end the whole worker
            outcome = (None, RuntimeError(f"{type(error).__name__}: {error}"))
        with contextlib.suppress(RuntimeError):  # the loop is closed: no task waits any more
            loop.call_soon_threadsafe(settle, *outcome)

    threading.Thread(target=run, name=getattr(function, "__name__", "call"), daemon=True).start()
    try:
        return await asyncio.shield(ended)
    except asyncio.CancelledError:
        crossing.halt()
        await asyncio.wait([ended])
        ended.exception()  # mark as seen
        raise
