"""Bytes of a serial line become sentences, whatever else is on it."""

from __future__ import annotations

import tracemalloc

import pytest
from hypothesis import given
from hypothesis import strategies as st
from simulated_receiver import NO_FIX, gga, gsa, gst, gsv, rmc, sentence

from nondum_gps.sentences import Decoder, Gga, Gsa, Gst, Gsv, Place, Rmc, Sentence

LATITUDES = st.floats(-90, 90)
LONGITUDES = st.floats(-180, 180)
UBX = b"\xb5\x62\x01\x07\x04\x00$\x0a\xff$GN\x41"
SENTENCES = [gga(), gsa(3), gst("1.1", "1.2", "2.3"), gsv("GP", 9), rmc(), NO_FIX]


def decoded(*pieces: bytes) -> list[Sentence]:
    decoder = Decoder()
    return [sentence for piece in pieces for sentence in decoder.feed(piece)]


@given(LATITUDES, LONGITUDES)
def test_place_is_what_was_sent(latitude: float, longitude: float) -> None:
    for told in decoded(gga(latitude, longitude), rmc(latitude, longitude)):
        assert isinstance(told, Gga | Rmc)
        assert told.place is not None
        assert told.place.latitude_deg == pytest.approx(latitude, abs=1e-8)
        assert told.place.longitude_deg == pytest.approx(longitude, abs=1e-8)


def test_every_field_is_read() -> None:
    assert decoded(*SENTENCES) == [
        Gga(Place(51.05, 13.74), 1, 8, 0.9, 118.2, 44.6),
        Gsa(is_flat=False, vdop=1.2),
        Gst(1.1, 1.2, 2.3),
        Gsv("GP", 9),
        Rmc(Place(51.05, 13.74), is_valid=True, mode="A"),
        Gga(None, 0, 0, 99.99, None, None),
    ]


@pytest.mark.parametrize("talker", ["GP", "GL", "GA", "GB", "GN", "QZ"])
def test_satellites_of_any_system_do(talker: str) -> None:
    assert len(decoded(gga(talker=talker), rmc(talker=talker))) == 2


@given(st.lists(st.sampled_from([*SENTENCES, UBX, b"\x00\r\n"])), st.lists(st.integers(0, 99)))
def test_pieces_of_any_size_make_the_same_sentences(parts: list[bytes], sizes: list[int]) -> None:
    stream, pieces = b"".join(parts), []
    for size in sizes:
        pieces.append(stream[:size])
        stream = stream[size:]
    assert decoded(*pieces, stream) == decoded(b"".join(parts))


@given(st.lists(st.binary(max_size=400)))
def test_no_bytes_are_a_mistake_of_the_program(pieces: list[bytes]) -> None:
    decoded(*pieces)


@given(st.sampled_from(["GGA", "RMC", "GSA", "GST", "GSV"]), st.data())
def test_no_sentence_is_one_either(formatter: str, data: st.DataObject) -> None:
    field = st.sampled_from(["", "0", "3", "-1", "nan", "inf", "1e999", "N", "W", "4807.038", "A"])
    fields = data.draw(st.lists(field | st.text("0123456789.,-+eE", max_size=12), max_size=20))
    for told in decoded(sentence(f"GP{formatter},{','.join(fields)}")):
        if isinstance(told, Gga | Rmc) and told.place is not None:
            assert abs(told.place.latitude_deg) <= 90
            assert abs(told.place.longitude_deg) <= 180


@given(st.binary(max_size=300).filter(lambda noise: b"$" not in noise), st.sampled_from(SENTENCES))
def test_noise_before_a_sentence_costs_nothing(noise: bytes, sent: bytes) -> None:
    assert decoded(noise + sent) == decoded(sent)


@given(st.sampled_from(SENTENCES), st.integers(0), st.integers(1, 255))
def test_one_wrong_byte_never_makes_another_sentence(sent: bytes, at: int, change: int) -> None:
    wrong = bytearray(sent)
    wrong[at % len(sent)] ^= change
    assert decoded(bytes(wrong), NO_FIX) in (
        [*decoded(sent), *decoded(NO_FIX)],
        decoded(NO_FIX),
        [],  # the end of the line was hit, and the next sentence is all that is left of both
    )


@pytest.mark.parametrize(
    "line",
    [
        gga().replace(b"*", b"*0"),
        gga()[:-5] + b"\r\n",
        sentence("GNGGA," + "1" * 300),
        sentence("GNZDA,101530.00,25,11,2026,00,00"),
        sentence("PUBX,00,1"),
        sentence("GNGGA,101530.00,5103.0000,N,01344.0000,E,1.5,08,0.9,118.2,M,44.6,M,,"),
        gga().replace(b"\r\n", b"\r\r\n"),
    ],
    ids=["sum of three", "no sum", "too long", "other", "proprietary", "no number", "line"],
)
def test_what_is_no_sentence_of_a_fix_is_dropped(line: bytes) -> None:
    assert decoded(line, gga()) == decoded(gga())


@pytest.mark.parametrize(
    "place",
    [
        "9100.0,N,01344.0,E",
        "5103.0,N,18100.0,E",
        "5103.0,,01344.0,E",
        "5103.0,X,01344.0,E",
        "1,N,2,E",
    ],
)
def test_place_that_is_not_on_earth_is_none(place: str) -> None:
    (told,) = decoded(sentence(f"GNGGA,101530.00,{place},1,08,0.9,118.2,M,44.6,M,,"))
    assert isinstance(told, Gga)
    assert told.place is None


@pytest.mark.parametrize("number", ["nan", "inf", "1e999"])
def test_what_is_no_number_is_not_known(number: str) -> None:
    body = f"GNGGA,101530.00,5103.0,N,01344.0,E,1,08,{number},{number},M,{number},M,,"
    assert decoded(sentence(body)) == [
        Gga(Place(51.05, pytest.approx(13.7333333)), 1, 8, None, None, None)
    ]


def test_error_below_zero_is_none() -> None:
    assert decoded(gst("-1.0", "1.0", "2.0")) == []


def test_line_without_an_end_takes_no_memory() -> None:
    decoder = Decoder()
    tracemalloc.start()
    for _ in range(1000):
        decoder.feed(b"$" + b"x" * 1000)
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < 100_000
    assert decoder.feed(b"\n" + gga()) == decoded(gga())
