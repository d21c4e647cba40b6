"""What is verified where, and which tests guard it: nearest first."""

from __future__ import annotations

from collections.abc import Mapping

_W, _TW = "wheelhouse/nondum/wheelhouse", "tests/wheelhouse"
_H, _TH = "host/nondum/host", "tests/host"
_S, _TS = "plugins/sdk/nondum/sdk", "tests/sdk"
_T, _TT = "transport/nondum/transport", "tests/transport"
_WHEELS = (f"{_TW}/test_wheel.py",)
_MOUNTED = tuple(
    f"{_TH}/sources/drives/test_blocks.py::{test}"
    for test in (
        "test_wrong_file_system_is_told",
        "test_drive_that_goes_while_it_is_mounted_is_told",
        "test_file_system_that_the_kernel_does_not_know_is_told",
        "test_drive_that_came_in_place_of_another_is_not_taken_for_it",
        "test_unknown_file_system_is_refused_by_name",
    )
)
_CLAIMED = (*_MOUNTED, f"{_TH}/sources/drives/test_left_alone.py")
_BROUGHT = tuple(
    f"{_TH}/manager/test_payload_trust.py::{test}"
    for test in (
        "test_a_first_file_that_is_none_is_told",
        "test_false_trust_files_are_told_and_change_nothing",
        "test_people_bring_the_next_trust_file_too",
    )
)
_RELEASES = (f"{_TH}/lifecycle/test_releases.py", f"{_TH}/trust/test_releases_of_strangers.py")
_CONTROL = (f"{_TH}/control/test_arguments.py", f"{_TH}/control/test_control.py")
_HELPER = (f"{_TH}/sandbox/helper/test_server.py",)
_GRANTS = tuple(f"{_TT}/streams/test_{each}.py" for each in ("packets", "grants", "lying_owners"))
_TELLERS = tuple(f"{_TT}/fleet/test_{each}.py" for each in ("bad_tellers", "dialling", "fleets"))
_HZ = "plugins/host-zenoh/nondum_host_zenoh"
_ZENOH = (f"{_TT}/fleet/test_zenoh.py",)
_OWNERS = (f"{_TH}/peers/streams/test_hostile_owner.py", f"{_TH}/peers/streams/test_bridge.py")
_STREAMS = (f"{_TH}/peers/streams/test_remote_streams.py",)
_ADMISSION = tuple(f"{_TT}/peers/test_{each}.py" for each in ("gate", "admission"))
_PEER_KEYS = (f"{_TT}/peers/test_keys.py",)
_PAIRING = tuple(f"{_TT}/peers/test_{each}.py" for each in ("pairing", "pairing_channel"))
_TC, _TI = "tests/sandbox", f"{_TH}/sandbox/inside"
_IN_SANDBOXES = tuple(
    f"{_TC}/test_{each}.py" for each in ("init", "mounts", "users", "lending", "sandbox")
)
_PEER_CALLS = tuple(
    f"{_TT}/peers/test_{each}.py" for each in ("calls", "call_history", "allowance")
)

