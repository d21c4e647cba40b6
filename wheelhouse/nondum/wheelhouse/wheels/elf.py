"""What machine an ELF file is for, by its first bytes (elf(5); System V ABI, chapter 4)."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from types import MappingProxyType

from nondum.sdk.frozen import frozen

HEAD_BYTES = 20
"""e_ident, e_type and e_machine."""
_MAGIC = b"\x7fELF"
_BITS = {1: 32, 2: 64}
_ORDERS = {1: "little", 2: "big"}


@frozen
class Elf:
    """What machine code needs of a processor."""

    bits: int
    order: str
    """`little` or `big`."""
    machine: int
    """e_machine, as elf.h numbers them."""

    @classmethod
    def parse(cls, head: bytes) -> Elf | None:
        """The file that begins so; None: it is no ELF file.

        >>> Elf.parse(bytes.fromhex("7f454c46020101000000000000000000 0300 3e00"))
        Elf(bits=64, order='little', machine=62)
        """
        if len(head) < HEAD_BYTES or not head.startswith(_MAGIC):
            return None
        bits, order = _BITS.get(head[4], 0), _ORDERS.get(head[5], "little")
        (machine,) = struct.unpack_from("<H" if order == "little" else ">H", head, 18)
        return cls(bits, order, machine)

    def __str__(self) -> str:
        names = [name for name, known in ARCHITECTURES.items() if known == self]
        told = "/".join(names) or f"e_machine {self.machine}, {self.order} endian"
        return f"{told}, {self.bits} bits"


ARCHITECTURES: Mapping[str, Elf] = MappingProxyType(
    {
        "aarch64": Elf(64, "little", 183),
        "armv6l": Elf(32, "little", 40),
        "armv7l": Elf(32, "little", 40),
        "i686": Elf(32, "little", 3),
        "ppc64le": Elf(64, "little", 21),
        "riscv64": Elf(64, "little", 243),
        "s390x": Elf(64, "big", 22),
        "x86_64": Elf(64, "little", 62),
    }
)
"""As wheels' tags call them."""
