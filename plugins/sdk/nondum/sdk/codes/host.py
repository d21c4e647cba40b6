"""Codes of refusals: the host and its command line."""

from nondum.sdk.codes.code import Code

AREA = "The host and its command line"
CODES = (
    Code(
        "ALREADY_RUNNING",
        "Another daemon uses this state folder.",
        "stop that one, or give this host another `state` folder",
    ),
    Code(
        "CATALOGUE_BUSY",
        "What happened could not be written to the catalogue in time.",
        "see the daemon's own log: is the disk full, or failing?",
    ),
    Code(
        "CATALOGUE_REBUILT",
        "The catalogue was damaged, or a newer nondum's, and was made again from a copy and from "
        "what is stored.",
        "see `nondum status`: install, set or ask for again what is not there",
    ),
    Code(
        "CATALOGUE_UNWRITTEN",
        "The catalogue cannot be written, so what happens now may be forgotten at the next start.",
        "see to it that the disk works and has free space; nondum keeps trying",
    ),
    Code(
        "CATALOGUE_VERSION",
        "The catalogue was written by another version of nondum.",
        "run the nondum that wrote it, or move the file away",
    ),
    Code(
        "CODE_UNKNOWN",
        "No refusal has that code.",
        "`nondum explain` lists all codes",
    ),
    Code(
        "CONFIG_PLANNER",
        "A planner that [planning] planners names is not installed.",
        "install it, or name another one",
    ),
    Code(
        "EXTENSION_BROKEN",
        "An extension of the host, or another package's command, cannot be loaded, or failed.",
        "update or uninstall it; of an extension, the log of the daemon says more",
    ),
    Code(
        "EXTENSION_MISSING",
        "A key of the configuration needs an extension that is not installed.",
        "install it (docs/configuration.md names it), or leave the key out",
    ),
    Code(
        "CONFIG_FOLDER",
        "A folder of the configuration cannot be used.",
        "see `slots` under the section that is named",
    ),
    Code(
        "CONFIG_KEY",
        "The configuration has an unknown key.",
        "correct its spelling; docs/configuration.md lists all keys",
    ),
    Code(
        "CONFIG_SYSTEM_TREE",
        "The system tree cannot be imported.",
        'name it "package.module:function", and see that this Python can import it',
    ),
    Code(
        "CONFIG_TOML",
        "The configuration is not TOML.",
        "correct the line that is named; see https://toml.io",
    ),
    Code(
        "CONFIG_UNREADABLE",
        "The configuration cannot be read.",
        "look at its path and permissions, or name another with --config",
    ),
    Code(
        "CONFIG_UNUSED",
        "A key of the configuration has no effect.",
        "set what it needs, as the message says, or leave it out",
    ),
    Code(
        "CONFIG_VALUE",
        "A value of the configuration is not what may stand there.",
        "correct it; docs/configuration.md says what is expected",
    ),
    Code(
        "CONTROL_ANSWER",
        "The answer is not one of a nondum daemon.",
        "see that command and daemon are of one version",
    ),
    Code(
        "CONTROL_ARGUMENT",
        "A command sent something that its daemon does not take.",
        "see that command and daemon are of one version",
    ),
    Code(
        "CONTROL_IN_USE",
        "Another daemon listens at that socket.",
        "stop that one, or set another `control` under [host]",
    ),
    Code(
        "CONTROL_REQUEST",
        "A request to the daemon is too long, or none.",
        "see that command and daemon are of one version",
    ),
    Code(
        "CONTROL_SOCKET",
        "The daemon cannot listen for commands.",
        "look at `control` under [host]: its folder must be there and writable",
    ),
    Code(
        "CONTROL_VERB",
        "The daemon does not know what it is asked.",
        "see that command and daemon are of one version",
    ),
    Code(
        "DOMAIN_MISSING",
        "The domain of a problem is not here, so its names are not checked.",
        "give the domain as well",
    ),
    Code(
        "FILE",
        "A file or folder cannot be read or written.",
        "look at its path and permissions",
    ),
    Code(
        "FRAGMENT_MISSING",
        "There is no *.pddl file in the folder.",
        "give the folder that has the fragments",
    ),
    Code(
        "HOST_UNREACHABLE",
        "No daemon answers.",
        "start one with `nondum host run --user`, or name its socket with --control",
    ),
    Code(
        "INTERNAL",
        "An unexpected error: a mistake in nondum or in a plugin.",
        "see the log, and report it with what it says",
    ),
    Code(
        "LAB_MISSING",
        "The laboratory, which is in nondum's sources, is not here.",
        "stand in a checkout of nondum's sources, or name one by the variable NONDUM_LAB",
    ),
    Code(
        "SAFE_MODE",
        "The host leaves payloads alone: daemons before this one died, or a person asked for it.",
        "find out why (`nondum doctor`, `nondum journal`), then `nondum host resume`",
    ),
    Code(
        "SAFE_MODE_OFF",
        "The host is not in safe mode, so it cannot leave it.",
        "`nondum status` says how it is",
    ),
    Code(
        "STATE_BUSY",
        "The daemon before this one is ending, and does not let go of the state folder.",
        "end the process that is named (`kill -9`), and start again; if it does not end, a drive "
        "or disk does not answer: unplug it, or restart the computer",
    ),
    Code(
        "STATE_UNWRITABLE",
        "The state folder cannot be used.",
        "see to it that the disk works, has free space, and that this user may write there",
    ),
    Code(
        "USAGE",
        "The command was not written as it must be.",
        "see the command's --help",
    ),
)
