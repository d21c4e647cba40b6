"""Phonemes of eSpeak NG in the recogniser's alphabet: IPA to ARPAbet, as far as English goes."""

from __future__ import annotations

import re

_ARPABET = {
    # Vowels with an r, and diphthongs that lost it.
    "aɪə": "AY AH", "aɪɚ": "AY ER", "ɔːɹ": "AO R", "oːɹ": "AO R", "ɑːɹ": "AA R", "ɪɹ": "IH R",
    "ɛɹ": "EH R", "ʊɹ": "UH R", "iə": "IY AH", "ɪə": "IH AH", "eə": "EH AH", "ʊə": "UH AH",
    "oə": "AO AH", "ɜː": "ER", "ɜ": "ER", "ɚ": "ER", "ɝ": "ER",
    # Diphthongs and long vowels.
    "eɪ": "EY", "ei": "IY", "aɪ": "AY", "ɑɪ": "AY", "aʊ": "AW", "ɔɪ": "OY", "oɪ": "OY", "oʊ": "OW",
    "əʊ": "OW", "ʌʊ": "OW", "iː": "IY", "uː": "UW", "ɔː": "AO", "ɑː": "AA", "eː": "EY",
    "oː": "OW", "aː": "AA", "ɒː": "AO", "ʉː": "UW",
    # Short vowels.
    "i": "IY", "ɪ": "IH", "ᵻ": "IH", "ɨ": "IH", "e": "EH", "ɛ": "EH", "æ": "AE", "a": "AE",
    "ɑ": "AA", "ɒ": "AA", "ɔ": "AO", "o": "OW", "ʊ": "UH", "u": "UW", "ʉ": "UW", "ʌ": "AH",
    "ə": "AH", "ɐ": "AH",
    # Consonants.
    "tʃ": "CH", "dʒ": "JH", "p": "P", "b": "B", "t": "T", "d": "D", "k": "K", "ɡ": "G", "g": "G",
    "f": "F", "v": "V", "θ": "TH", "ð": "DH", "s": "S", "z": "Z", "ʃ": "SH", "ʒ": "ZH", "h": "HH",
    "x": "K", "m": "M", "n": "N", "ŋ": "NG", "l": "L", "ɫ": "L", "ɬ": "L", "r": "R", "ɹ": "R",
    "j": "Y", "w": "W", "ʍ": "W", "ɾ": "D", "ʔ": "T",
}  # fmt: skip
_KNOWN = re.compile(f"({'|'.join(sorted(_ARPABET, key=len, reverse=True))})ː?")
_UNHEARD = re.compile("[ʲˈˌ_ \u0300-\u036f\u200d()]|\\([a-z-]+\\)")
"""Stress, separators, and marks that no phoneme of English depends on."""


def arpabet(ipa: str) -> str | None:
    """Phonemes with blanks between; None for those of another language.

    >>> arpabet("ɹ_ˌoʊ_b_ˈɑː_t")
    'R OW B AA T'
    """
    heard = _UNHEARD.sub("", ipa.replace(":", "ː"))
    phones: list[str] = []
    position = 0
    while position < len(heard):
        found = _KNOWN.match(heard, position)
        if found is None:
            return None
        position = found.end()
        phones.append(_ARPABET[found.group(1)])
    return " ".join(phones) or None
