"""Frames in sealed shared memory: one memfd per slot (memfd_create(2), fcntl(2) F_ADD_SEALS).

The producer maps a slot for writing, then seals it, so that no holder of the descriptor can shrink
it under a reader, grow it, or write to it. The producer alone counts who still reads a slot.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import itertools
import mmap
import os
import resource
import weakref
from collections.abc import Callable, Iterable, Iterator

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.messages import Buffer
from nondum.sdk.packets import Handle, discard

F_SEAL_FUTURE_WRITE = 0x10  # Linux 5.1; Python names it from 3.13 on
SEALS = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | F_SEAL_FUTURE_WRITE

MAX_SLOTS = 64
"""Slots of one stream that live at once."""
MAX_SLOT_BYTES = 256 * 1024 * 1024
BLOCK = 512
"""st_blocks, in bytes (stat(3type))."""


class Slot:
    """A place for one frame, as its producer has it.

    It is handed over once a frame was written to it: then all of its pages are there.
    """

    __slots__ = ("descriptor", "id", "memory", "readers", "size")

    def __init__(self, slot_id: int, size: int) -> None:
        self.id = slot_id
        self.size = size
        self.readers = 0
        """How many hand-overs of it are unreleased, or waiting."""
        self.descriptor = os.memfd_create("nondum-slot", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        try:
            os.ftruncate(self.descriptor, size)
            self.memory = mmap.mmap(self.descriptor, size)
            fcntl.fcntl(self.descriptor, fcntl.F_ADD_SEALS, SEALS | fcntl.F_SEAL_SEAL)
        except OSError as error:
            os.close(self.descriptor)
            raise _no_memory(size, error) from error
        except BaseException:
            os.close(self.descriptor)
            raise

    def close(self) -> None:
        """Let go of the memory; readers' own mappings live on, and views of it here."""
        with contextlib.suppress(BufferError):  # somebody has a view: its end is the memory's
            self.memory.close()
        os.close(self.descriptor)


