"""A tree as lines, as DOT and as Groot2's XML: what is drawn, and that others can read it."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from functools import cache
from typing import Any
from xml.etree import ElementTree as ET

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cli import pictures
from tests.cli.btcpp import refusals
from tests.cli.dot import read_dot

from nondum.cli.graphviz import graphviz, quoted
from nondum.cli.groot import groot, identifier
from nondum.cli.outline import outline

Draw = Callable[[], dict[str, Any]]
VIEWS: dict[str, Draw] = {
    "at rest": cache(pictures.at_rest),
    "following": cache(pictures.following),
    "reporting": cache(pictures.reporting),
}
views = pytest.mark.parametrize("view", VIEWS.values(), ids=VIEWS)

FOLLOWING = """\
▶ nondum
  ✓ monitor  — revision 2
  ✓ world model  — N facts hold
  ✓ goals  — goal 1: (following self person)
  ▶ task  — 2 of 4 steps are left
    ▶ goal 1  — 2 of 4 steps are left
      maintain (following rover person); the plan costs 4
      ∞ 1 recorded-camera.stream  kept since TIME
          with: u=rover__recorded-camera__camera,
            o=rover__recorded-camera__frames, h=rover
          kept for: step 2: (flowing rover__recorded-camera__frames), (from
            rover__recorded-camera__frames rover)
          locks: no (free rover__recorded-camera__frames) while it runs
          chosen: as cheap as any: it costs 1, rank 0; instead of
            thermal-camera.stream of thermal-camera (cost 1, rank 1)
      ∞ 2 people-detector.detect  kept since TIME
          with: u=rover__people-detector__hog,
            i=rover__recorded-camera__frames, o=rover__people-detector__found,
            h=rover, c=person
          kept for: step 3: (flowing rover__people-detector__found), (from
            rover__people-detector__found rover), (shows
            rover__people-detector__found person)
          locks: no (free rover__people-detector__found) while it runs
          chosen: nothing else could do it
      ▶ 3 visual-tracker.track  running since TIME  — starting
          with: u=rover__visual-tracker__tracker,
            d=rover__people-detector__found, o=rover__visual-tracker__steering,
            h=rover, c=person
          needed by: step 4: (steers rover__visual-tracker__steering rover
            person)
          locks: no (free rover__visual-tracker__steering) while it runs
          chosen: nothing else could do it
      · 4 mobile-base.drive  waiting
          with: u=rover__mobile-base__wheels,
            s=rover__visual-tracker__steering, h=rover, c=person
          waits for: (steers rover__visual-tracker__steering rover person) of
            step 3
          needed by: the goal: (following rover person)
          locks: rover__mobile-base__wheels of mobile-base, which serves one
            at a time; no (idle rover__mobile-base__wheels) while it runs
          chosen: nothing else could do it
    · hold  — a plan is carried out
  ✓ people  — N sentences told
