"""Devices without a driver of the kernel: pyusb on the one that was granted, and on no other.

A plugin that imports this locks pyusb with it (`nondum-sdk[usb]`) and declares its device with
`subsystem = "usb"`. libusb, the library, is the machine's own, or that of the wheel libusb-package.

libusb would look for all devices there are, by sysfs and /dev/bus/usb, which workers do not see. It
is told not to, and is given the granted node, opened (`libusb_wrap_sys_device`, libusb 1.0.23).
"""

from __future__ import annotations

import contextlib
import ctypes
import os
from collections.abc import Iterator
from typing import Any

from nondum.sdk.errors import BehaviourFailed
from nondum.sdk.workplace import Device

LIBRARY = "libusb-1.0.so.0"
_NO_DEVICE_DISCOVERY = 2
"""`LIBUSB_OPTION_NO_DEVICE_DISCOVERY`."""


@contextlib.contextmanager
def open_usb(device: Device) -> Iterator[Any]:
    """Open a granted USB device for as long as the context lasts; gives pyusb's `usb.core.Device`.

    Raises `BehaviourFailed` (USB_LIBRARY: pyusb or libusb is not to be had; USB_UNUSABLE: the node
    is no USB device's, or cannot be opened).
    """
    libusb1 = _loaded()
    path = raw_node(device)
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC)
    except OSError as error:
        raise BehaviourFailed(f"{path}: {error.strerror}", code="USB_UNUSABLE") from error
    try:
        with _wrapped(libusb1, descriptor) as opened:
            yield opened
    finally:
        os.close(descriptor)


def raw_node(device: Device) -> str:
    """Path of the node by which a device is used as USB has it. Raises `BehaviourFailed`."""
    for node in device.nodes:
        if node.subsystem == "usb":
            return node.node
    if device.properties.get("SUBSYSTEM") == "usb":
        return device.node
    message = f"{device.node} is not the raw node: match it with subsystem = 'usb'"
    raise BehaviourFailed(message, code="USB_UNUSABLE")


def _loaded() -> Any:
    """pyusb's module of libusb, with that library in it. Raises `BehaviourFailed`."""
    try:
        from usb.backend import libusb1
    except ImportError as error:
        message = "pyusb is not in this payload: lock it with the plugin"
        raise BehaviourFailed(message, code="USB_LIBRARY") from error
    try:
        library = ctypes.CDLL(_path())
        library.libusb_set_option(None, ctypes.c_int(_NO_DEVICE_DISCOVERY))
        backend = libusb1.get_backend(find_library=lambda _: _path())
        if backend is None:
            raise OSError("it does not start")
        _declare(backend.lib)
    except (OSError, AttributeError) as error:
        raise BehaviourFailed(f"libusb cannot be used: {error}", code="USB_LIBRARY") from error
    return libusb1


def _path() -> str:
    """The library of the wheel that carries one, or else the machine's."""
    try:
        import libusb_package
    except ImportError:
        return LIBRARY
    return str(libusb_package.get_library_path())


def _declare(library: Any) -> None:
    """Say what the functions take that pyusb does not call. Raises `AttributeError`."""
    handle = ctypes.c_void_p
    library.libusb_wrap_sys_device.argtypes = [handle, ctypes.c_ssize_t, ctypes.POINTER(handle)]
    library.libusb_get_device.argtypes = [handle]
    library.libusb_get_device.restype = handle


@contextlib.contextmanager
def _wrapped(libusb1: Any, descriptor: int) -> Iterator[Any]:
    """pyusb's device of an open descriptor. Raises `BehaviourFailed` (USB_UNUSABLE)."""
    from usb.core import Device as UsbDevice
    from usb.core import USBError
    from usb.util import dispose_resources

    class OneDevice(libusb1._LibUSB):  # type: ignore[misc]  # pyusb has no types
        """libusb with one device, which is open already.

        All share the process's one context: devices that are still referred to, or wait for the
        garbage collector, must not outlive theirs.
        """

        def __init__(self, shared: Any) -> None:
            self.lib, self.ctx = shared.lib, shared.ctx
            self.handle: Any = None

        def _finalize_object(self) -> None:
            """The context stays."""

        def enumerate_devices(self) -> Iterator[Any]:
            yield libusb1._Device(self.handle.devid)

        def open_device(self, dev: Any) -> Any:
            if self.handle is None:
                raise USBError("the device was given back")
            return self.handle

        def close_device(self, dev_handle: Any) -> None:
            """Leave it open: the code that opened it closes it."""

    backend = OneDevice(libusb1.get_backend())
    wrapped = ctypes.c_void_p()
    status = backend.lib.libusb_wrap_sys_device(backend.ctx, descriptor, ctypes.byref(wrapped))
    if status != 0:
        said = f"libusb does not take it: {libusb1._strerror(status)}"
        raise BehaviourFailed(said, code="USB_UNUSABLE")
    try:
        backend.handle = libusb1._DeviceHandle.__new__(libusb1._DeviceHandle)
        backend.handle.handle = wrapped
        backend.handle.devid = backend.lib.libusb_get_device(wrapped)
        device = UsbDevice(next(backend.enumerate_devices()), backend)
        yield device
        dispose_resources(device)
    finally:
        backend.handle = None
        backend.lib.libusb_close(wrapped)
