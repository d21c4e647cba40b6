"""Makes what talks with people: answers to their questions, and what speaks and listens."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nondum.host.assembly.base import Base
from nondum.host.mind.mind import Mind
from nondum.host.people.answering import Answering
from nondum.host.people.conversation import Conversation, Take
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
    base: Base, workers: Workers, mind: Mind, peers: PeerServices | None, take: Take
) -> ConversationParts:
    """Make what talks with people; `take` makes goals of what they say."""
    ask = peers.asking.ask if peers else None
    answering = Answering(mind, lambda: base.catalogue.snapshot().payloads, workers.busy, ask)
    conversation = Conversation(mind, workers.pids, take, answering.answer)
    return ConversationParts(answering, conversation)
