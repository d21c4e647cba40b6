"""Codes of refusals: plugins and workers."""

from nondum.sdk.codes.code import Code

AREA = "Plugins and workers"
CODES = (
    Code(
        "ACTION_EFFECT",
        "No fragment can be made of what a behaviour says that its action makes or needs.",
        "tell the plugin's author: `makes` and `needs` are one formula of PDDL each, (lit ?h)",
    ),
    Code(
        "ACTION_SIGNATURE",
        "The action of a behaviour cannot be read.",
        "tell the plugin's author: an action is written as (point ?u - pointer ?t - target)",
    ),
    Code(
        "ARGUMENTS",
        "A behaviour got other parameters than its action has.",
        "build the payload again from the plugin that it carries",
    ),
    Code(
        "BACKPRESSURE",
        "A worker sends more than anybody can read, and was ended.",
        "tell the plugin's author",
    ),
    Code(
        "BEHAVIOUR_BLOCKED",
        "A leaf of the system tree cannot run its behaviour: no objects meet its preconditions.",
        "see `nondum facts` for what holds, and the action in the plugin's fragment",
    ),
    Code(
        "BEHAVIOUR_FAILED",
        "A behaviour ended in failure, as its author says.",
        "see `nondum why` and what the message says; the robot looks for another way by itself",
    ),
    Code(
        "BEHAVIOUR_OVERDUE",
        "A behaviour took too long since its start or its last sign of progress.",
        "see `nondum logs`; tell the plugin's author if it needs longer",
    ),
    Code(
        "BEHAVIOUR_PARAMETERS",
        "A behaviour's function does not take what its action names.",
        "give the function `ctx` and then the action's parameters, by name and in order",
    ),
    Code(
        "BEHAVIOUR_RAISED",
        "A behaviour ended with an error that its author did not foresee.",
        "see `nondum logs`; tell the plugin's author",
    ),
    Code(
        "BEHAVIOUR_UNKNOWN",
        "The plugin has no behaviour of that name.",
        "see `nondum behaviours` for what is here",
    ),
    Code(
        "CALL_TWICE",
        "A call has the number of one that is still running.",
        "tell the author of the program at the other end",
    ),
    Code(
        "CONDITION_RAISED",
        "A condition ended with an error, so nothing tells its facts any more.",
        "its author finds the reason at the line that is named and in `nondum logs`; pull the "
        "payload and plug it in again to have it started again",
    ),
    Code(
        "SPAWNED_RAISED",
        "A coroutine that the plugin spawned ended with an error, so what it did is done no more.",
        "its author finds the reason at the line that is named and in `nondum logs`; pull the "
        "payload and plug it in again to have it started again",
    ),
    Code(
        "COMPONENT_REMOVED",
        "The component was removed while it was in use.",
        "plug its payload in again if it is still needed",
    ),
    Code(
        "COMPONENT_UNKNOWN",
        "No component is called that.",
        "see `nondum components` for what is here",
    ),
    Code(
        "DEADLINE",
        "No answer came in time.",
        "try again; see `nondum logs` if it stays so",
    ),
    Code(
        "EVENT_INVALID",
        "What a worker tells lacks a part, or is not what may be told.",
        "tell the plugin's author",
    ),
    Code(
        "EVENT_UNKNOWN",
        "Something tells of an event that does not exist.",
        "use the same version of nondum at both ends",
    ),
    Code(
        "FRAME_CYCLE",
        "Mount poses go round in a circle.",
        "correct one of them with `nondum mount`",
    ),
    Code(
        "FRAME_UNKNOWN",
        "It is not known where one thing is mounted relative to another.",
        "give the mount pose: nondum mount UNIT --xyz X Y Z --rpy R P Y",
    ),
    Code(
        "HALTED",
        "It was halted, as asked.",
        "to have it go on, take up its goal again: nondum goal --resume ID",
    ),
    Code(
        "HALT_OVERDUE",
        "A behaviour did not halt in time, and its worker was ended.",
        "tell the plugin's author: clean up within two seconds",
    ),
    Code(
        "HANDSHAKE",
        "The two ends of a link did not greet as they must.",
        "build the payload again with the nondum-sdk that belongs to the host",
    ),
    Code(
        "HOOK_FAILED",
        "A hook of the plugin raised an error.",
        "see `nondum logs`; tell the plugin's author",
    ),
    Code(
        "HOOK_UNKNOWN",
        "The plugin implements a hook that does not exist.",
        "tell the plugin's author: docs/hooks.md lists the hooks",
    ),
    Code(
        "IMPORT_FAILED",
        "The plugin cannot be imported or made.",
        "tell the plugin's author; `pytest` in its folder shows the same",
        causes=(
            "a dependency that is not locked; a module of another name than the entry point says"
        ),
    ),
    Code(
        "INDEX_MISMATCH",
        "The plugin does not say what its payload says that it would.",
        "build the payload again from the plugin that it carries",
    ),
    Code(
        "LAUNCH_CROWDED",
        "A worker cannot be started yet: too many descriptors are under way between processes.",
        "wait; it is tried again. See `nondum logs` for the worker that is ended for it",
    ),
    Code(
        "LAUNCH_FAILED",
        "The process that starts workers ends at once.",
        "run `nondum doctor`; see the daemon's log",
    ),
    Code(
        "LINK_CLOSED",
        "The process at the other end is gone.",
        "see `nondum logs` for how it ended; it is started again by itself",
    ),
    Code(
        "LINK_CONGESTED",
        "The process at the other end does not read what it is sent.",
        "see `nondum logs`; it is ended and started again if it stays so",
    ),
    Code(
        "NOT_DESCRIBED",
        "The plugin has not said yet what it can do.",
        "wait until it is ready; see `nondum components`",
    ),
    Code(
        "NOT_RUNNING",
        "No worker of this component runs now.",
        "see `nondum components` for how it is; plug its payload in again",
    ),
    Code(
        "NO_CREDIT",
        "More requests are under way than may be.",
        "tell the plugin's author: wait for answers before asking more",
    ),
    Code(
        "NO_METHOD",
        "The host does not serve what it was asked for.",
        "build the payload again with the nondum-sdk that belongs to the host",
    ),
    Code(
        "PROTO_VIOLATION",
        "A worker sent what the protocol does not allow, and was ended.",
        "tell the plugin's author; build the payload with the nondum-sdk that belongs to the host",
    ),
    Code(
        "REQUEST_UNASKED",
        "A worker asks its host for what workers may not ask.",
        "tell the plugin's author",
    ),
    Code(
        "RESULT_INVALID",
        "A plugin answered with something that is not what it declared.",
        "tell the plugin's author",
    ),
    Code(
        "SETTING_INVALID",
        "A setting of the plugin is not what it expects.",
        "correct it in `settings` of payload.toml, or in the file of `settings` under [workers]",
    ),
    Code(
        "UNIT_TAKEN",
        "The unit is used by something else.",
        "wait until that ends, or halt it with `nondum halt`",
    ),
    Code(
        "UNIT_UNKNOWN",
        "No unit is called that.",
        "see `nondum units` for what is here",
    ),
    Code(
        "UNKNOWN_CALL",
        "An answer came to a call that was never made.",
        "tell the author of the program at the other end",
    ),
    Code(
        "VALUE_UNKNOWN",
        "The plugin asks for a value that no component has told.",
        "see `nondum facts`; what tells it may not be plugged in",
    ),
    Code(
        "VERB_UNKNOWN",
        "One end asks for what the other does not know.",
        "use the same version of nondum at both ends",
    ),
    Code(
        "WELCOME",
        "A worker cannot read its host's welcome.",
        "build the payload again with the nondum-sdk that belongs to the host",
    ),
    Code(
        "WORKER_CRASH_LOOP",
        "The worker failed again and again, and is not started any more.",
        "pull the payload and plug it in again, or ask for another try with `nondum retry`",
    ),
    Code(
        "WORKER_HUNG",
        "The worker gives no sign of life, and was ended.",
        "see `nondum logs`; a slow plugin needs a longer `startup_s` in [workers]",
    ),
    Code(
        "WORKER_IN_FLIGHT",
        "The worker sends descriptors that nothing reads, which held up other workers.",
        "see `nondum logs`; tell the plugin's author",
    ),
    Code(
        "WORKER_START_FAILED",
        "The worker did not start.",
        "see `nondum logs`; tell the plugin's author what it says",
        causes=("a library that is not in the payload; a processor that lacks an instruction"),
    ),
)
