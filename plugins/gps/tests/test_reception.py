"""What sentences mean together, and how long it is believed. Nothing here has a clock."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from simulated_receiver import NO_FIX, gga, gsa, gst, gsv, rmc, sentence

from nondum_gps.reading import Reading
from nondum_gps.reception import Reception
from nondum_gps.sentences import Place
from nondum_gps.settings import Settings

SETTINGS = Settings(lost_after_s=5.0)
PLACE = Place(51.05, 13.74)


def reception() -> Reception:
    return Reception(SETTINGS, 100.0)


def told(*pieces: bytes, now_s: float = 100.0) -> Reading:
    """The last reading of these bytes."""
    return reception().take(b"".join(pieces), now_s)[-1]


@pytest.mark.parametrize(
    ("quality", "status"),
    list(enumerate(("none", "fix", "sbas", "fix", "gbas", "gbas", "none", "none", "none"))),
)
def test_only_what_satellites_tell_is_a_fix(quality: int, status: str) -> None:
    assert told(gga(quality=quality)).status == status


@pytest.mark.parametrize(
    ("state", "mode", "status"),
    [
        *(("A", "", "fix"), ("A", ",A", "fix"), ("A", ",D", "sbas"), ("A", ",R,V", "gbas")),
        *(("A", ",E", "none"), ("A", ",S", "none"), ("V", ",A", "none"), ("V", "", "none")),
    ],
)
def test_receiver_without_gga_is_understood(state: str, mode: str, status: str) -> None:
    reading = told(rmc(), rmc(), rmc(status=state, mode=mode))
    assert reading.status == status
    assert reading.place == PLACE


@pytest.mark.parametrize("cycle", [(rmc(), gga(), gsa(3)), (gga(), gsa(3), rmc())])
def test_each_cycle_makes_one_reading(cycle: tuple[bytes, ...]) -> None:
    readings = reception().take(b"".join(cycle) * 5, 100.0)
    assert len(readings) == 5
    assert all(reading.ellipsoid_m == pytest.approx(162.8) for reading in readings)


def test_height_is_above_the_sea_for_people_and_above_the_ellipsoid_for_messages() -> None:
    reading = told(gsa(3), gga())
    assert reading.sea_level_m == pytest.approx(118.2)
    assert reading.ellipsoid_m == pytest.approx(162.8)
    assert reading.in_words() == "51.05000 N, 13.74000 E, 118 m, 8 satellites"


def test_height_that_is_assumed_is_not_told() -> None:
    reading = told(gsa(2), gga(satellites=3))
    assert reading.sea_level_m is reading.ellipsoid_m is None
    assert reading.in_words() == "51.05000 N, 13.74000 E, 3 satellites"


def test_height_above_an_unknown_sea_is_none_above_the_ellipsoid() -> None:
    reading = told(gga(geoid=""))
    assert reading.sea_level_m == pytest.approx(118.2)
    assert reading.ellipsoid_m is None


def test_receivers_own_errors_are_told() -> None:
    assert told(gst("1.0", "2.0", "3.0"), gga()).variances_m2 == pytest.approx((4.0, 1.0, 9.0))


def test_without_them_the_dilution_of_precision_tells_the_error() -> None:
    level = (0.9 * SETTINGS.range_error_m) ** 2 / 2
    up = (1.2 * SETTINGS.range_error_m) ** 2
    assert told(gsa(3), gga()).variances_m2 == pytest.approx((level, level, up))


@pytest.mark.parametrize("before", [b"", gsa(2), gsa(3, vdop=""), gst("1.0", "", "3.0")])
def test_errors_that_are_not_known_are_none(before: bytes) -> None:
    assert told(before, gga()).variances_m2 is None


def test_errors_of_some_time_ago_are_none_of_this_fix() -> None:
    heard = reception()
    heard.take(gst("1.0", "2.0", "3.0"), 100.0)
    (reading,) = heard.take(gga(), 110.0)
    assert reading.variances_m2 is None


def test_place_of_a_fix_that_is_lost_is_the_last_one() -> None:
    assert told(NO_FIX) == Reading("none", Place(0.0, 0.0), satellites=0)
    assert told(gga(), NO_FIX) == Reading("none", PLACE, satellites=0)


def test_fix_is_believed_until_it_is_too_old() -> None:
    heard = reception()
    heard.take(gga(), 100.0)
    assert heard.fix(105.0) is not None
    assert heard.fix(105.1) is None


def test_sentences_without_a_fix_do_not_keep_it() -> None:
    heard = reception()
    heard.take(gga(), 100.0)
    heard.take(NO_FIX + gga(quality=8) + rmc(status="V"), 104.0)
    assert heard.fix(105.1) is None


@given(st.lists(st.binary(max_size=90) | st.sampled_from([gga(), NO_FIX, gsa(3), rmc()])))
def test_newest_fix_is_the_one_that_is_known(pieces: list[bytes]) -> None:
    heard = reception()
    readings = [reading for piece in pieces for reading in heard.take(piece, 100.0)]
    fixes = [reading for reading in readings if reading.is_fix]
    assert heard.fix(100.0) == (fixes[-1] if fixes else None)


@pytest.mark.parametrize(
    ("heard", "at_s", "code", "words"),
    [
        (b"", 107.0, "GPS_SILENT", "nothing came in 7 s"),
        (b"\xe6\x18\x00" * 20, 107.0, "GPS_SILENT", "60 bytes came in 7 s"),
        (gga(), 120.0, "GPS_SILENT", "for 20 s"),
        (NO_FIX, 102.0, "GPS_NO_FIX", "no fix yet"),
        (gsv("GP", 3) + gsv("GL", 2) + gsv("GP", 4) + NO_FIX, 102.0, "GPS_NO_FIX", "6 satellites"),
    ],
    ids=["silent", "not NMEA", "fallen silent", "no fix yet", "some in view"],
)
def test_why_there_is_no_fix_is_told(heard: bytes, at_s: float, code: str, words: str) -> None:
    receiver = reception()
    receiver.take(heard, 100.0)
    problem = receiver.problem(at_s)
    assert problem.code == code
    assert words in problem.message
    assert problem.fix


def test_satellites_of_some_time_ago_are_not_counted() -> None:
    heard = reception()
    heard.take(gsv("GL", 2), 100.0)
    heard.take(gsv("GP", 3) + NO_FIX, 110.0)
    assert "3 satellites" in heard.problem(110.0).message


def test_how_long_a_fix_is_lost_is_told() -> None:
    heard = reception()
    heard.take(gga(), 100.0)
    heard.take(sentence("GNRMC,,V,,,,,,,,,,N") + NO_FIX, 130.0)
    assert "for 30 s" in heard.problem(130.0).message
