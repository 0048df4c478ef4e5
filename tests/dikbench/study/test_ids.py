"""Ids of trials stay what they were where what they stand for does."""

import json

from dikbench.plugins.building import scenario_parameters
from dikbench.plugins.finding import scenario_plugin
from dikbench.plugins.source import digest, source_digest
from dikbench.selector import parse_selector
from dikbench.study.identity import ADDED, scenario_id


def test_a_parameter_that_was_added_leaves_ids_at_what_held_before() -> None:
    """The id is that of the scenario without it; at another value it is another scenario's."""
    step = parse_selector("step[robot=ur5,distance=0.2]")
    values = {key: repr(value) for key, value in scenario_parameters(step).items()}
    for name, before in ADDED.items():
        assert values.pop(name) == repr(before)
    source = source_digest(scenario_plugin("step"))
    known = digest(json.dumps(["step", values, source], sort_keys=True))
    assert scenario_id(step) == known
    for name, before in ADDED.items():
        given = f"step[robot=ur5,distance=0.2,{name}={{}}]"
        assert scenario_id(parse_selector(given.format(before))) == known
        assert scenario_id(parse_selector(given.format(2 * before))) != known
