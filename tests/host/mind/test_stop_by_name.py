"""Which hosts stop by a sentence with a name, where phrases may say the same words."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests.host.mind.robot import HOST, Robot
from tests.planning.strangers import COMPTON_CAMERA, PAN_TILT_UNIT

from nondum.host.people.stopping import is_stop_for_stranger, said_to
from nondum.sdk.description import Label

pytestmark = pytest.mark.anyio

ALONE = (HOST,)


@pytest.fixture
def stoppable(robot: Robot) -> Robot:
    """It has a phrase that begins with a word that stops, for a target called as itself, too."""
    target = "radiation-source"
    sensing = replace(COMPTON_CAMERA, labels=(Label(target, "source"), Label(target, HOST)))
    phrases = tuple(replace(b, phrases=("stop {t}",)) for b in PAN_TILT_UNIT.behaviours)
    robot.plug(sensing, replace(PAN_TILT_UNIT, behaviours=phrases))
    return robot


@pytest.mark.parametrize("said", [f"halt {HOST}", f"please halt, {HOST}", f"{HOST}, stop"])
async def test_own_name_is_known_before_the_word_and_behind(stoppable: Robot, said: str) -> None:
    host, rest = said_to(said, ALONE, stoppable.mind)
    assert (host, rest) in ((HOST, "halt"), (HOST, "stop"))


async def test_name_behind_is_known_where_nothing_is_plugged_in(robot: Robot) -> None:
    assert said_to(f"stop {HOST}", ALONE, robot.mind) == (HOST, "stop")
    assert said_to("stop mule", (HOST, "mule"), robot.mind) == ("mule", "stop")
    assert is_stop_for_stranger("stop river", robot.mind)


async def test_sentence_of_a_phrase_is_no_name_behind(stoppable: Robot) -> None:
    said = f"stop {HOST}"
    assert said_to(said, ALONE, stoppable.mind) == (None, said)
    assert not is_stop_for_stranger(said, stoppable.mind)
    assert not is_stop_for_stranger("stop source", stoppable.mind)


async def test_what_a_phrase_has_no_name_for_is_no_host(stoppable: Robot) -> None:
    assert not is_stop_for_stranger("stop river", stoppable.mind)
    assert is_stop_for_stranger("halt river", stoppable.mind)
    assert is_stop_for_stranger("river, stop", stoppable.mind)


async def test_other_sentences_are_addressed_to_no_host(stoppable: Robot) -> None:
    for said in ("stop the music", "halt at the gate", f"look at {HOST}"):
        assert said_to(said, ALONE, stoppable.mind) == (None, said)
        assert not is_stop_for_stranger(said, stoppable.mind)
