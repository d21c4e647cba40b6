"""Understands what a person says in words that no phrase has, by a language model."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

from nondum.sdk import (
    BehaviourFailed,
    Context,
    Data,
    Fragment,
    Phrase,
    Unit,
    behaviour,
    hookimpl,
)
from nondum.sdk.settings import parse_settings
from nondum_language_model.model import Model
from nondum_language_model.settings import Settings
from nondum_phrase_choice import choice


class LanguageModel:
    """The plugin: one model in memory, from when it is first asked or loaded in advance."""

    def __init__(self) -> None:
        self._settings = Settings()
        self._loaded: tuple[Data, Model] | None = None
        self._one_at_a_time = asyncio.Lock()

    @hookimpl
    def describe(self) -> dict[str, str]:
        """What it is."""
        return {"summary": "Understands goals in a person's own words."}

    @hookimpl
    def units(self) -> tuple[Unit, ...]:
        """What acts."""
        return (Unit("model", "language-model"),)

    @hookimpl
    def fragments(self) -> tuple[Fragment, ...]:
        """What it can do for a plan."""
        return (Fragment.from_package("nondum_language_model", "domain.pddl"),)

    @hookimpl
    def phrases(self) -> tuple[Phrase, ...]:
        """How people ask for it."""
        pattern = "[please] load the language model"
        return (Phrase(pattern, "(language-model-loaded self)", kind="maintain"),)

    @hookimpl
    async def start(self, ctx: Context) -> None:
        """Refuse wrong settings."""
        self._settings = parse_settings(Settings, ctx.settings, where=ctx.component)

    @behaviour("load", action="(load ?u - language-model ?h - host)", lasting=True)
    async def load(self, ctx: Context, u: str, h: str) -> None:
        """Load the model before it is asked. Fails with DATA_MISSING and WEIGHTS_UNREADABLE."""
        async with self._one_at_a_time:
            await self._model(ctx)
        await ctx.established()
        await asyncio.Event().wait()

    @hookimpl
    async def translate_goal(
        self, ctx: Context, words: str, vocabulary: Mapping[str, Any]
    ) -> dict[str, str] | None:
        """Choose the phrase that means the same, if there is one; in the log is what was asked."""
        phrases = choice.phrases_of(vocabulary)
        if not phrases or ctx.data("model") is None:
            return None
        instructions, schema = choice.instructions(phrases), choice.schema(phrases)
        async with self._one_at_a_time:
            model = await self._model(ctx)
            answer = await asyncio.to_thread(model.answer, instructions, words, schema)
        ctx.log.debug("the instructions of the model: %s", instructions)
        return choice.translation(words, answer, phrases, ctx.log)

    async def _model(self, ctx: Context) -> Model:
        """The model that is shown now; the one before is left."""
        data = ctx.data("model")
        if data is None:
            self._loaded = None
            raise BehaviourFailed("no model is here", code="DATA_MISSING")
        if self._loaded is None or self._loaded[0] != data:
            self._loaded = None
            model = await asyncio.to_thread(Model, data.path, self._settings, ctx.scratch)
            self._loaded = data, model
        return self._loaded[1]
