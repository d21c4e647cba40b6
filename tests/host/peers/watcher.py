"""A host with a component that looks and turns, as its peers may see it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nondum.host.core.events.facts import FactKnown
from nondum.host.core.records.component import ComponentRecord, ComponentState
from nondum.host.core.records.mount import MountPose
from nondum.host.core.records.snapshot import Snapshot
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.merge import merge
from nondum.sdk.description import Behaviour, Fragment, Output, PluginDescription, Unit

EYE = Unit("eye", "camera", outputs=(Output("image", "image"),))
HEAD = Unit("head", "pointer", users=1)


def description(*units: Unit) -> PluginDescription:
    behaviours = (
        Behaviour("look", "(look ?u - camera ?o - image ?h - host)", lasting=True),
        Behaviour("turn", "(turn ?u - pointer ?h - host)"),
    )
    return PluginDescription("watcher", "1.0", units=units, behaviours=behaviours)


def component(id: str = "watcher", *units: Unit, **more: Any) -> ComponentRecord:
    return ComponentRecord(
        id=id,
        payload="abc",
        payload_id="org.example.watcher",
        distribution="watcher",
        entry_point="watcher",
        version="1.0",
        state=ComponentState.READY,
        description=description(*(units or (EYE, HEAD))),
        venv=Path("/v"),
        site_packages=Path("/v/s"),
        scratch=Path("/x"),
        rank=3,
        **more,
    )


def snapshot(*components: ComponentRecord) -> Snapshot:
    mounts = (
        MountPose("mule__watcher__eye", (1.0, 0.0, 0.5), (0.0, 0.0, 0.0), "payload"),
        MountPose("mule__watcher__head", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), "payload"),
    )
    return Snapshot("mule", revision=1, components=components, mounts=mounts)


def no_claims(_: str) -> tuple[FactKnown, ...]:
    return ()


def merged_watcher() -> Merged:
    """What the behaviour `look` of the watcher means."""
    domain = """
    (define (domain watcher)
      (:predicates (rested ?u - unit))
      (:action look
        :parameters (?u - camera ?o - image ?h - host)
        :precondition (and (ready ?u) (output ?u ?o) (free ?o) (idle ?u))
        :effect (and (not (free ?o)) (not (idle ?u)) (flowing ?o) (from ?o ?h))))
    """
    described = PluginDescription(
        "watcher",
        "1.0",
        units=(EYE,),
        fragments=(Fragment("watcher.pddl", domain),),
        behaviours=description().behaviours[:1],
    )
    here = Contribution.from_description(described, host="mule", component="watcher")
    merged = merge([here], "mule")
    assert not merged.quarantined, merged.quarantined
    return merged
