"""How well spoken goals are heard.

    PYTHONPATH=plugins/espeak:plugins/speech python -m benchmarks.speech

Phrases of the shipped plugins, and sentences that are none, said by many synthesised voices at
several speeds, under noise. Where flite is installed, it says them too: a synthesiser that had no
part in making the pronunciations. `--people FOLDER` adds recordings of people who say none of the
phrases (WAV files, in any folder below). Writes docs/benchmarks/speech.md.
"""

from __future__ import annotations

import argparse
import itertools
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import numpy as np
from benchmarks import measuring

from nondum_speech.espeak import Espeak
from nondum_speech.grammar import Vocabulary
from nondum_speech.lexicon import lexicon
from nondum_speech.recogniser import FreeHearing, Recogniser, Recognition
from nondum_speech.sentences import sentences_of
from nondum_speech.settings import Settings
from nondum_speech.sound import Sound, read_wav

VOCABULARY = Vocabulary(
    (
        "[please] locate {target}",
        "[please] follow {class} [through {text}]",
        "[please] point at {target}",
        "[please] point the laser at {target}",
        "[please] report {class}",
        "[please] tell me of {class}",
        "[please] search for {class}",
        "[please] look for {class}",
    ),
    {
        "target": ("radiation source", "radioactive source", "source"),
        "class": ("me", "people", "persons", "person", "pedestrians", "pedestrian"),
    },
)
PHRASES = (
    "follow me",
    "follow people",
    "please follow the person",
    "follow me through the facility",
    "follow pedestrians through the old harbour",
    "point at the radiation source",
    "please point at the source",
    "point the laser at the radioactive source",
    "report people",
    "tell me of persons",
    "search for people",
    "please look for a person",
    "locate the radiation source",
    "please search for pedestrians",
)
NEAR = (
    "follow her",
    "paint the radiator",
    "search for purple",
    "point at",
    "look at me",
    "tell me a story",
    "search the room",
    "report the source",
    "do not follow me",
    "look for the keys",
    "point the finger at him",
    "where is the radiation source",
    "locate the restaurant",
    "follow the yellow brick road",
    "lots of people search for gold",
    "please",
)
FAR = (
    "hello",
    "what time is it",
    "good morning everyone",
    "the quick brown fox jumps over the lazy dog",
    "I would like a cup of tea",
    "please sit down",
    "open the door please",
    "we should go now",
    "turn left at the corner",
    "the radio is broken",
    "come here",
    "how are you today",
    "one two three four",
    "the weather will be fine tomorrow",
    "she sold the old house last summer",
    "can you hear the music",
)
VOICES = (
    "en-us", "en-us+m3", "en-us+f2", "en-us+f5", "en-us-nyc", "en", "en+f3", "en-gb-x-rp",
    "en-gb-x-rp+f2", "en-gb-x-gbclan+m7", "en-gb-scotland", "en-029",
)  # fmt: skip
FLITE = ("kal16", "awb", "rms", "slt")
SPEEDS = (120, 160, 200)
NOISES: tuple[int | None, ...] = (None, 20, 10)
"""Signal to noise in dB, white; None: clean."""
THRESHOLDS = (-0.4, -0.6, -0.7, -0.85, -0.95, -1.05, -1.2, -1.5, -99.0)
SAME = {"persons": "people", "person": "people", "pedestrian": "people", "pedestrians": "people",
        "radioactive": "radiation", "look": "search"}  # fmt: skip
"""Words whose mistaking changes no goal."""


@dataclass(frozen=True, slots=True)
class Clip:
    """Something that was said."""

    text: str
    kind: str
    """`phrase`, `near`, `far` or `people`."""
    voice: str
    speed: int
    noise: int | None
    sound: Sound


@dataclass(frozen=True, slots=True)
class Result:
    """What a clip was heard as."""

    clip: Clip
    heard: Recognition
    cpu_s: float

    def is_right(self, threshold: float) -> bool:
        """Whether the goal that was said was taken."""
        return self.is_taken(threshold) and goal_of(self.heard.words) == goal_of(self.clip.text)

    def is_taken(self, threshold: float) -> bool:
        """Whether anything was taken for a goal."""
        return bool(self.heard.words) and self.heard.confidence >= threshold


def goal_of(text: str) -> tuple[str, ...]:
    """A sentence without what changes no goal: articles, synonyms, free words."""
    words = [SAME.get(w, w) for w in text.split() if w not in ("the", "a", "an", "please")]
    return tuple(words[: words.index("through")] if "through" in words else words)


def clips(espeak: Espeak, people: Path | None) -> Iterator[Clip]:
    """All that is said; voices, speeds and noises take turns, so that each meets each."""
    noise = np.random.default_rng(7)
    kinds = (("phrase", PHRASES), ("near", NEAR), ("far", FAR))
    for kind, texts in kinds:
        step = 1 if kind == "phrase" else 2
        turns = itertools.product(VOICES[::step], SPEEDS[::step], NOISES)
        for turn, (voice, speed, snr) in enumerate(turns):
            for text in texts[turn % 2 :: 2]:
                said = espeak.say(text, voice=voice, words_per_minute=speed)
                yield Clip(text, kind, voice, speed, snr, noisy(said, snr, noise))
        for voice, text in itertools.product(FLITE if shutil.which("flite") else (), texts):
            yield Clip(text, kind, f"flite {voice}", 0, None, flite(text, voice))
    for path in sorted(people.rglob("*.wav")) if people else ():
        for sentence in sentences_of(read_wav(path)):
            yield Clip(path.stem, "people", "people", 0, None, sentence)


