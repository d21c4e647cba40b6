"""Codes of refusals: wheels."""

from nondum.sdk.codes.code import Code

AREA = "Wheels"
CODES = (
    Code(
        "FILES_COLLIDE",
        "Two distributions bring the same file with different contents.",
        "leave one of them out, or ask their authors: two distributions may not share a file",
    ),
    Code(
        "WHEEL_BOMB",
        "The wheel would unpack to far more than any honest one.",
        "do not install it; get the payload from somebody you trust",
        causes=(
            "a wheel that was made to fill the disk; rarely, data that is all zeros (pack it "
            "compressed)"
        ),
    ),
    Code(
        "WHEEL_DATA_SCHEME",
        "The wheel would put a file in place of python, pip or activate, or somewhere that "
        "is not known.",
        "do not install it; get the payload from somebody you trust",
    ),
    Code(
        "WHEEL_INCOMPATIBLE",
        "No wheel in the payload fits this machine.",
        "build the payload for this architecture and Python: `nondum payload build --arch … "
        "--python …`",
        causes=(
            "a payload built for PCs on an ARM host, or the other way round; an older system "
            "than it was built for"
        ),
    ),
    Code(
        "WHEEL_MACHINE",
        "A module in the wheel is machine code for another processor than the wheel's name says.",
        "get the payload again; its author builds the wheel on the machine that it is for, or "
        "names it for the one that it was built on",
        causes=("a wheel that was cross-built with the wrong compiler, or renamed"),
    ),
    Code(
        "WHEEL_METADATA",
        "What the wheel says of itself is missing, cannot be read, or is of another "
        "distribution, version or machine than its name says.",
        "get the payload again; its author makes the wheel again under its own name (`python "
        "-m build`, `wheel tags`)",
        causes=("the file was renamed; a wheel that was made to be taken for another"),
    ),
    Code(
        "WHEEL_PATH",
        "A file of the wheel would land elsewhere than it seems to, or is no plain file.",
        "do not install it; get the payload from somebody you trust. Its author renames the "
        "file that is named",
        causes=("a wheel that was made to do harm; file names that differ only by case"),
    ),
    Code(
        "WHEEL_RECORD",
        "The wheel does not hold what its own list, RECORD, says.",
        "get the payload again; its author makes a new wheel instead of changing files in it",
        causes=("a file was changed after the wheel was made; the stick is failing"),
    ),
    Code(
        "WHEEL_SHADOWS",
        "The wheel would stand in for the standard library or for nondum itself.",
        "get the payload from somebody you trust; its author renames the module that is named",
    ),
    Code(
        "WHEEL_STARTUP_HOOK",
        "The wheel brings code that would run whenever an interpreter starts.",
        "get the payload from somebody you trust; if its author knows the hook to be "
        "harmless, they name it in `startup_hooks` of payload.toml and build again",
        causes=(
            "development tools (coverage, editable installs); attacks that wait for the next start"
        ),
    ),
    Code(
        "WHEEL_STRUCTURE",
        "Two readers of the wheel would not see the same in it, or it is no wheel.",
        "get the payload again from its author, who makes a new wheel with current tools "
        "(`python -m build`)",
        causes=(
            "a damaged file; a self-extracting or patched archive; a wheel that was made to "
            "show one thing and install another"
        ),
    ),
)