GUARDS: Mapping[str, tuple[str, ...]] = {
    # Who is believed.
    f"{_W}/trust/wire.py": (f"{_TW}/trust/test_sshsig.py",),
    f"{_W}/trust/public_key.py": (f"{_TW}/trust/test_sshsig.py", f"{_TW}/trust/test_trust_file.py"),
    f"{_W}/trust/sshsig.py": (f"{_TW}/trust/test_sshsig.py",),
    f"{_W}/trust/trust_file.py": (f"{_TW}/trust/test_trust_file.py",),
    f"{_W}/trust/judging.py": (f"{_TW}/trust/test_judging.py",),
    f"{_W}/trust/succession.py": (f"{_TW}/trust/test_succession.py",),
    f"{_W}/trust/editing.py": (f"{_TW}/trust/test_editing.py",),
    f"{_W}/trust/owners_folder.py": (f"{_TW}/trust/test_editing.py",),
    f"{_W}/trust/signing.py": (f"{_TW}/trust/test_signing.py",),
    f"{_W}/format/signatures.py": (
        f"{_TW}/trust/test_judging.py",
        f"{_TW}/test_goal_payload.py",
        f"{_TW}/test_limits.py",
        f"{_TW}/test_data_payload.py",
    ),
    f"{_H}/trust/anchors.py": (f"{_TH}/trust/test_anchors.py",),
    f"{_H}/trust/chain.py": (f"{_TH}/trust/test_chain.py",),
    f"{_H}/manager/payload_trust.py": _BROUGHT,
    # What drives are, and what is read of them.
    f"{_H}/sandbox/helper/mounting.py": _MOUNTED,
    f"{_H}/sandbox/helper/drive_nodes.py": _CLAIMED,
    f"{_H}/sources/drives/usb.py": (f"{_TH}/sources/drives/test_usb.py",),
    f"{_H}/sources/drives/slots.py": (f"{_TH}/sources/drives/test_slots.py",),
    f"{_H}/manager/drive_reading.py": (
        f"{_TH}/manager/test_payload_trust.py"
        "::test_what_is_wrong_or_doubtful_is_told_as_a_drive_is_read",
        f"{_TH}/manager/test_drive_reading.py::test_a_goal_that_lies_loose_is_told_with_its_drive",
        *_BROUGHT,
    ),
    f"{_H}/jobs/loose_goals.py": (f"{_TH}/jobs/test_loose_goals.py",),
    f"{_H}/jobs/look.py": (f"{_TH}/jobs/test_look.py",),
    f"{_H}/jobs/cached.py": (f"{_TH}/jobs/test_cached.py",),
    f"{_H}/jobs/noted.py": (f"{_TH}/jobs/test_noted.py",),
    f"{_H}/jobs/read_pace.py": (f"{_TH}/jobs/test_read_pace.py",),
    f"{_H}/jobs/forked_trial.py": (f"{_TH}/jobs/test_forked_trial.py",),
    f"{_H}/jobs/parcel.py": (f"{_TH}/jobs/test_parcel.py",),
    f"{_W}/payload/drive.py": (f"{_TW}/test_drive.py",),
    # What a payload says of itself.
    f"{_W}/format/contents.py": (f"{_TW}/test_contents.py",),
    f"{_W}/format/names.py": (f"{_TW}/test_names.py",),
    f"{_W}/format/tables.py": (f"{_TW}/test_manifest.py", f"{_TW}/trust/test_trust_file.py"),
    f"{_W}/format/limits.py": (f"{_TW}/test_limits.py",),
    f"{_W}/format/manifest.py": (f"{_TW}/test_manifest.py", f"{_TW}/test_data_payload.py"),
    f"{_W}/format/data.py": (f"{_TW}/test_data_payload.py",),
    f"{_W}/format/confinement.py": (f"{_TW}/test_confinement.py",),
    f"{_W}/format/lock.py": (f"{_TW}/test_lock.py",),
    f"{_W}/format/index.py": (f"{_TW}/test_index.py",),
    f"{_W}/format/goals.py": (f"{_TW}/test_goals.py",),
    f"{_W}/payload/payload.py": (
        f"{_TW}/test_payload.py",
        f"{_TW}/test_goal_payload.py",
        f"{_TW}/test_data_payload.py",
    ),
    f"{_W}/build/verification.py": (f"{_TW}/test_verification.py", f"{_TW}/test_data_payload.py"),
    f"{_W}/payload/preflight.py": (
        f"{_TW}/test_preflight.py",
        f"{_TW}/test_limits.py",
        f"{_TW}/test_payload.py",
        f"{_TW}/test_verification.py",
    ),
    f"{_W}/payload/memory.py": (f"{_TW}/test_memory.py",),
    # Its wheels.
    f"{_W}/wheels/archive.py": _WHEELS,
    f"{_W}/wheels/outline.py": (f"{_TW}/test_outline.py", *_WHEELS),
    f"{_W}/wheels/inflate.py": (f"{_TW}/test_inflate.py",),
    f"{_W}/wheels/wheel.py": _WHEELS,
    f"{_W}/wheels/dist_info.py": (f"{_TW}/test_dist_info.py", *_WHEELS),
    f"{_W}/wheels/record.py": (f"{_TW}/test_record.py", *_WHEELS),
    f"{_W}/wheels/extensions.py": (f"{_TW}/test_extensions.py", *_WHEELS),
    f"{_W}/store/unpacking.py": (f"{_TW}/test_store.py",),
    f"{_W}/store/store.py": (f"{_TW}/test_store.py",),
    f"{_W}/store/data_store.py": (f"{_TW}/test_data_store.py",),
    f"{_W}/store/checking.py": (f"{_TW}/test_checking.py",),
    f"{_W}/store/venvs.py": (f"{_TW}/test_venvs.py",),
    # Whether it may come in, among what is here.
    f"{_H}/manager/state_lock.py": (f"{_TH}/manager/test_state_lock.py",),
    f"{_H}/lifecycle/admission.py": _RELEASES,
    f"{_H}/lifecycle/payload_rules.py": (
        *_RELEASES,
        f"{_TH}/lifecycle/test_retry_causes.py",
        f"{_TH}/lifecycle/test_crash_attribution.py",
        f"{_TH}/lifecycle/test_safe_mode.py",
    ),
    f"{_H}/lifecycle/drive_rules.py": (
        f"{_TH}/lifecycle/test_crash_attribution.py",
        f"{_TH}/lifecycle/test_safe_mode.py",
    ),
    f"{_H}/lifecycle/safe_mode.py": (f"{_TH}/lifecycle/test_safe_mode.py",),
    f"{_H}/lifecycle/crash_attribution.py": (f"{_TH}/lifecycle/test_crash_attribution.py",),
    f"{_H}/jobs/install.py": (
        f"{_TH}/manager/test_memory_reservations.py::test_what_was_promised_while_it_was_copied_counts",
        f"{_TH}/jobs/test_install.py",
    ),
    # What processes of this host say that read what strangers wrote.
    f"{_H}/rpc/channel.py": (
        f"{_TH}/rpc/test_child_link.py",
        f"{_TH}/peers/streams/test_start.py::test_what_a_bridge_prints_goes_where_its_errors_go",
    ),
    f"{_H}/rpc/child_link.py": (f"{_TH}/rpc/test_child_link.py",),
    f"{_H}/rpc/outcomes.py": (f"{_TH}/rpc/test_outcomes.py",),
    # What its workers send, and take.
    f"{_S}/packets.py": (f"{_TS}/test_link.py",),
    f"{_S}/link.py": (f"{_TS}/test_link.py",),
    f"{_S}/pieces.py": (f"{_TS}/test_pieces.py",),
    f"{_S}/wire.py": (f"{_TS}/test_wire.py",),
    f"{_S}/wire_fields.py": (f"{_TS}/test_wire.py", f"{_TT}/streams/test_packets.py"),
    f"{_S}/packet_codec.py": (f"{_TS}/test_codec.py",),
    f"{_S}/codec/values.py": (f"{_TS}/test_codec.py",),
    f"{_S}/codec/checks.py": (f"{_TS}/test_codec.py",),
    f"{_S}/description.py": (f"{_TS}/test_description.py",),
    f"{_S}/source_check.py": (f"{_TS}/test_source_check.py",),
    f"{_S}/signature.py": (f"{_TS}/test_signature.py",),
    f"{_S}/messages/__init__.py": (f"{_TS}/test_messages.py",),
    f"{_S}/messages/fields.py": (f"{_TS}/test_messages.py",),
    "planning/nondum/planning/pddl/parse.py": ("tests/planning/test_parse.py",),
    f"{_H}/workers/index.py": (f"{_TH}/workers/test_index.py",),
    f"{_H}/workers/faults.py": (f"{_TH}/workers/test_faults.py",),
    f"{_H}/workers/news.py": (f"{_TH}/workers/test_news.py", f"{_TH}/control/test_news.py"),
    f"{_H}/workers/limits.py": (
        f"{_TH}/workers/test_excesses.py::test_too_much_ends_that_worker_alone",
        f"{_TH}/workers/test_excesses.py::test_without_control_groups_memory_is_looked_at",
    ),
    # How they are confined.
    f"{_H}/workers/confinement_choice.py": ("tests/sandbox/test_level.py",),
    f"{_H}/config/confinement_level.py": ("tests/sandbox/test_level.py",),
    f"{_H}/sandbox/levels/bubblewrap.py": (f"{_TC}/test_bubblewrap_command.py", *_IN_SANDBOXES),
    f"{_H}/sandbox/levels/landlock.py": (f"{_TC}/test_landlock.py", f"{_TC}/test_sandbox.py"),
    f"{_H}/sandbox/levels/host_children.py": (f"{_TC}/test_own_children.py",),
    f"{_H}/sandbox/levels/refusals.py": (
        *("tests/sandbox/test_refused_calls.py", "tests/sandbox/test_filters.py"),
    ),
    f"{_H}/sandbox/inside/bootstrap.py": (
        f"{_TI}/test_bootstrap.py",
        *_IN_SANDBOXES,
        *(f"{_TH}/workers/test_{each}.py" for each in ("spare", "host_death")),
    ),
    f"{_H}/workers/spare.py": (f"{_TH}/workers/test_spare.py",),
    f"{_H}/sandbox/inside/init.py": (
        *(f"{_TC}/test_service.py", *_IN_SANDBOXES, f"{_TH}/workers/test_host_death.py"),
    ),
    f"{_H}/sandbox/inside/kernel.py": (
        *(f"{_TI}/test_{each}.py" for each in ("kernel", "restrict")),
        *(f"{_TH}/sandbox/helper/test_worker_users.py", f"{_TC}/test_service.py", *_IN_SANDBOXES),
    ),
    f"{_H}/sandbox/inside/limits.py": (f"{_TI}/test_limits.py",),
    f"{_H}/sandbox/inside/inspect_self.py": (
        *(f"{_TI}/test_inspect_self.py", f"{_TC}/test_level.py", f"{_TC}/test_init.py"),
    ),
    f"{_H}/sandbox/inside/mounts.py": (
        f"{_TC}/test_service.py",
        *_IN_SANDBOXES[1:],
        f"{_TH}/workers/test_devices.py",
        f"{_TC}/test_restrictions.py::test_restriction_of_a_sandbox_matters[user namespaces]",
        f"{_TC}/test_restrictions.py::test_nothing_of_that_is_possible_in_a_whole_sandbox",
    ),
    f"{_H}/sandbox/inside/restrict.py": (f"{_TI}/test_restrict.py",),
    f"{_H}/sandbox/helper/requests.py": (f"{_TH}/sandbox/helper/test_requests.py",),
    f"{_H}/sandbox/helper/disks.py": (f"{_TH}/sandbox/helper/test_disks.py",),
    f"{_H}/sandbox/helper/device_nodes.py": (f"{_TH}/sandbox/helper/test_device_nodes.py",),
    f"{_H}/sandbox/helper/worker_users.py": (f"{_TH}/sandbox/helper/test_worker_users.py",),
    f"{_H}/sandbox/helper/service.py": (
        *(f"{_TH}/sandbox/helper/test_{each}.py" for each in ("service", "worker_users")),
        *_HELPER,
    ),
    f"{_H}/sandbox/helper/server.py": (f"{_TH}/sandbox/helper/test_worker_users.py", *_HELPER),
    f"{_H}/sandbox/helper/client.py": (*_HELPER, f"{_TC}/test_service.py"),
    # What other hosts say of themselves, and send.
    f"{_T}/discovery/announcement.py": (
        f"{_TT}/discovery/test_hint.py",
        f"{_TT}/discovery/test_discovery.py",
    ),
    f"{_T}/discovery/unicast_queries.py": (f"{_TT}/discovery/test_unicast_queries.py",),
    f"{_T}/discovery/hint_table.py": (f"{_TT}/discovery/test_hint_table.py",),
    f"{_T}/discovery/mdns_listener.py": (
        f"{_TT}/discovery/test_discovery.py",
        f"{_TT}/discovery/test_networks.py",
    ),
    f"{_T}/discovery/hint.py": (f"{_TT}/discovery/test_hint.py",),
    f"{_T}/discovery/packets.py": (f"{_TT}/discovery/test_packets.py",),
    f"{_T}/discovery/static_host.py": (f"{_TT}/discovery/test_static_host.py",),
    f"{_T}/fleet/catalogues.py": _TELLERS,
    f"{_T}/fleet/chunk.py": (f"{_TT}/fleet/test_ledger.py", f"{_TT}/fleet/test_replica.py"),
    f"{_T}/fleet/ledger.py": (f"{_TT}/fleet/test_ledger.py",),
    f"{_T}/fleet/mesh.py": (f"{_TT}/fleet/test_dialling.py",),
    f"{_T}/fleet/replica.py": (f"{_TT}/fleet/test_replica.py",),
    f"{_HZ}/line.py": _ZENOH,
    f"{_HZ}/node.py": _ZENOH,
    f"{_T}/streams/exporter.py": _GRANTS,
    f"{_T}/streams/incoming.py": _GRANTS,
    f"{_T}/peers/dialled.py": ("tests/transport/peers/test_descriptors.py",),
    f"{_T}/streams/outgoing.py": _GRANTS,
    f"{_T}/streams/packets.py": _GRANTS,
    f"{_T}/streams/sockets.py": _GRANTS,
    f"{_T}/streams/window.py": (f"{_TT}/streams/test_window.py",),
    f"{_H}/peers/streams/bridge.py": (
        f"{_TH}/peers/streams/test_start.py",
        f"{_OWNERS[1]}::test_killed_bridge_ends_its_streams_and_a_new_one_serves",
    ),
    f"{_H}/peers/streams/process.py": (f"{_TH}/peers/streams/test_start.py",),
    f"{_H}/peers/streams/inbound.py": (f"{_TH}/peers/streams/test_inbound.py",),
    f"{_H}/peers/streams/jpeg.py": (f"{_TH}/peers/streams/test_jpeg.py",),
    f"{_H}/peers/streams/remote_streams.py": _STREAMS,
    f"{_H}/peers/streams/shared_streams.py": _STREAMS,
    f"{_H}/peers/dispatch.py": (f"{_TH}/peers/test_dispatch.py",),
    f"{_H}/peers/stream_requests.py": (f"{_TH}/peers/test_dispatch.py",),
    f"{_H}/peers/peer_entries.py": (f"{_TH}/peers/test_shared.py",),
    f"{_H}/peers/serving.py": (f"{_TH}/peers/test_serving.py",),
    f"{_H}/peers/forwarded_goals.py": (f"{_TH}/peers/test_forwarded_goals.py",),
    f"{_H}/peers/goals.py": (f"{_TH}/peers/test_goals.py",),
    f"{_H}/peers/asking.py": (f"{_TH}/peers/test_asking.py",),
    f"{_H}/peers/translating.py": (f"{_TH}/peers/test_translating.py",),
    f"{_H}/peers/pairing_requests.py": (f"{_TH}/peers/test_pairing_requests.py",),
    f"{_H}/peers/trust_store.py": (f"{_TH}/peers/test_trust_store.py",),
    f"{_H}/peers/placement/fetching.py": (f"{_TH}/peers/placement/test_fetching.py",),
    # Which other hosts are let in, and what they may say.
    f"{_T}/peers/allowance.py": (f"{_TT}/peers/test_allowance.py",),
    f"{_T}/peers/socket_process/sockets.py": (f"{_TT}/peers/test_apart.py",),
    f"{_T}/peers/certificate.py": _PEER_KEYS,
    f"{_T}/peers/ed25519.py": _PEER_KEYS,
    f"{_T}/peers/enquiries.py": (f"{_TT}/peers/test_enquiries.py",),
    f"{_T}/peers/fleet_files.py": (f"{_TT}/peers/test_public_file.py",),
    f"{_T}/peers/gate.py": (*_ADMISSION, f"{_TT}/peers/test_death.py"),
    f"{_T}/peers/local_sockets.py": (
        *_ADMISSION,
        *(f"{_TT}/peers/test_{each}.py" for each in ("received", "descriptors")),
    ),
    f"{_T}/peers/identity.py": (f"{_TT}/peers/test_identity.py",),
    f"{_T}/peers/keys.py": _PEER_KEYS,
    f"{_T}/peers/link.py": (f"{_TT}/peers/test_presence.py",),
    f"{_T}/peers/messages.py": (f"{_TT}/peers/test_messages.py",),
    f"{_T}/peers/node.py": (*_ADMISSION, f"{_TT}/peers/test_received.py"),
    f"{_T}/peers/pairing.py": (*_PAIRING, f"{_TT}/peers/test_pairing_messages.py"),
    f"{_T}/peers/pairing_channel.py": (*_PAIRING[1:], f"{_TT}/peers/test_descriptors.py"),
    f"{_T}/peers/presence.py": (f"{_TT}/peers/test_presence.py",),
    f"{_T}/peers/private_file.py": _PEER_KEYS,
    f"{_T}/peers/proof.py": (f"{_TT}/peers/test_proof.py",),
    f"{_T}/peers/public_file.py": (f"{_TT}/peers/test_public_file.py",),
    f"{_T}/peers/peer_table.py": (
        *_ADMISSION,
        *(f"{_TT}/peers/test_{each}.py" for each in ("allowance", "calls", "death")),
    ),
    f"{_T}/peers/session.py": (*(_ADMISSION[0], *_PEER_CALLS, f"{_TT}/peers/test_presence.py"),),
    f"{_T}/peers/trust.py": (*_PEER_KEYS, *_ADMISSION),
    f"{_T}/peers/trust_file.py": _PEER_KEYS,
    f"{_T}/peers/zap.py": _ADMISSION,
    # What people and programs of this machine ask for.
    f"{_H}/control/arguments.py": _CONTROL,
    f"{_H}/control/protocol.py": _CONTROL,
    f"{_H}/control/server.py": _CONTROL,
}
"""Module → tests. What is plugged in, from its signature to its last frame."""

