"""A behaviour tree as XML of BehaviorTree.CPP 4, which Groot2 opens.

Source: https://www.behaviortree.dev/docs/learn-the-basics/xml_format, and what the library's own
parser (`xml_parsing.cpp`, 4.10) refuses. Composites become the library's own control nodes; leaves
become custom nodes, with a port for each argument, declared in `TreeNodesModel`.

A plan becomes a separate tree: its steps side by side, each held back by `Await` until the steps
before it are over and its guard holds. That is less than a task tree does: nothing is skipped, and
what was undone is not done again.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree as ET

from nondum.host.core.printable import printable

Node = Mapping[str, Any]

MAIN = "nondum"
"""The tree that is executed."""
AWAIT = "Await"
"""An action that is RUNNING until the steps `after` are over and the `facts` hold."""
HOLDS = "Holds"
"""A condition: the `facts` hold."""

_ALL = {"success_count": "-1", "failure_count": "1"}
_ONE = {"success_count": "1", "failure_count": "1"}


def groot(root: Node) -> str:
    """The tree as one XML document."""
    document = _Document()
    document.node(document.tree(MAIN), root)
    return document.text()


class _Document:
    """Trees and models as they come up."""

    def __init__(self) -> None:
        self._trees: dict[str, ET.Element] = {}
        self._models: dict[str, ET.Element] = {}

    def text(self) -> str:
        root = ET.Element("root", {"BTCPP_format": "4", "main_tree_to_execute": MAIN})
        root.extend(self._trees.values())
        models = ET.SubElement(root, "TreeNodesModel")
        models.extend(model for _, model in sorted(self._models.items()))
        ET.indent(root)
        return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"

    def tree(self, name: str) -> ET.Element:
        """Add an empty tree to the file."""
        id = identifier(name)
        self._trees[id] = ET.Element("BehaviorTree", ID=id)
        return self._trees[id]

    def node(self, parent: ET.Element, node: Node) -> None:
        """Write a node and all below it."""
        if "task" in node:
            own = self.tree(node["name"])
            described = _description(node)
            ET.SubElement(parent, "SubTree", {"ID": own.get("ID", ""), **described})
            self._task(own, node)
        elif node["children"]:
            control = self._control(parent, node)
            for child in node["children"]:
                self.node(control, child)
        else:
            ports = node.get("behaviour") or {"does": node["name"]}
            self._leaf(parent, "Action", _of_class(node), ports, node)

    # Composites

    def _control(self, parent: ET.Element, node: Node) -> ET.Element:
        match node["kind"]:
            case "Parallel":
                counts = _ONE if node["policy"] == "SuccessOnOne" else _ALL
                return _element(parent, "Parallel", node, counts)
            case "Selector":
                return _element(parent, "Fallback" if node["memory"] else "ReactiveFallback", node)
            case "Sequence":
                return _element(parent, "Sequence" if node["memory"] else "ReactiveSequence", node)
            case "TaskSlot":  # the task, and where that fails, holding still
                return _element(parent, "ReactiveFallback", node)
            case _:
                id = _of_class(node)
                self._model("Control", id, {})
                return ET.SubElement(parent, "Control", {"ID": id, **_named(node)})

    # Plans

    def _task(self, tree: ET.Element, node: Node) -> None:
        steps = node["children"]
        if not steps:
            ET.SubElement(tree, "AlwaysSuccess")
            return
        task, parent = node["task"], tree
        if task.get("kind") != "maintain":  # then everything is halted once the goal holds
            parent = ET.SubElement(tree, "ReactiveFallback", name="until the goal holds")
            self._leaf(parent, "Condition", HOLDS, {"facts": task["goal"]})
        side_by_side = ET.SubElement(parent, "Parallel", {"name": "steps", **_ALL})
        for step in steps:
            if "step" in step:
                self._step(side_by_side, step)
            else:  # it runs on from a plan before
                self.node(side_by_side, step)

    def _step(self, parent: ET.Element, node: Node) -> None:
        step = node["step"]
        name = f"{step['number']} {step['schema']}: {step['state']}"
        sequence = ET.SubElement(parent, "ReactiveSequence", {"name": name, **_description(node)})
        facts = " ".join(f"({fact})" for fact in step["guard"])
        after = ";".join(str(number) for number in step["after"])
        self._leaf(sequence, "Action", AWAIT, {"after": after, "facts": facts})
        ports = {_port(name): value for name, value in step["arguments"].items()}
        self._leaf(sequence, "Action", identifier(step["schema"]), ports, node)

    # Leaves

    def _leaf(
        self,
        parent: ET.Element,
        category: str,
        id: str,
        ports: Mapping[str, str],
        node: Node | None = None,
    ) -> None:
        self._model(category, id, ports)
        attributes = {**(_named(node) if node else {}), **ports}
        if parent.tag == "ReactiveSequence":
            # The library knows its children only by tags that are registered names.
            ET.SubElement(parent, id, attributes)
        else:
            ET.SubElement(parent, category, {"ID": id, **attributes})

    def _model(self, category: str, id: str, ports: Mapping[str, str]) -> None:
        """Declare a custom node."""
        if id not in self._models:
            self._models[id] = ET.Element(category, ID=id)
            for port in ports:
                ET.SubElement(self._models[id], "input_port", name=port, type="std::string")


def identifier(text: str) -> str:
    """A name that the library, XML and file systems take.

    >>> identifier("lamp-post.shine"), identifier("goal 1"), identifier("3d.scan")
    ('lamp-post__shine', 'goal_1', '_3d__scan')
    """
    plain = re.sub(r"[^A-Za-z0-9_-]", "_", text.replace(".", "__"))
    return plain if plain[:1].isalpha() else f"_{plain}"


def _port(parameter: str) -> str:
    """A parameter's name as a port: these begin with a letter, and two are the library's own."""
    port = identifier(parameter)
    port = port if port[0].isalpha() else f"p{port}"
    return f"{port}_" if port in ("name", "ID") else port


def _of_class(node: Node) -> str:
    """A node of the host's own, or of an integrator's; no node of the library is called so."""
    return f"{identifier(node['kind'])}Node"


def _element(
    parent: ET.Element, tag: str, node: Node, more: Mapping[str, str] | None = None
) -> ET.Element:
    return ET.SubElement(parent, tag, {**_named(node), **(more or {})})


def _named(node: Node) -> dict[str, str]:
    return {"name": printable(node["name"]), **_description(node)}


def _description(node: Node) -> dict[str, str]:
    return {"_description": printable(str(node["why"]))} if node["why"] else {}
