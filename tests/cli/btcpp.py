"""What BehaviorTree.CPP 4 and Groot2 refuse in a tree's XML.

Source: `VerifyXML` and the schema of tree models in the library's own `xml_parsing.cpp`, 4.10.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.etree import ElementTree as ET

CONTROLS = frozenset(
    {
        "Fallback",
        "IfThenElse",
        "Parallel",
        "ParallelAll",
        "ReactiveFallback",
        "ReactiveSequence",
        "Sequence",
        "SequenceWithMemory",
        "WhileDoElse",
    }
)
LEAVES = frozenset({"AlwaysFailure", "AlwaysSuccess", "Script", "Sleep"})
DECORATORS = frozenset({"Delay", "ForceFailure", "ForceSuccess", "Inverter", "Repeat", "Timeout"})
EXPLICIT = frozenset({"Action", "Condition", "Control", "Decorator"})
PORTS_OF_CONTROLS = {"Parallel": {"success_count", "failure_count"}}
FORBIDDEN = re.compile(r"""[\s<>&"'/\\:*?|.\x00-\x1f\x7f]""")


def refusals(text: str) -> list[str]:
    """Everything that is wrong with a document; nothing if it can be opened."""
    root = ET.fromstring(text.encode())
    return list(_of_root(root))


def _of_root(root: ET.Element) -> Iterator[str]:
    if root.tag != "root" or root.get("BTCPP_format") != "4":
        yield "the document is no <root BTCPP_format='4'>"
    trees = {tree.get("ID", ""): tree for tree in root.findall("BehaviorTree")}
    if root.get("main_tree_to_execute") not in trees:
        yield "there is no main tree"
    models = root.findall("TreeNodesModel")
    if len(models) != 1:
        yield f"{len(models)} TreeNodesModel"
    declared = {model.get("ID", ""): model for part in models for model in part}
    for model in declared.values():
        yield from _of_model(model)
    for name, tree in trees.items():
        if not name or FORBIDDEN.search(name) or name in CONTROLS | LEAVES | DECORATORS | {"Root"}:
            yield f"a tree may not be called {name!r}"
        if len(tree) != 1:
            yield f"tree {name} has {len(tree)} children"
        for node in tree:
            yield from _of_node(node, declared, trees)


def _of_model(model: ET.Element) -> Iterator[str]:
    name = model.get("ID", "")
    if model.tag not in EXPLICIT or not name or FORBIDDEN.search(name):
        yield f"<{model.tag} ID={name!r}> is no model"
    if name in CONTROLS | LEAVES | DECORATORS | EXPLICIT:
        yield f"{name} is the library's own"
    for port in model:
        port_name = port.get("name", "")
        if port.tag not in ("input_port", "output_port", "inout_port"):
            yield f"{name} has a <{port.tag}>"
        is_taken = port_name in ("name", "ID", "_autoremap")
        if not re.match("[A-Za-z]", port_name) or FORBIDDEN.search(port_name) or is_taken:
            yield f"{name} has a port {port_name!r}"


def _of_node(
    node: ET.Element, declared: dict[str, ET.Element], trees: dict[str, ET.Element]
) -> Iterator[str]:
    if node.tag == "SubTree":
        if len(node) or node.get("ID") not in trees:
            yield f"SubTree {node.get('ID')} is not there, or has children"
        return
    name = node.get("ID", "") if node.tag in EXPLICIT else node.tag
    model = declared.get(name)
    if model is None and name not in CONTROLS | LEAVES | DECORATORS:
        yield f"node not recognised: {name!r}"
        return
    yield from _of_children(node, name, model)
    yield from _of_ports(node, name, model)
    for child in node:
        if node.tag == "ReactiveSequence" and child.tag in EXPLICIT:
            yield f"unknown node type in a ReactiveSequence: {child.tag}"
        yield from _of_node(child, declared, trees)


def _of_children(node: ET.Element, name: str, model: ET.Element | None) -> Iterator[str]:
    category = model.tag if model is not None else ""
    if node.tag in EXPLICIT and category != node.tag:
        yield f"{name} is used as {node.tag}, and is {category or 'not declared'}"
    if (category in ("Action", "Condition") or name in LEAVES) and len(node):
        yield f"{name} must not have any child"
    if (category == "Control" or name in CONTROLS) and not len(node):
        yield f"{name} must have a child"
    if (category == "Decorator" or name in DECORATORS) and len(node) != 1:
        yield f"{name} must have one child"


def _of_ports(node: ET.Element, name: str, model: ET.Element | None) -> Iterator[str]:
    known = PORTS_OF_CONTROLS.get(name, set())
    if model is not None:
        known = {port.get("name", "") for port in model}
    for attribute in sorted(node.attrib.keys() - {"ID", "name"}):
        if not attribute.startswith("_") and attribute not in known:
            yield f"{name} has no port {attribute!r}"
