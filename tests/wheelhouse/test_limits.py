"""Limits of workers: asked for in a manifest, bounded by a role in the trust file and by a host."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests.kit.signing import Key, trust_of
from tests.wheelhouse.locks import FACTS, locked

from nondum.sdk.errors import PayloadRefused, TrustRefused
from nondum.wheelhouse.format import manifest
from nondum.wheelhouse.format.limits import WorkerLimits
from nondum.wheelhouse.format.signatures import Grant
from nondum.wheelhouse.payload.memory import Memory
from nondum.wheelhouse.payload.preflight import preflight
from nondum.wheelhouse.trust import trust_file, trust_text

ASKED = "[component.limits]\nmemory_mb = 600\nnumeric_threads = 4\nstartup_s = 120\n"
ALL = WorkerLimits(600, 300, 4, 120, 500)


def parsed(*limits: str, requires: str = "") -> manifest.Manifest:
    """A manifest with a component for each text of limits."""
    text = f'id = "org.example.x"\nname = "x"\n[requires]\n{requires}\n'
    for number, table in enumerate(limits):
        text += f'[[component]]\nid = "c{number}"\ndistribution = "dist-c{number}"\n{table}'
    return manifest.parse(text, "payload.toml")


def test_component_asks_for_some_limits_and_has_the_hosts_for_the_rest() -> None:
    first, second = parsed(ASKED, "").components
    assert first.limits == WorkerLimits(memory_mb=600, numeric_threads=4, startup_s=120)
    assert second.limits == WorkerLimits()


@pytest.mark.parametrize(
    ("requires", "reserved_mb"), [("", 700), ("memory_mb = 500", 700), ("memory_mb = 900", 900)]
)
def test_memory_of_all_components_is_what_a_payload_requires(
    requires: str, reserved_mb: int
) -> None:
    other = "[component.limits]\nmemory_mb = 100\n"
    assert parsed(ASKED, "", other, requires=requires).requires.memory_mb == reserved_mb


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("memory_mb = -1", "MANIFEST_VALUE"),
        ('tasks = "many"', "MANIFEST_VALUE"),
        ("startup_s = 1.5", "MANIFEST_VALUE"),
        ("descriptors = 9", "MANIFEST_KEY"),
    ],
)
def test_wrong_limit_is_told_with_its_line(line: str, code: str) -> None:
    with pytest.raises(PayloadRefused) as refused:
        parsed("", f"[component.limits]\n{line}\n")
    (problem,) = refused.value.problems
    assert (problem.code, problem.where) == (code, "payload.toml:12")


def test_what_the_host_allows_is_granted() -> None:
    facts = replace(FACTS, most=ALL)
    assert preflight(parsed(ASKED), {"c0": locked("c0")}, facts) == ()


def test_what_the_host_does_not_allow_is_refused_with_both_numbers() -> None:
    facts = replace(FACTS, most=replace(ALL, memory_mb=500, startup_s=60))
    memory, start = preflight(parsed(ASKED), {"c0": locked("c0")}, facts)
    assert [memory.code, start.code] == ["LIMIT_NOT_GRANTED"] * 2
    assert (memory.where, memory.need, memory.have) == (
        *("c0: memory_mb", "600 MB of memory"),
        "at most 500",
    )
    assert "most_startup_s" in start.fix


def test_memory_that_is_not_free_is_refused_although_the_host_allows_it() -> None:
    facts = replace(FACTS, memory=Memory(500), most=ALL)
    (problem,) = preflight(parsed(ASKED), {"c0": locked("c0")}, facts)
    assert (problem.code, problem.need, problem.have) == ("NO_MEMORY", "600 MB", "500 MB")


def test_role_bounds_what_its_payloads_ask_for() -> None:
    grant = Grant(role="acme", most=WorkerLimits(memory_mb=500, tasks=1))
    (problem,) = grant.problems(parsed(ASKED, ""))
    assert (problem.code, problem.where) == ("LIMIT_NOT_GRANTED", "c0: memory_mb")
    assert Grant(role="acme").problems(parsed(ASKED)) == ()


def test_bounds_of_a_role_survive_the_text_of_the_trust_file() -> None:
    trust = trust_of(roots=[Key("ada")], roles={"maker": (["org.example"], [Key("ben")])})
    (role,) = trust.roles
    bounded = replace(trust, roles=(replace(role, most=WorkerLimits(memory_mb=500, tasks=9)),))
    text = trust_text.to_text(bounded)
    assert trust_file.parse(text, "trust.toml") == bounded
    with pytest.raises(TrustRefused) as refused:
        trust_file.parse(text.replace("tasks = 9", "tasks = true"), "trust.toml")
    assert [problem.code for problem in refused.value.problems] == ["TRUST_VALUE"]
