"""Makes what talks with people: answers to their questions, and what speaks and listens."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from nondum.host.mind.mind import Mind
from nondum.host.people.answering import Answering
from nondum.host.people.conversation import Conversation, Take
from nondum.host.people.feedback.state_reasons import Known
from nondum.host.workers.workers import Workers
from nondum.sdk.frozen import frozen

if TYPE_CHECKING:
    from nondum.host.peers.peer_services import PeerServices


@frozen
class ConversationParts:
    """What talks with people."""

    answering: Answering
    conversation: Conversation


def make_conversation(
    workers: Workers,
    mind: Mind,
    peers: PeerServices | None,
    *,
    take: Take,
    known: Callable[[], Known],
) -> ConversationParts:
    """Make what talks with people; `take` makes goals of what they say, `known` is what the host
    shows its state by."""
    ask = peers.asking.ask if peers else None
    answering = Answering(mind, known, workers.busy, ask)
    conversation = Conversation(mind, workers.pids, take, answering.answer)
    return ConversationParts(answering, conversation)
