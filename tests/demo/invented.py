"""Plugins that a test generates: whole packages of random words.

A talker produces a stream of text, lasting; a listener waits for one message of such a stream and
keeps what it said as the value of a fact, finishing. They share nothing but the core's words.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from string import Template

from demo.shuffle.words import Words

_OF_ALL = "distribution package module payload component unit behaviour action kind trait"
_PARAMETERS = "actor stream body goal_thing"
_TALKER = f"{_OF_ALL} {_PARAMETERS} slot says"
_LISTENER = f"{_OF_ALL} {_PARAMETERS} thing thing_type label verb heard done"

PROJECT = """\
[build-system]
requires = ["hatchling>=1.27"]
build-backend = "hatchling.build"
[project]
name = "$distribution"
version = "1.0"
description = "Made up"
requires-python = ">=3.11"
dependencies = ["nondum-sdk>=0.1,<0.2"]
[project.entry-points."nondum.plugins"]
$component = "$package.$module"
[tool.hatch.build.targets.wheel]
packages = ["$package"]
"""
PAYLOAD = """\
id = "$payload.$distribution"
name = "$label"
authors = ["$payload"]
licence = "Apache-2.0"
[requires]
python = ">=3.11"
[[component]]
id = "$component"
distribution = "$distribution"
[[component.unit]]
name = "$unit"
xyz = [0.0, 0.0, 0.0]
rpy = [0.0, 0.0, 0.0]
"""
PROBLEM = """\
(define (problem $module) (:domain $distribution) (:init ($trait $unit)))
"""
TALKER_DOMAIN = """\
(define (domain $distribution)
  (:types $kind - sensor)
  (:predicates ($trait ?$actor - $kind))
  (:action $action
    :parameters (?$actor - $kind ?$stream - text ?$body - host)
    :precondition (and (ready ?$actor) (on ?$actor ?$body) ($trait ?$actor)
                       (output ?$actor ?$stream) (free ?$stream))
    :effect (and (not (free ?$stream)) (flowing ?$stream) (from ?$stream ?$body))))
"""
TALKER_PLUGIN = '''\
"""Says $says, over and over."""
from nondum.sdk import Fragment, Header, Output, Text, Unit, behaviour, hookimpl

@hookimpl
def units():
    return [Unit("$unit", "$kind", outputs=(Output("$slot", "text"),))]

@hookimpl
def fragments():
    return [Fragment.from_package("$package", f"{name}.pddl") for name in ("$action", "$trait")]

@behaviour("$behaviour", action="($action ?$actor - $kind ?$stream - text ?$body - host)",
           lasting=True)
async def $behaviour(ctx, $actor, $stream, $body):
    output = ctx.output($stream)
    output.send(Text(Header(), "$says"))
    await ctx.established()
    while True:
        await ctx.sleep(0.05)
        output.send(Text(Header(), "$says"))
'''
LISTENER_DOMAIN = """\
(define (domain $distribution)
  (:types $kind - microphone $thing_type - object)
  (:constants $thing - $thing_type)
  (:predicates ($trait ?$actor - $kind) ($heard ?$actor - $kind ?$stream - stream)
               ($done ?$goal_thing - $thing_type ?$body - host))
  (:valued $heard)
  (:action $action
    :parameters (?$actor - $kind ?$stream - text ?$goal_thing - $thing_type ?$body - host)
    :precondition (and (ready ?$actor) ($trait ?$actor) (flowing ?$stream) (from ?$stream ?$body))
    :effect (and ($heard ?$actor ?$stream) ($done ?$goal_thing ?$body))))
"""
LISTENER_PLUGIN = '''\
"""Waits for words."""
from nondum.sdk import (BehaviourFailed, Fragment, Header, Label, Phrase, Text, Unit, behaviour,
                        hookimpl)

@hookimpl
def units():
    return [Unit("$unit", "$kind")]

@hookimpl
def fragments():
    return [Fragment.from_package("$package", f"{name}.pddl") for name in ("$action", "$trait")]

@hookimpl
def phrases():
    return [Phrase("$verb {$goal_thing:$thing_type}", "($done ?$goal_thing self)")]

@hookimpl
def labels():
    return [Label("$thing", "the $label")]

@behaviour("$behaviour", action="($action ?$actor - $kind ?$stream - text "
           "?$goal_thing - $thing_type ?$body - host)")
async def $behaviour(ctx, $actor, $stream, $goal_thing, $body):
    try:
        message = await ctx.input($stream).next(timeout_s=60.0)
    except TimeoutError:
        raise BehaviourFailed("nothing was said") from None
    ctx.know("$heard", $actor, $stream, value=Text(Header(), message.text))
'''


@dataclass(frozen=True, slots=True)
class Invented:
    """A made-up plugin's source folder, and every name in it."""

    folder: Path
    names: Mapping[str, str]
    """What it names → the name, a random word."""

    @property
    def entry_point(self) -> str:
        """The plugin's module."""
        return f"{self['package']}.{self['module']}"

    @property
    def payload_id(self) -> str:
        """The id of the payload that it makes."""
        return f"{self['payload']}.{self['distribution']}"

    @property
    def schema(self) -> str:
        """Its action in a merged domain."""
        return f"{self['distribution']}.{self['action']}"

    def object(self, host: str, local: str) -> str:
        """The object of its `unit` or `slot`."""
        return f"{host}__{self['component']}__{self[local]}"

    def __getitem__(self, what: str) -> str:
        return self.names[what]


def talker(folder: Path, words: Words) -> Invented:
    """Write a plugin that says a random word, `says`, on its output `slot`."""
    return _written(folder, words, _TALKER, TALKER_PLUGIN, TALKER_DOMAIN)


def listener(folder: Path, words: Words) -> Invented:
    """Write a plugin that makes `(heard unit stream)` true, valued with what the stream said, and
    `(done thing host)`, which `sentence` asks for."""
    return _written(folder, words, _LISTENER, LISTENER_PLUGIN, LISTENER_DOMAIN)


def sentence(listener: Invented) -> str:
    """What a person says to a listener."""
    return f"{listener['verb']} the {listener['label']}"


def _written(folder: Path, words: Words, roles: str, plugin: str, domain: str) -> Invented:
    names = {role: words.word() for role in roles.split()}
    home = folder / names["distribution"]
    files = {
        "pyproject.toml": PROJECT,
        "payload.toml": PAYLOAD,
        f"{names['package']}/__init__.py": "",
        f"{names['package']}/{names['module']}.py": plugin,
        f"{names['package']}/{names['action']}.pddl": domain,
        f"{names['package']}/{names['trait']}.pddl": PROBLEM,
    }
    for path, text in files.items():
        (home / path).parent.mkdir(parents=True, exist_ok=True)
        filled = Template(text).substitute({"label": names["distribution"], **names})
        (home / path).write_text(filled, encoding="utf-8")
    return Invented(home, names)