"""


def plain(lines: list[str]) -> str:
    """Without colours, and what differs from run to run."""
    text = "".join(f"{click.unstyle(line)}\n" for line in lines)
    text = re.sub(r"since \d\d:\d\d:\d\d, [\d.]+ s", "since TIME", text)
    return re.sub(r"(world model|people)  — \d+", r"\1  — N", text)


def test_eighty_columns_say_why_each_step_is_where_it_is() -> None:
    assert plain(outline(VIEWS["following"](), width=80)) == FOLLOWING


def test_what_is_over_is_told_in_few_words() -> None:
    lines = plain(outline(VIEWS["reporting"]())).splitlines()
    (place,) = (n for n, line in enumerate(lines) if "visual-tracker.watch" in line and "✓" in line)
    assert re.search("done at .* — what the rest of the plan needs of it holds$", lines[place])
    labels = [line.split(":")[0].strip() for line in lines[place + 1 : place + 4]]
    assert labels == ["with", "needed by", "chosen"]


@views
def test_lines_fit_their_width(view: Draw) -> None:
    lines = plain(outline(view(), width=80)).splitlines()
    assert max(map(len, lines)) <= 80


@views
def test_a_pipe_gets_one_line_for_each_thing_said(view: Draw) -> None:
    folded = plain(outline(view(), width=80)).split()
    assert plain(outline(view())).split() == folded


# DOT


@views
def test_dot_has_every_node_with_colour_and_reason(view: Draw) -> None:
    graph = read_dot(graphviz(view()))
    assert len(graph.nodes) == count(view())
    for attributes in graph.nodes.values():
        assert attributes.keys() >= {"label", "tooltip", "fillcolor"}
        assert attributes["tooltip"]
    assert {end for edge in graph.edges for end in edge[:2]} == graph.nodes.keys()


def test_dot_has_the_causal_links() -> None:
    graph = read_dot(graphviz(VIEWS["following"]()))
    labels = {name: attributes["label"].split("\n")[0] for name, attributes in graph.nodes.items()}
    links = {
        (labels[giver], labels[taker]): " ".join(look["label"].split())
        for giver, taker, look in graph.edges
        if look.get("style") == "dashed"
    }
    assert links["4 mobile-base.drive", "goal 1"] == "(following rover person)"
    assert (
        "(shows rover__people-detector__found person)"
        in (links["2 people-detector.detect", "3 visual-tracker.track"])
    )


@given(st.text())
def test_any_text_can_be_quoted(text: str) -> None:
    graph = read_dot(f"digraph g {{ a [label={quoted(text)}]; }}")
    words = "".join(graph.nodes["a"]["label"].split())
    assert words.isprintable()


@views
def test_graphviz_draws_it(view: Draw) -> None:
    done = subprocess.run(
        ["dot", "-Tplain"], input=graphviz(view()), capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_the_reader_refuses_what_is_not_dot() -> None:
    for wrong in ("graph x { }", "digraph x { a -> ; }", 'digraph x { a [label="b] ; }'):
        with pytest.raises(ValueError):
            read_dot(wrong)


# Groot2


@views
def test_groot_opens_it(view: Draw) -> None:
    assert refusals(groot(view())) == []


@views
def test_groot_knows_every_argument_of_every_step(view: Draw) -> None:
    root = ET.fromstring(groot(view()).encode())
    for step in pictures.steps(view()):
        (node,) = root.findall(f".//BehaviorTree//{identifier(step['schema'])}")
        assert step["arguments"].items() <= node.attrib.items()


def test_groot_halts_all_once_an_achieved_goal_holds() -> None:
    tree = ET.fromstring(groot(VIEWS["reporting"]()).encode()).find("BehaviorTree[@ID='goal_1']")
    assert tree is not None
    assert [node.tag for node in tree] == ["ReactiveFallback"]
    assert [node.tag for node in tree[0]] == ["Condition", "Parallel"]
    assert tree[0][0].get("ID") == "Holds"


def test_groot_holds_steps_back_until_those_before_them_are_over() -> None:
    root = ET.fromstring(groot(VIEWS["following"]()).encode())
    assert [node.get("after") for node in root.iter("Await")] == ["", "1", "2", "3"]


def integrators(kind: str, *children: dict[str, Any], **more: Any) -> dict[str, Any]:
    """A node that an integrator's tree may have."""
    row = {"name": f"a {kind}", "kind": kind, "status": "RUNNING", "why": "", **more}
    return {**row, "children": list(children)}


def test_groot_opens_what_integrators_compose() -> None:
    leaf = integrators("Timeout")
    tree = integrators(
        "Sequence",
        integrators("Selector", leaf, memory=True),
        integrators("Selector", leaf, memory=False),
        integrators("Sequence", leaf, memory=False),
        integrators("Parallel", leaf, policy="SuccessOnOne"),
        integrators("Inverter", leaf),
        memory=True,
    )
    assert refusals(groot(tree)) == []


@given(st.text(min_size=1))
def test_identifiers_are_names_in_xml(text: str) -> None:
    ET.fromstring(f"<{identifier(text)}/>")


def test_the_rules_find_what_the_library_refuses() -> None:
    wrong = """<root BTCPP_format="4" main_tree_to_execute="main">
      <BehaviorTree ID="main"><Sequence>
        <Action ID="Unknown"/> <SubTree ID="nowhere"/> <Fallback/>
        <ReactiveSequence><Action ID="Move" to="x" name="move"/></ReactiveSequence>
        <Move speed="3"><AlwaysSuccess/></Move>
      </Sequence></BehaviorTree>
      <TreeNodesModel><Action ID="Move"><input_port name="to"/><input_port name="name"/></Action>
      </TreeNodesModel></root>"""
    assert refusals(wrong) == [
        "Move has a port 'name'",
        "node not recognised: 'Unknown'",
        "SubTree nowhere is not there, or has children",
        "Fallback must have a child",
        "unknown node type in a ReactiveSequence: Action",
        "Move must not have any child",
        "Move has no port 'speed'",
    ]


def count(view: dict[str, Any]) -> int:
    """How many nodes a tree has."""
    return 1 + sum(count(child) for child in view["children"])
