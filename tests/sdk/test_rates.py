"""How often a worker sends on its streams, as it counts itself."""

from __future__ import annotations

import pytest

from nondum.sdk import Header, Output, Scalar, Unit
from nondum.sdk.description import PluginDescription
from nondum.sdk.workplace import Place, Workplace

pytestmark = pytest.mark.anyio


async def test_rates_are_of_the_time_since_they_were_asked_for_before() -> None:
    workplace = Workplace(
        Place("robot", "eye", outputs={"light": "robot__eye__light"}), lambda *event: None
    )
    unit = Unit("lens", "camera", outputs=(Output("light", "scalar"), Output("dark", "scalar")))
    workplace.declare(PluginDescription("eye", "1", units=(unit,)))
    light = workplace.output("light")
    light.send(Scalar(Header(), 0.5, "1"))
    assert workplace.rates(10.0) == {}
    for _ in range(5):
        light.send(Scalar(Header(), 0.5, "1"))
    assert workplace.rates(12.0) == {"robot__eye__light": 2.5}
    assert workplace.rates(14.0) == {}
    light.send(Scalar(Header(), 0.5, "1"))
    assert workplace.rates(14.0) == {}
    workplace.close()