FOLDERS = (
    _W,
    f"{_H}/trust",
    f"{_H}/sources/drives",
    f"{_H}/sandbox/helper",
    f"{_H}/sandbox/levels",
    f"{_H}/sandbox/inside",
    f"{_H}/control",
    f"{_H}/rpc",
    f"{_H}/lifecycle",
    f"{_H}/workers",
    f"{_T}/discovery",
    f"{_T}/fleet",
    _HZ,
    f"{_T}/streams",
    f"{_T}/peers",
    f"{_H}/peers/streams",
    f"{_H}/peers",
)
"""Folders in which every module that refuses something is guarded, or stands aside."""

_BUILDS = "builds payloads, which are judged where they are plugged in"
_SPEAKS = "finds words for what another has refused"
_ORDERED = "refuses what a person orders and what is not so here"
_ASKED = "refuses questions about what is not here"
_WHOLE = (
    "is tried with whole daemons (tests/daemon/test_placed_by_strangers.py), step by step not yet"
)
_RUNS = "tells how work of this host's own has ended"
ASIDE: Mapping[str, str] = {
    f"{_H}/trust/vocabulary_check.py": "remarks on a payload's words; planning judges them",
    f"{_H}/sandbox/helper/lamps.py": "shows a state; refuses lamps that this machine lacks",
    f"{_H}/sandbox/helper/stop_key.py": "reads one key; refuses devices that lack it",
    f"{_H}/control/goal_orders.py": _ORDERED,
    f"{_H}/control/mount_orders.py": _ORDERED,
    f"{_H}/control/payload_orders.py": _ORDERED,
    f"{_H}/control/stream_orders.py": _ORDERED,
    f"{_H}/control/log_questions.py": _ASKED,
    f"{_H}/control/mind_questions.py": _ASKED,
    f"{_H}/control/rows.py": "tells problems that others have found",
    f"{_H}/workers/streams.py": "wires inputs; tells which of them is ambiguous",
    f"{_T}/streams/broker.py": "introduces the ends of a stream to each other",
    f"{_W}/build/build.py": _BUILDS,
    f"{_W}/build/capture.py": _BUILDS,
    f"{_W}/build/data_payload.py": _BUILDS,
    f"{_W}/build/resolve.py": _BUILDS,
    f"{_W}/build/source.py": _BUILDS,
    f"{_W}/build/scaffold.py": _BUILDS,
    f"{_W}/format/target.py": _BUILDS,
    f"{_W}/store/disk.py": _SPEAKS,
    f"{_H}/sources/drives/blocks.py": "finds drives; what is on them is judged as it is read",
    f"{_H}/sandbox/helper/mountinfo.py": "reads what the kernel lists",
    f"{_H}/sources/drives/debounce.py": "debounces; what is read of a drive is judged elsewhere",
    f"{_H}/sandbox/helper/__main__.py": "is started by systemd only",
    f"{_H}/control/client.py": "reads what the daemon answers",
    f"{_H}/control/tap.py": "passes on what the daemon tells",
    f"{_H}/manager/crash_loop.py": "counts deaths; what is left alone for them is `safe_mode`'s",
    f"{_H}/lifecycle/retry_rules.py": "tries again what `tries` left alone",
    f"{_H}/lifecycle/retry_causes.py": "says when what was refused is tried again",
    f"{_H}/lifecycle/component_rules.py": "keeps what others told of a worker",
    f"{_H}/lifecycle/replacement.py": "compares what two releases say; planning refuses",
    f"{_H}/workers/loop_stacks.py": "reads where a worker stood, for people",
    f"{_H}/jobs/child.py": _RUNS,
    f"{_H}/jobs/children.py": _RUNS,
    f"{_H}/jobs/compile.py": _RUNS,
    f"{_H}/manager/effect_handlers.py": _RUNS,
    f"{_H}/forking/fork_client.py": _RUNS,
    f"{_H}/forking/fork_server.py": _RUNS,
    f"{_H}/manager/installation.py": _RUNS,
    f"{_H}/manager/rollback.py": "has a person's wish fulfilled by what was admitted",
    f"{_H}/manager/initial_components.py": _RUNS,
    f"{_H}/lifecycle/recovery.py": _RUNS,
    f"{_H}/lifecycle/releases.py": "puts what was admitted in order",
    f"{_H}/workers/unconfined.py": "test_restrict.py leaves out each thing that it takes away",
    f"{_H}/workers/init_link.py": _RUNS,
    f"{_H}/workers/problems.py": _SPEAKS,
    f"{_H}/workers/supervisor.py": _RUNS,
    f"{_H}/workers/running_calls.py": _SPEAKS,
    f"{_H}/workers/worker.py": _SPEAKS,
    f"{_H}/workers/worker_start.py": _SPEAKS,
    f"{_H}/workers/workers.py": _RUNS,
    f"{_T}/discovery/discovery.py": "tells of hints that have no address to go to",
    f"{_T}/discovery/interfaces.py": "reads what the kernel lists",
    f"{_T}/discovery/multicast.py": "tells which interfaces of this machine cannot be used",
    f"{_T}/peers/arrivals.py": "counts what ZeroMQ has turned away",
    f"{_T}/peers/calls.py": "bounds what this host itself asks of others",
    f"{_T}/peers/dial.py": "tells why a peer is not reached",
    f"{_T}/peers/drained.py": "says whether messages wait still",
    f"{_T}/peers/incoming_calls.py": "answers with what work of this host's own has failed by",
    f"{_T}/peers/socket_process/service.py": "does what its own daemon says",
    f"{_T}/peers/routes.py": "tells why a peer is not reached",
    f"{_H}/peers/name_conflicts.py": "says what people are told; `peer_table` refuses",
    f"{_T}/peers/pairing_problems.py": "says what people are told; `pairing_channel` refuses",
    f"{_H}/peers/finder.py": "passes on the addresses that the mesh takes",
    f"{_H}/peers/fleet_transport.py": "refuses what this host is configured and not equipped for",
    f"{_H}/peers/peering.py": "says that a peer is not there",
    f"{_H}/peers/trust_orders.py": "asks a person of this host which peer is meant",
    f"{_H}/peers/placement/handover.py": _WHOLE,
    f"{_H}/peers/placement/taking.py": _WHOLE,
    f"{_H}/peers/placement/decide.py": "decides where payloads of this host go",
    f"{_H}/peers/placement/orders.py": "tells a person of this host what cannot be placed",
    f"{_H}/peers/streams/outbound.py": "sends what workers of this host made;"
    " `transport/streams` judges its reader",
    f"{_H}/peers/streams/service.py": "does what its own daemon says",
}
"""Module → why removing a refusal from it lets nothing in."""

