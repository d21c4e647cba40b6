"""Codes of refusals: fitting and installing."""

from nondum.sdk.codes.code import Code

AREA = "Fitting and installing"
CODES = (
    Code(
        "ALREADY_PRESENT",
        "The payload is installed already.",
        "nothing, or `nondum payload uninstall` it first",
    ),
    Code(
        "DATA_MISSING",
        "Data that the component needs are not here.",
        "plug in a drive that brings such data; the component starts by itself then",
    ),
    Code(
        "DEVICE_MISSING",
        "A device that the component needs is not plugged in.",
        "plug the device in; the component starts by itself then",
    ),
    Code(
        "DEVICE_REFUSED",
        "A device cannot be handed to the worker.",
        "see that it is a device below /dev that the host's user may open",
    ),
    Code(
        "DEVICE_SLOT",
        "A file of a device slot is wrong.",
        "correct the line that is named",
    ),
    Code(
        "DEVICE_UNKNOWN",
        "There is no device of that name, port, node or serial number.",
        "see `nondum devices`",
    ),
    Code(
        "DISK_FULL",
        "There is too little disk.",
        "free some disk, pull payloads that are not needed, or lower `quota_mb` under [install]",
    ),
    Code(
        "FORGET_UNKNOWN",
        "Nothing is remembered of a payload of that name.",
        "see `nondum advise --help`; the message lists what is remembered",
    ),
    Code(
        "IO_ERROR",
        "The system could not read or write.",
        "try again; if it stays so, look at the disk (`dmesg`) and at the daemon's log",
        causes=("a failing or full disk; a file system that has become read-only"),
    ),
    Code(
        "NONDUM_VERSION",
        "The payload needs a newer nondum than runs here.",
        "update the host, or use an older release of the payload",
    ),
    Code(
        "NOT_INSTALLED",
        "The payload is not installed.",
        "see `nondum status` for what is",
    ),
    Code(
        "NO_GPU_KIND",
        "The host has no GPU of the kind that the payload needs.",
        "use another host",
    ),
    Code(
        "NO_GPU_MEMORY",
        "There is too little GPU memory, or no GPU.",
        "pull a payload that uses the GPU, or use another host",
    ),
    Code(
        "NO_MEMORY",
        "There is too little memory.",
        "pull a payload that is not needed, or use another host",
    ),
    Code(
        "PAYLOAD_LOST",
        "The files of an installed payload, or its wheels for the host's Python, are gone from the "
        "host's state folder.",
        "`nondum payload uninstall` it, then install it again",
    ),
    Code(
        "PAYLOAD_UNKNOWN",
        "No payload is called that.",
        "see `nondum status` for what is here",
    ),
    Code(
        "PYTHON_VERSION",
        "The payload does not run on this host's Python.",
        "use a payload that was built for this Python, or give the host another one",
    ),
    Code(
        "QUARANTINED",
        "It failed, or brought the daemon down, too often, and is left alone.",
        "pull it and plug it in again, or ask for another try with `nondum retry`",
    ),
    Code(
        "RETRY_NOTHING",
        "Nothing is wrong with it that could be tried again.",
        "see `nondum status`",
    ),
    Code(
        "ROLLBACK_BUSY",
        "The payload is just being brought up.",
        "wait until `nondum status` shows it active, and ask again",
    ),
    Code(
        "ROLLBACK_ENDED",
        "The release that was to come back did not come up; what ran before stays.",
        "see `nondum why` and `nondum logs`",
    ),
    Code(
        "ROLLBACK_NOTHING",
        "There is no earlier release to go back to.",
        "install the release that you want; `nondum status` shows what is here",
    ),
    Code(
        "SLOT_DANGLING",
        "A link in a slot folder leads nowhere, so nothing is plugged in by it.",
        "link to the whole path: `ln -sfn /whole/path LINK`",
        causes="a path in a link counts from the link's folder, not from where `ln` was typed",
    ),
    Code(
        "SLOT_UNREADABLE",
        "A slot folder or a file in it cannot be read; what was plugged in by it stays plugged in.",
        "find out why the host cannot read it; it is read again every second",
        causes="a failing disk, missing permissions, or no file descriptors left",
    ),
    Code(
        "STORE_DAMAGED",
        "A stored file is not what was stored.",
        "nothing: it is unpacked again from the payload; if it happens again, the disk is failing",
    ),
    Code(
        "STORE_MISSING",
        "A wheel that is needed is not in the store.",
        "plug the payload in again",
    ),
    Code(
        "WORKER_EXITED",
        "The new release's worker ended while it was watched, so the old one stays.",
        "see `nondum logs`; plug in a release that works",
    ),
    Code(
        "SERIAL_FAILED",
        "A plugin cannot open, read or write its serial line.",
        "check the cable; no other program may have the line open",
    ),
    Code(
        "USB_LIBRARY",
        "A plugin cannot use a USB device itself: pyusb or libusb is not to be had.",
        "its author: lock pyusb with it (`nondum-sdk[usb]`); the host's owner: install libusb "
        "(Debian: `libusb-1.0-0`)",
    ),
    Code(
        "USB_UNUSABLE",
        "A granted device cannot be used by libusb.",
        "its author: match it with subsystem = 'usb'; else plug it in again",
    ),
)
