"""The second demonstration: three hosts, of which two robots search with the parts of the third."""

from __future__ import annotations

import argparse
import functools
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

from demo import live, stages
from demo.drives import HERE, Target
from demo.follow_me import follow_me
from demo.following import Reference
from demo.kit import PLUGINS, Kit, set_up
from demo.live import Says
from demo.performance import Programme, parser, perform
from demo.robot import Robot, running
from demo.search import losing
from demo.search.person import Person
from demo.search.searching import ALERT, WORDS, Search
from demo.search.sites import Site, site
from demo.table import StageResult

FOLLOW = "follow me through the facility"
REFERENCE = PLUGINS / "panorama/nondum_panorama/data/pedestrians.toml"

ROBOT, NODE, SMALL = "panther", "node", "scout"
BASE = "mobile-base"
CAMERA = "thermal-camera"
FOR_NODE = ("people-detector", "visual-tracker", "speech", "speaker")
LIBRARIES = ("sdk", "espeak", "panorama")
SETTINGS = {
    "speech": 'microphone = ""\nsaid = "said"\n',
    "speaker": 'said = "said"\nreport = "I can see a {thing}."\n',
}
"""For a machine without sound; and what is said is easier to understand than one word."""
PUBLISHED_S = {ROBOT: 442, SMALL: 339}

PHASES = ("found", "payloads in", "understood", "in plan", "alert", "goal", "halted")
STEERED = "steered"
STAGES = (ROBOT, SMALL, STEERED, losing.NAME)
NOTE = (
    "Seconds after the stage's robot (and, in the first, the node) was switched on; for “steered”, "
    "after it was asked for, with the ten seconds over which it is judged; then after the node "
    "vanished. The published times are for a person with real robots and other hardware: they "
    "include the time to fetch and plug in payloads, and to walk up to be found; ours do not. "
    "Hosts here are processes of one machine, drives are folders, and the thermal camera is "
    "simulated, from a recording of real people."
)
OTHER_SENTENCES = ("i can see a robot", "i cannot see a person", "i have lost the person")
EXAMPLES = """\
examples:
  ./run demo search                       as root: in network namespaces, with keys
  ./run demo search --loopback            without: three processes that trust each other
  ./run demo search --json | jq .stages
  ./run demo search --without speaker     must fail: no speaker says the alert
"""


def main(arguments: Sequence[str]) -> int:
    """Run the demonstration; 0 only if every stage really happened."""
    options = _options(arguments)
    facts: dict[str, str] = {}
    play = functools.partial(_play, options, facts)
    stages = (options.only,) if options.only else STAGES
    return perform(Programme(stages, PHASES, NOTE), play, options, facts)


def _play(
    options: argparse.Namespace, facts: dict[str, str], work: Path, say: Says
) -> Iterator[StageResult]:
    say("building the payload drives (cached after the first time)")
    kit = search_kit(work)
    person = Person(work / "person", expects=(ALERT, *OTHER_SENTENCES))
    names = (ROBOT, NODE, SMALL)
    with ExitStack() as stack:
        where = stack.enter_context(site(work, names, is_loopback=options.loopback))
        say(f"{', '.join(names)}: {where.told}")
        facts["where"] = where.told
        shown: list[Robot] = []
        stack.enter_context(live.view(shown, is_shown=not (options.json or options.plain)))

        def switch_on(name: str, *initial: str) -> Robot:
            shown.append(_switched_on(where, work / name, kit, initial, stack))
            return shown[-1]

        yield from _played(options, where, kit, person, switch_on, say)


def _played(
    options: argparse.Namespace,
    where: Site,
    kit: Kit,
    person: Person,
    switch_on: Callable[..., Robot],
    say: Says,
) -> Iterator[StageResult]:
    say(f"{ROBOT}: it and the {NODE} are switched on; “{WORDS}”")
    begun_s = time.monotonic()
    node, robot = switch_on(NODE), switch_on(ROBOT, BASE)
    search = Search(node, person, is_incomplete=bool(options.without))
    stage = search.begin(robot, published_s=PUBLISHED_S[ROBOT], begun_s=begun_s)
    brought = [name for name in FOR_NODE if name not in options.without]
    search.equip(stage, {node: kit.of(brought), robot: kit.of([CAMERA])})
    yield search.run(stage)
    if options.only:
        return

    say(f"{SMALL}: it is switched on; the camera moves there; “{WORDS}”")
    begun_s = time.monotonic()
    small = switch_on(SMALL, BASE)
    stage = search.begin(small, published_s=PUBLISHED_S[SMALL], begun_s=begun_s)
    stages.withdraw(robot, kit.drives[CAMERA])
    search.equip(stage, {small: kit.of([CAMERA])})
    yield search.run(stage)

    with follow_me(small, Reference.read(REFERENCE), words=FOLLOW) as following:
        say(f"{STEERED}: the {NODE}'s detector and tracker steer {SMALL}; “{FOLLOW}”")
        yield following.ask(name=STEERED)
        say(f"{losing.NAME}: {where.lost}")
        yield losing.lose_node(where, node, following, [robot])


def _switched_on(
    where: Site, folder: Path, kit: Kit, initial: Sequence[str], stack: ExitStack
) -> Robot:
    """A host that runs until the stack is unwound; it is called as its folder."""
    folder.mkdir()
    name = folder.name
    more = where.prepare(name, folder / "state")
    return stack.enter_context(
        running(
            folder,
            name=name,
            initial=kit.of(initial),
            trust=kit.trust,
            more=more,
            inside=where.command_prefix(name),
        )
    )


def search_kit(work: Path, *, target: Target = HERE, settings: Mapping[str, str] = SETTINGS) -> Kit:
    """The drives of this demonstration; `settings` are lines of plugins' settings, by name."""
    folders = {name: set_up(name, work / "sources", text) for name, text in settings.items()}
    return Kit.built((BASE, CAMERA, *FOR_NODE), libraries=LIBRARIES, folders=folders, target=target)


def _options(arguments: Sequence[str]) -> argparse.Namespace:
    made = parser(
        "./run demo search",
        __doc__ or "",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument(
        "--loopback",
        action="store_true",
        help="no namespaces and no keys, even as root: processes on this machine's loopback",
    )
    made.add_argument(
        "--without",
        action="append",
        default=[],
        choices=FOR_NODE,
        metavar="PAYLOAD",
        help=f"leave this payload of the node out, which must fail: {', '.join(FOR_NODE)}",
    )
    made.add_argument("--only", choices=(ROBOT,), help="play this stage only")
    return made.parse_args(arguments)