class SlotRing:
    """A producer's slots. Not a queue: a frame goes to any slot that has no reader."""

    def __init__(self) -> None:
        self._slots: dict[int, Slot] = {}
        self._next_id = 1

    def __len__(self) -> int:
        return len(self._slots)

    @property
    def held(self) -> int:
        """Slots with readers."""
        return sum(1 for slot in self._slots.values() if slot.readers)

    def write(self, pieces: Iterable[Buffer], length: int) -> Slot | None:
        """Copy `length` bytes, piece by piece, into a slot that has no reader; None when all have
        readers.

        Raises `OSError` when the system has no memory or descriptors left.
        """
        slot = self._free_slot(length)
        if slot is not None:
            at = 0
            for piece in pieces:
                end = at + memoryview(piece).nbytes
                slot.memory[at:end] = piece
                at = end
        return slot

    def retire(self, keep: int, length: int = 0) -> Iterator[int]:
        """Let go of unread slots shorter than `length`, and of those beyond `keep`; give their ids.

        Readers must be told, so that they unmap them.
        """
        for slot in list(self._slots.values()):
            if not slot.readers and (slot.size < length or len(self._slots) > keep):
                del self._slots[slot.id]
                slot.close()
                yield slot.id

    def close(self) -> None:
        """Let go of all slots."""
        for slot in self._slots.values():
            slot.close()
        self._slots.clear()

    def _free_slot(self, length: int) -> Slot | None:
        for slot in self._slots.values():
            if not slot.readers and slot.size >= length:
                return slot
        if len(self._slots) >= MAX_SLOTS:
            return None
        slot = Slot(self._next_id, -(-length // mmap.PAGESIZE) * mmap.PAGESIZE)
        self._next_id += 1
        self._slots[slot.id] = slot
        return slot


class MappedSlots:
    """A consumer's view of a producer's slots; believes nothing."""

    def __init__(self) -> None:
        self._slots: dict[int, mmap.mmap] = {}
        self._lent: dict[int, weakref.ref[object]] = {}
        self._loans = itertools.count()

    @property
    def lent(self) -> int:
        """Views that somebody still holds."""
        return len(self._lent)

    def add(self, slot_id: int, handle: Handle) -> None:
        """Map a slot whose descriptor was handed over, and close that.

        Raises `ProtocolViolation` (SLOT_SEALS, SLOT_SIZE, SLOT_HOLES, SLOT_UNKNOWN).
        """
        try:
            if slot_id in self._slots or len(self._slots) >= MAX_SLOTS:
                raise _violation("SLOT_UNKNOWN", f"slot {slot_id} is one too many")
            if not isinstance(handle, int):
                raise _violation("SLOT_SEALS", "a slot is no sealed memory")
            self._slots[slot_id] = _map_sealed(handle)
        finally:
            discard((handle,))

    def check(self, slot_id: int, length: int) -> mmap.mmap:
        """Give the slot's memory if the slot is known and as long as claimed."""
        memory = self._slots.get(slot_id)
        if memory is None:
            raise _violation("SLOT_UNKNOWN", f"slot {slot_id} was never handed over")
        if not 0 <= length <= len(memory):
            raise _violation("SLOT_LENGTH", f"{length} bytes in a slot of {len(memory)}")
        return memory

    def copy(self, slot_id: int, length: int) -> bytes:
        """Copy a frame out of its slot. Raises `ProtocolViolation`."""
        return self.check(slot_id, length)[:length]

    def lend(self, slot_id: int, length: int, on_return: Callable[[], None]) -> memoryview:
        """Give a read-only view of a frame in its slot. Raises `ProtocolViolation`.

        `on_return` is called, in whichever thread, as soon as nothing looks at the frame any more:
        no slice of the view, no numpy array on it.
        """
        import ctypes  # for this only: most workers never see a frame

        # Every view of a buffer keeps its exporter alive, and this exporter is this frame's own.
        exporter = (ctypes.c_ubyte * length).from_buffer(self.check(slot_id, length))
        loan, lent = next(self._loans), self._lent

        def returned(_: object) -> None:
            del lent[loan]
            on_return()

        lent[loan] = weakref.ref(exporter, returned)
        return memoryview(exporter).cast("B").toreadonly()

    def remove(self, slot_id: int) -> None:
        """Let go of a slot that its producer has retired; views of it stay valid."""
        self._slots.pop(slot_id, None)

    def close(self) -> None:
        """Let go of all slots; views stay valid, and are not asked back."""
        self._slots.clear()
        self._lent.clear()


def _map_sealed(descriptor: int) -> mmap.mmap:
    try:
        seals = fcntl.fcntl(descriptor, fcntl.F_GET_SEALS)
        found = os.fstat(descriptor)
        size, allocated = found.st_size, found.st_blocks * BLOCK
        if seals & SEALS != SEALS:  # without them the producer could shrink it under the reader
            raise _violation("SLOT_SEALS", f"a slot has the seals {seals:#x}, not {SEALS:#x}")
        if not 0 < size <= MAX_SLOT_BYTES:
            raise _violation("SLOT_SIZE", f"a slot has {size} bytes")
        if allocated < size:  # the memory for the rest would be the reader's; its seals keep it so
            raise _violation("SLOT_HOLES", f"{allocated} bytes are there of a slot of {size}")
        # Private, so that it may be mapped for writing, which ctypes asks for; no code ever writes,
        # and pages that are only read are the producer's own.
        return mmap.mmap(descriptor, size, access=mmap.ACCESS_COPY)
    except (OSError, ValueError) as error:  # no memfd at all, or not mappable
        raise _violation("SLOT_SEALS", f"a slot is no sealed memory: {error}") from error


def _no_memory(size: int, error: OSError) -> OSError:
    """The error of a message that the system gives no memory for: how many bytes, and the limit
    that it met, if it is that."""
    told = f"there is no memory for a message of {size} bytes ({error.strerror})"
    most, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    if error.errno == errno.EFBIG:
        told += f"; the host's [workers] file_mb lets a worker have {most} bytes in one piece"
    return OSError(error.errno, told)


def _violation(code: str, message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem(code, message))
