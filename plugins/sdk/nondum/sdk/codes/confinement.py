"""Codes of refusals: confinement, limits and the helper."""

from nondum.sdk.codes.code import Code

AREA = "Confinement, limits and the helper"
CODES = (
    Code(
        "CGROUPS_WITHHELD",
        "The machine could limit workers together, but this daemon may not use that.",
        "run nondum as the service that its package installs, or as root; by hand: "
        "`systemd-run --user --scope -p Delegate=yes nondum host run --user`",
    ),
    Code(
        "CGROUP_CPU_MISSING",
        "This system does not limit the processor time of groups of processes.",
        "use a kernel with the cpu controller",
    ),
    Code(
        "CGROUP_MEMORY_MISSING",
        "This system does not limit the memory of groups of processes.",
        "on a Raspberry Pi, put cgroup_enable=memory into /boot/firmware/cmdline.txt and "
        "restart it",
    ),
    Code(
        "CGROUP_PIDS_MISSING",
        "This system does not limit the number of processes of a group.",
        "use a kernel with the pids controller",
    ),
    Code(
        "CONFINEMENT",
        "Workers cannot be confined here as the payload demands.",
        "see `nondum doctor` for what confinement lacks on this host, or use another host",
    ),
    Code(
        "CONFINEMENT_UNAVAILABLE",
        "Workers cannot be confined here as the configuration demands.",
        "see `nondum doctor` for what is missing; install bubblewrap, or lower the level "
        "under [workers]",
    ),
    Code(
        "HELPER_BUSY",
        "The helper is doing too many things at once.",
        "it is tried again; if it stays so, `systemctl restart nondum-helper.service`",
    ),
    Code(
        "HELPER_FAILED",
        "The helper could not do what it was asked.",
        "see `journalctl -u nondum-helper.service`",
    ),
    Code(
        "HELPER_MISSING",
        "Drives are mounted by root or by the helper, and neither is here.",
        "`systemctl start nondum-helper.socket`, or run the daemon as root",
    ),
    Code(
        "HELPER_REFUSED",
        "The helper does not do that, or not for the process that asked.",
        "only nondum's own daemon may use the helper: report it, if the daemon was the one that "
        "asked",
    ),
    Code(
        "HELPER_SILENT",
        "The helper does not answer.",
        "`systemctl status nondum-helper.socket nondum-helper.service`",
    ),
    Code(
        "LOG_DROPPED",
        "The worker writes more than is kept.",
        "nothing is lost but its words; tell the plugin's author",
    ),
    Code(
        "SCRATCH_FULL",
        "The worker has filled its scratch folder.",
        "if it needs more, raise `scratch_mb` in [workers]; else tell the plugin's author",
    ),
    Code(
        "WORKER_CPU",
        "The worker keeps a processor busy without being asked for anything.",
        "pull it if that hurts; bound it by `cpu_percent` in [workers]",
    ),
    Code(
        "WORKER_FDS",
        "The worker has all the open files that it may have.",
        "if it needs more, raise `descriptors` in [workers]; else tell the plugin's author",
    ),
    Code(
        "WORKER_OOM",
        "The worker used up the memory that it may have, and was ended.",
        "if it needs more, raise `memory_mb` in [workers]; else tell the plugin's author",
    ),
    Code(
        "WORKER_TASKS",
        "The worker has all the processes and threads that it may have.",
        "if it needs more, raise `tasks` in [workers]; else tell the plugin's author",
    ),
)
