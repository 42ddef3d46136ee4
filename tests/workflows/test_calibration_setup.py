"""What a calibration frees where its campaign does not say."""

import pytest
from plain_fleets import plain_campaign, plain_fleet

from tdacoustic.campaign import load_campaign
from tdacoustic.fleet import load_fleet
from tdacoustic.workflows.calibration_setup import free_parameters

DAMPING = "gear_dynamics.mesh_damping_ratio"


@pytest.mark.parametrize(
    ("changes", "gain"),
    [
        ({}, "masuda.constant_db"),
        ({"model.gear_path": "structure", "radiation.method": "boundary_elements"}, "model.structure_gain_db"),
        ({"model.gear_path": "sum", "radiation.method": "boundary_elements"}, "masuda.constant_db"),
    ],
)
def test_the_gain_of_the_path_that_the_total_adds(changes, gain):
    campaign = load_campaign(plain_campaign("crrc-freight-printed"))
    fleet = load_fleet(plain_fleet("crrc-freight")).replaced(changes) if changes else None
    free, _, _ = free_parameters(campaign, fleet or load_fleet(plain_fleet("crrc-freight")), ["one"])
    assert [parameter.name for parameter in free] == [gain, DAMPING]