def noisy(sound: Sound, snr: int | None, source: np.random.Generator) -> Sound:
    """The sound under white noise."""
    if snr is None:
        return sound
    samples = sound.samples.astype(np.float64)
    power = np.mean(samples**2) / 10 ** (snr / 10)
    samples = samples + source.normal(0, np.sqrt(power), len(samples))
    return Sound(np.clip(samples, -32768, 32767).astype(np.int16))


def flite(text: str, voice: str) -> Sound:
    """What flite says."""
    with tempfile.NamedTemporaryFile(suffix=".wav") as file:
        subprocess.run(["flite", "-voice", voice, "-t", text, "-o", file.name], check=True)
        return read_wav(Path(file.name))


def measured(recogniser: Recogniser, said: Iterable[Clip]) -> Iterator[Result]:
    """Hear everything."""
    for clip in said:
        began = time.process_time()
        heard = recogniser.hear(clip.sound)
        yield Result(clip, heard, time.process_time() - began)


def share(results: Sequence[Result], threshold: float, *, right: bool) -> str:
    """How many are right, or taken, in percent and of how many."""
    if not results:
        return "–"
    counted = sum(r.is_right(threshold) if right else r.is_taken(threshold) for r in results)
    return f"{100 * counted / len(results):.1f} % of {len(results)}"


def page(results: Sequence[Result]) -> str:
    """The page for docs/benchmarks."""
    kinds = {
        kind: [r for r in results if r.clip.kind == kind]
        for kind in ("phrase", "near", "far", "people")
    }
    mine = [r for r in kinds["phrase"] if not r.clip.voice.startswith("flite")]
    others = [r for r in kinds["phrase"] if r.clip.voice.startswith("flite")]
    shipped = Settings().confidence
    rows = [
        [
            f"{t:g}" if t > -9 else "*none*",
            share(mine, t, right=True),
            share(others, t, right=True),
            share([r for r in kinds["phrase"] if not r.is_right(t)], t, right=False),
            *(share(kinds[kind], t, right=False) for kind in ("near", "far", "people")),
        ]
        for t in THRESHOLDS
    ]
    heads = [
        "confidence",
        "right: espeak-ng",
        "right: flite",
        "of those not right, taken for another",
        "taken: near misses",
        "taken: other sentences",
        "taken: people reading",
    ]
    parts = [
        "# Spoken goals: heard, mistaken, refused\n",
        "`python -m benchmarks.speech` wrote this page. " + METHOD,
        "\n## What strictness costs\n",
        measuring.table(heads, rows),
        f"\nShipped: {shipped:g}. *None*: the nearest sentence is always taken.\n",
        f"\n## Phrases at {shipped:g}, by voice, speed and noise\n",
        _by("voice", kinds["phrase"], shipped, lambda r: r.clip.voice),
        "",
        _by("words a minute", mine, shipped, lambda r: str(r.clip.speed)),
        "",
        _by("white noise, dB below", mine, shipped, lambda r: str(r.clip.noise or "none")),
        "\n## What is mistaken most\n",
        _mistaken(kinds["near"] + kinds["far"] + kinds["people"], shipped),
        "\n## Time\n",
        _time(results),
        f"\n{measuring.machine()}; pocketsphinx {metadata.version('pocketsphinx')}, "
        f"espeakng-loader {metadata.version('espeakng-loader')}.\n",
    ]
    return "\n".join(parts)


METHOD = """The vocabulary is that of the shipped plugins (8 patterns, 9 names).
A phrase is *right* when the goal that it asks for is taken: articles, *please*, synonyms and free
words may be mistaken. Everything was said by machines, and synthesised voices flatter a recogniser:
real rooms, real people and microphones were not measured, but for recordings of people who say
other things (the test data of PocketSphinx: a novel read aloud, and names of playing cards).
The pronunciations come from espeak-ng too, so its voices flatter twice; flite's do not. The shipped
confidence was chosen on two of espeak-ng's voices, before this page was made."""


def _by(
    what: str, results: Sequence[Result], threshold: float, key: Callable[[Result], str]
) -> str:
    groups = list(dict.fromkeys(map(key, results)))
    rows = [
        [group, share([r for r in results if key(r) == group], threshold, right=True)]
        for group in groups
    ]
    return measuring.table([what, "right"], rows)


def _mistaken(results: Sequence[Result], threshold: float) -> str:
    taken = [(r.clip.text, r.heard.words) for r in results if r.is_taken(threshold)]
    counted = sorted({pair: taken.count(pair) for pair in taken}.items(), key=lambda p: -p[1])
    return measuring.table(["said", "taken for", "times"], [[*p, str(n)] for p, n in counted[:10]])


def _time(results: Sequence[Result]) -> str:
    relative = [r.cpu_s / r.clip.sound.seconds for r in results if r.clip.sound.seconds > 0.2]
    total_s = sum(r.clip.sound.seconds for r in results)
    return (
        f"{len(results)} clips, {total_s / 60:.0f} minutes. "
        f"CPU seconds per second of sound: median "
        f"{measuring.percentile(relative, 50):.2f}, p95 {measuring.percentile(relative, 95):.2f}."
    )


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        espeak = Espeak(Path(scratch))
        words = lexicon(VOCABULARY.words, lambda word, voice: espeak.phonemes(word, voice=voice))
        recogniser = Recogniser(VOCABULARY, words, FreeHearing(), Settings().limits)
        results = list(measured(recogniser, clips(espeak, options.people)))
    measuring.write("speech", page(results))


if __name__ == "__main__":
    main()
