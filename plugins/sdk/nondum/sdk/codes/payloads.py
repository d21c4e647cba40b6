"""Codes of refusals: payload files."""

from nondum.sdk.codes.code import Code

AREA = "Payload files"
CODES = (
    Code(
        "BUILD_FAILED",
        "pip could not make the plugin's own wheel.",
        "read the line that is shown, and run `pip wheel .` in its folder to see more",
    ),
    Code(
        "CHECK_MISSING",
        "`worker.check()` found nothing installed that can check a payload's source folder.",
        "install nondum beside nondum-sdk: `pip install nondum`",
    ),
    Code(
        "CONTENTS_ENCODING",
        "The contents list is not ASCII.",
        "build the payload again; its contents list is not written by hand",
    ),
    Code(
        "CONTENTS_ENTRY",
        "A line of the contents list names no file as it should.",
        "build the payload again; its contents list is not written by hand",
    ),
    Code(
        "CONTENTS_HEADER",
        "A header of the contents list is wrong, unknown or missing.",
        "build the payload again; its contents list is not written by hand",
    ),
    Code(
        "CONTENTS_MISSING",
        "The payload has no contents list.",
        "build the payload with `nondum payload build`, and copy its whole folder",
    ),
    Code(
        "DEVICE_RULES",
        "A plugin's devices() and the manifest ask for a device differently.",
        "say the same in both; devices are given out by the manifest",
    ),
    Code(
        "DESCRIBE_FAILED",
        "The plugin ended while it was asked what it can do.",
        "run its tests (`pytest` in its folder); describing hooks must not need devices or "
        "the network",
    ),
    Code(
        "DESCRIBE_HANGS",
        "The plugin did not say what it can do in time.",
        "keep describing hooks free of devices, the network and heavy imports",
    ),
    Code(
        "DESCRIPTION_INVALID",
        "What a plugin says of itself is not what may be said.",
        "tell the plugin's author; with the SDK that the host knows, `pytest` in its folder "
        "shows it, and the payload is built again",
    ),
    Code(
        "ENTRY_POINT",
        "The distribution has no entry point for its component.",
        'add [project.entry-points."nondum.plugins"] to its pyproject.toml, with the '
        "component's id, and build again",
    ),
    Code(
        "FOLDER_NOT_EMPTY",
        "A folder that is to be made has something in it.",
        "give another folder with --output",
    ),
    Code(
        "INDEX_INVALID",
        "index.json, what the plugins say of themselves, is wrong.",
        "build the payload again with `nondum payload build`",
    ),
    Code(
        "LOCK_HASH",
        "A lock names a wheel without its whole SHA-256 and size.",
        "build the payload again with `nondum payload build`",
    ),
    Code(
        "LOCK_INCOMPLETE",
        "Something that a component needs is not locked for this host.",
        "build the payload again, for this architecture and Python (`--arch`, `--python`)",
    ),
    Code(
        "LOCK_INVALID",
        "A lock is not what PEP 751 says, or contradicts itself.",
        "build the payload again with `nondum payload build`; locks are not written by hand",
    ),
    Code(
        "LOCK_MISSING",
        "A component has no lock.",
        "build the payload again with `nondum payload build`",
    ),
    Code(
        "LOCK_NOT_WHEEL",
        "A lock names a source, a folder or a repository where a wheel must be.",
        "have the distribution made into a wheel (`--library` or `--wheels` of `nondum "
        "payload build`), and build the payload again",
        causes=("a dependency without wheels; a lock made by another tool"),
    ),
    Code(
        "LOCK_PATH",
        "A lock names an address, an index, or a file that is not in the payload.",
        "build the payload again with `nondum payload build`, which puts every wheel on the drive",
        causes=("a lock made by another tool; a payload that was made to do harm"),
    ),
    Code(
        "LOCK_TOML",
        "A lock is not TOML.",
        "build the payload again with `nondum payload build`; locks are not written by hand",
    ),
    Code(
        "MANIFEST_KEY",
        "payload.toml has an unknown key, or lacks one that must be there.",
        "correct the key that is named, and build the payload again; docs/payload-format.md "
        "lists them",
    ),
    Code(
        "MANIFEST_TOML",
        "payload.toml is not TOML.",
        "correct the line that is named (see https://toml.io), and build the payload again",
    ),
    Code(
        "MANIFEST_TWICE",
        "Two parts of payload.toml have one name.",
        "give one of them another name, and build the payload again",
    ),
    Code(
        "MANIFEST_VALUE",
        "A value in payload.toml is not what may stand there.",
        "correct the value that is named, and build the payload again",
    ),
    Code(
        "NAME_INVALID",
        "A name or id is not one that is allowed.",
        "use lower-case letters, digits and single hyphens; a payload's id is a reverse "
        "domain name like org.example.lamp",
    ),
    Code(
        "PIP_FAILED",
        "pip could not install the wheels.",
        'look at the line that is shown; `install.method = "store"` does it without pip',
    ),
    Code(
        "SCHEMA_VERSION",
        "The payload is of a format that this host does not know.",
        "build the payload with a nondum that this host knows, or update the host",
    ),
    Code(
        "SOURCE_INCOMPLETE",
        "The source folder of a plugin lacks a file.",
        "`nondum payload new` makes a complete source folder to compare with",
    ),
    Code(
        "TARGET_UNKNOWN",
        "There are no wheels for such an architecture or Python.",
        "say one that is listed in the message, as in --arch aarch64 --python 3.11",
    ),
    Code(
        "WHEEL_MISSING",
        "pip found no wheel of a dependency for that architecture and Python.",
        "see whether it is spelt so in `dependencies`; give its source folder with --library or a "
        "folder of wheels with --wheels, pin a version that has wheels, or build without that "
        "target",
    ),
)
