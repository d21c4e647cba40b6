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
from nondum.sdk.errors import NondumError
from nondum.sdk.settings import parse_settings
from nondum_language_model.model import Model
from nondum_language_model.settings import Settings
from nondum_phrase_choice import choice

LOOKS_S = 1.0
"""Between two looks at what is shown, while a model is loaded."""


class LanguageModel:
    """The plugin: one model in memory, from when it is first asked or loaded in advance."""

    def __init__(self) -> None:
        self._settings = Settings()
        self._loaded: tuple[Data, asyncio.Task[Model]] | None = None
        self._is_loaded = asyncio.Event()

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
        ctx.spawn(self._leave_what_is_pulled(ctx))

    @hookimpl
    async def stop(self, ctx: Context) -> None:
        """End the model's process."""
        await self._leave()

    @behaviour("load", action="(load ?u - language-model ?h - host)", lasting=True)
    async def load(self, ctx: Context, u: str, h: str) -> None:
        """Load the model before it is asked, and another one that takes its place.

        Fails with DATA_MISSING, WEIGHTS_UNREADABLE and MODEL_ENDED.
        """
        while (data := ctx.data("model")) is not None:
            await self._model(ctx)
            await ctx.established()
            while ctx.data("model") == data:
                await ctx.sleep(LOOKS_S)
        raise BehaviourFailed("no model is here", code="DATA_MISSING")

    @hookimpl
    async def translate_goal(
        self, ctx: Context, words: str, vocabulary: Mapping[str, Any]
    ) -> dict[str, str] | None:
        """Choose the phrase that means the same, if there is one; in the log is what was asked."""
        phrases = choice.phrases_of(vocabulary)
        if not phrases or ctx.data("model") is None:
            return None
        instructions, schema = choice.instructions(phrases), choice.schema(phrases)
        ctx.log.info("the instructions of the model: %s", instructions)
        model = await self._model(ctx)
        try:
            answer = await model.answer(instructions, words, schema)
        except BehaviourFailed as failed:
            if failed.code == "MODEL_ENDED":
                await self._leave()
            raise
        return choice.translation(words, answer, phrases, ctx.log)

    async def _model(self, ctx: Context) -> Model:
        """The model that is shown now; the one before is left. Who is cancelled meanwhile leaves it
        loading for the next one."""
        data = ctx.data("model")
        if data is None:
            raise BehaviourFailed("no model is here", code="DATA_MISSING")
        if self._loaded is None or self._loaded[0] != data:
            await self._leave()
            loading = Model.load(data.path, self._settings, ctx.scratch)
            self._loaded = data, asyncio.create_task(loading)
            self._is_loaded.set()
        task = self._loaded[1]
        try:
            return await asyncio.shield(task)
        except NondumError:
            if self._loaded is not None and self._loaded[1] is task:
                self._loaded = None
            raise

    async def _leave_what_is_pulled(self, ctx: Context) -> None:
        while True:
            await self._is_loaded.wait()
            self._is_loaded.clear()
            while self._loaded is not None and self._loaded[0] == ctx.data("model"):
                await ctx.sleep(LOOKS_S)
            await self._leave()

    async def _leave(self) -> None:
        """End the model's process, loaded or not; who is cancelled meanwhile leaves that to the
        next."""
        if self._loaded is None:
            return
        _, task = self._loaded
        task.cancel()
        (loaded,) = await asyncio.gather(task, return_exceptions=True)
        if isinstance(loaded, Model):
            await loaded.end()
        if self._loaded is not None and self._loaded[1] is task:
            self._loaded = None
