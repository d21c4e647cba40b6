"""Codes of refusals: drives."""

from nondum.sdk.codes.code import Code

AREA = "Drives"
CODES = (
    Code(
        "CHILD_DIED",
        "The process that reads or installs ended before it was done.",
        "plug the drive in again; if it happens again, send the daemon's log with the "
        "payload to its authors",
        causes=("too little memory; a payload that was made to break its reader"),
    ),
    Code(
        "CHILD_LIMIT",
        "Reading or judging took more than it may use.",
        "get the payload again from its author; an honest one needs far less",
        causes=("a payload that was made to exhaust its reader; a very slow machine"),
    ),
    Code(
        "CHILD_STALLED",
        "The process that reads or installs said nothing for too long, and was ended.",
        "plug the drive in again, or into another port",
        causes=("a hanging drive; a machine that is much too busy"),
    ),
    Code(
        "DRIVE_FLAPPING",
        "The drive comes and goes within seconds; it is read once it stays.",
        "plug it in firmly, or try another port or cable",
        causes=("a loose plug, a bad cable, too little power"),
    ),
    Code(
        "DRIVE_GONE",
        "The drive went away, or gave no more bytes, while it was needed.",
        "plug it in again, and leave it in until the host says that it is ready",
        causes=("it was pulled; a loose plug or a bad cable; a stick that fails"),
    ),
    Code(
        "DRIVE_MOUNTED",
        "Somebody else has mounted the drive, or uses it otherwise, so it is not read.",
        "unmount it there, pull it and plug it in again; have no desktop or automounter mount what "
        "is plugged into a robot",
        causes=("an automounter; a person who had a look; a check of its file system"),
    ),
    Code(
        "DRIVE_NAME",
        "The drive's name has characters that cannot be shown, so it is not read.",
        "give the drive another label, or mount it under another name",
    ),
    Code(
        "DRIVE_NOT_PAYLOAD",
        "The drive or folder carries no payload.",
        "put a payload on it with `nondum payload build … -o DRIVE`; a drive has folders "
        "nondum/<payload-id>/ with a file CONTENTS",
        causes=(
            "an ordinary stick; the payload's folder was copied without its parents; the wrong "
            "partition"
        ),
    ),
    Code(
        "DRIVE_OWN",
        "The disk is the machine's own, whatever it hangs on, and is left alone.",
        "nothing is wrong; `nondum doctor disks` tells which disks are whose, and why",
        causes=(
            "the machine boots from it, mounts it by /etc/fstab or a unit, swaps to it, or has "
            "made another device of it; a stick that has the label of such a disk"
        ),
    ),
    Code(
        "DRIVE_STALLED",
        "The drive does not answer, so its reading was given up.",
        "pull it and plug it in again, or into another port; copy the payload to another "
        "stick if that does not help",
        causes=("a failing stick; a hub without enough power"),
    ),
    Code(
        "FILE_MISSING",
        "A file that the contents list names is not there.",
        "copy the whole payload folder again, or build the payload again",
        causes=("copying was interrupted; somebody deleted a file"),
    ),
    Code(
        "FS_ERROR",
        "The drive's file system cannot be mounted.",
        "check the drive on another computer, or format it and copy the payload to it again",
        causes=("it was pulled while it was being written; it is worn out"),
    ),
    Code(
        "FS_UNSUPPORTED",
        "The drive has no file system that is read here.",
        "format the drive as exFAT, FAT32 or ext4, and copy the payload to it",
        causes=("a stick made for another system; an encrypted or a raw disk"),
    ),
    Code(
        "HASH_MISMATCH",
        "The bytes of a file are not those that were listed when the payload was made.",
        "copy the payload to the drive again; if it stays so, the stick is failing or "
        "somebody has changed it",
        causes=(
            "copying was interrupted; a failing stick; files of two releases were mixed; "
            "somebody has changed them"
        ),
    ),
    Code(
        "METADATA_LIMIT",
        "What a payload says of itself cannot be read with the memory and time that are "
        "given to it.",
        "build the payload again, with less in its manifest, locks and index",
        causes=("a payload that was made to exhaust its reader"),
    ),
    Code(
        "NOT_UTF8",
        "A text file is in another encoding than UTF-8.",
        "save it as UTF-8, and build the payload again",
    ),
    Code(
        "NO_RESOURCES",
        "The host has run out of something that it needs to read a drive.",
        "find out what uses it up, for example with `nondum status` and `nondum doctor`; "
        "then plug the drive in again",
    ),
    Code(
        "PATH_UNSAFE",
        "A path leaves the payload, or ends at or leads through anything but plain files "
        "and folders.",
        "do not use this drive; get the payload again from its author",
        causes=("a link in a payload folder; a payload that was made to do harm"),
    ),
    Code(
        "TOO_LARGE",
        "Something is longer than anybody reads.",
        "pack models and data as wheels, and say less about them in the other files",
        causes=("a file was put where another belongs; a payload that was made to do harm"),
    ),
    Code(
        "TOO_MANY_FILES",
        "There are more files or payloads than are looked at.",
        "put fewer payloads on one drive, and data into wheels",
    ),
    Code(
        "USB_EXTRA_INTERFACE",
        "The stick is another kind of device too, such as a keyboard, and is not read.",
        "use a plain USB stick; throw this one away if you do not know whose it is",
        causes=(
            "an attack by a stick that types; rarely, a drive with a fingerprint reader or a "
            "card reader with a modem"
        ),
    ),
)
