"""Understands what a person says in words that no phrase has, by a server of language models."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nondum.sdk import Context, hookimpl
from nondum.sdk.settings import parse_settings
from nondum_language_endpoint.endpoint import answer
from nondum_language_endpoint.settings import Settings
from nondum_phrase_choice import choice


class LanguageEndpoint:
    """The plugin: it keeps nothing from one question to the next."""

    def __init__(self) -> None:
        self._settings = Settings()

    @hookimpl
    def describe(self) -> dict[str, str]:
        """What it is."""
        return {"summary": "Understands goals in a person's own words, by a server."}

    @hookimpl
    async def start(self, ctx: Context) -> None:
        """Refuse wrong settings; tell once when no server is named."""
        self._settings = parse_settings(Settings, ctx.settings, where=ctx.component)
        if not self._settings.url:
            ctx.log.warning("no server is asked: its settings have no `url`")

    @hookimpl
    async def translate_goal(
        self, ctx: Context, words: str, vocabulary: Mapping[str, Any]
    ) -> dict[str, str] | None:
        """Choose the phrase that means the same, if there is one; in the log is what was asked."""
        phrases = choice.phrases_of(vocabulary)
        if not phrases or not self._settings.url:
            return None
        instructions, schema = choice.instructions(phrases), choice.schema(phrases)
        said = await answer(self._settings, instructions, words, schema)
        ctx.log.debug("the instructions of the model: %s", instructions)
        return choice.translation(words, said, phrases, ctx.log)