_FORM = "what it refuses is not in the one form of a certificate, either"
_LIMIT = "tells of a limit of this host"
_EITHER = "where there is no code, there is no try either, and each is refused"
_RESTORED = "it is refused as it is restored, too"
_NO_OFFER = "of a component that is not there nothing is offered, and each is refused"
_QUICKER = "is done ahead for speed only"
_MONITOR = "the socket's monitor tells of the same end"
SPARED: Mapping[tuple[str, str], str] = {
    (f"{_T}/streams/outgoing.py", "case Sent.GONE"): _MONITOR,
    (
        f"{_T}/streams/outgoing.py",
        "self._way.send([packets.told(Pong(at_s, self._loop.time()))]) is Sent.GONE",
    ): _MONITOR,
    (f"{_H}/sandbox/inside/mounts.py", 'os.makedirs("/etc", exist_ok=True)'): (
        "is there already, but on a host that has none of the settings that libraries look for"
    ),
    (f"{_H}/sandbox/inside/mounts.py", 'Path("/proc/self/setgroups").write_text("deny")'): (
        "is inherited from the user namespace that bubblewrap makes"
    ),
    (
        f"{_H}/sandbox/inside/mounts.py",
        "revoke(need)",
    ): "the host has taken away the one before it already",
    (f"{_H}/sandbox/inside/bootstrap.py", "for … in PRELOADED"): _QUICKER,
    (f"{_H}/sandbox/inside/bootstrap.py", "importlib.import_module(name)"): _QUICKER,
    (f"{_T}/discovery/mdns_listener.py", "not _INSTANCE.fullmatch(name)"): (
        "another name is not made of the key either, which is refused below"
    ),
    (
        f"{_HZ}/node.py",
        "self._peer_table.session(peer).notify(Notice(method, args)) is Sent.FULL",
    ): _LIMIT,
    (
        f"{_T}/peers/node.py",
        "self._peer_table.session(peer).notify(Notice(method, args)) is Sent.FULL",
    ): _LIMIT,
    (f"{_T}/peers/local_sockets.py", "received is None"): (
        "the socket's monitor has told of a connection before there is a link"
    ),
    (f"{_T}/peers/local_sockets.py", "received.ahead(read) <= MOST_AHEAD"): (
        "saves a look at what waits; what is no more than that is within the limit below, too"
    ),
    (f"{_T}/peers/pairing_channel.py", "not isinstance(shown, Comparing)"): _EITHER,
    (f"{_T}/peers/pairing_channel.py", "self._try is None"): _EITHER,
    (f"{_T}/peers/certificate.py", "len(data) > MAX_BYTES"): _FORM,
    (f"{_T}/peers/certificate.py", "header != _HEADER"): _FORM,
    (f"{_T}/peers/certificate.py", 'names != (*_FIELDS, "")'): _FORM,
    (f"{_HZ}/node.py", "link.session is None and not link.is_over"): (
        "tells of a host that does not answer, which is let in by nothing"
    ),
    (f"{_H}/peers/serving.py", "component is None"): _NO_OFFER,
    (f"{_H}/peers/serving.py", "offer is None"): _NO_OFFER,
    (f"{_H}/peers/placement/fetching.py", "len(data) != piece.length"): (
        "what is shorter or longer has another hash"
    ),
    (f"{_H}/peers/goals.py", "able"): "asks a person which of two hosts is meant",
    (f"{_H}/peers/goals.py", "except NondumError"): "passes on why a peer has refused",
    (f"{_H}/peers/goals.py", "except GoalRefused"): "tells which peer was not stopped",
    (f"{_H}/peers/streams/inbound.py", "kind not in MESSAGES"): "what was asked for is one of them",
    (f"{_H}/peers/streams/inbound.py", 'self.producer.kind != "image"'): _RESTORED,
    (f"{_H}/peers/streams/inbound.py", "not frame.pieces"): _RESTORED,
    (f"{_H}/peers/streams/jpeg.py", "picture.mode != mode"): (
        "Pillow gives no bytes of one mode as those of another"
    ),
    (f"{_H}/peers/streams/remote_streams.py", "wanted.kind != kind"): (
        "both readers are workers of this host, whose plan has matched the types"
    ),
    (f"{_H}/peers/streams/remote_streams.py", 'opened.get("type") != wanted.kind'): (
        "the bridge refuses a stream of another type, too"
    ),
}
"""(Module, condition) → why no test can or need miss that step."""
