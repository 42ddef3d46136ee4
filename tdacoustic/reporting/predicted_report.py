"""The report of the modelled side, section by section."""

from __future__ import annotations

from dataclasses import replace

from tdacoustic import __version__
from tdacoustic.drive.prediction import Prediction
from tdacoustic.reporting.document import Document, Section
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.bearing_loads import bearing_loads
from tdacoustic.reporting.sections.coupling import coupling_section
from tdacoustic.reporting.sections.design_sweeps import design_sweeps
from tdacoustic.reporting.sections.directivity import directivity
from tdacoustic.reporting.sections.gear_answer import gear_answer
from tdacoustic.reporting.sections.gear_method import gear_method
from tdacoustic.reporting.sections.gear_pair import gear_pair
from tdacoustic.reporting.sections.helix_sweep import helix_sweep
from tdacoustic.reporting.sections.housing import housing_section
from tdacoustic.reporting.sections.insertion_loss import insertion_loss_section
from tdacoustic.reporting.sections.lineage import lineage_sections
from tdacoustic.reporting.sections.mesh_stiffness import mesh_stiffness
from tdacoustic.reporting.sections.meshing_noise import meshing_noise
from tdacoustic.reporting.sections.model_parameters import model_parameters
from tdacoustic.reporting.sections.near_field import near_field_section
from tdacoustic.reporting.sections.paper_features import paper_features
from tdacoustic.reporting.sections.sensitivity import sensitivity
from tdacoustic.reporting.sections.sound_field import sound_field
from tdacoustic.reporting.sections.speed_sweep import speed_sweep
from tdacoustic.reporting.sections.transmission_error import transmission_error
from tdacoustic.reporting.sections.what_if import what_if_of
from tdacoustic.results import FleetPrediction

__all__ = ["PREDICTED_FOOTER", "predicted_report", "predicted_sections"]

PREDICTED_FOOTER = (
    mark("Forces are peak amplitudes, displacements peak to peak where so named."),
    mark("The paper, and its figures, tables and equations, are those of Appl. Sci. 2025, 15, 10597."),
)


def predicted_report(result: FleetPrediction) -> Document:
    """Return the report on the modelled side of a fleet.

    Parameters
    ----------
    result : FleetPrediction
    """
    prediction = result.prediction
    sections, method = predicted_sections(result), gear_method(result)
    whole = Section("prediction", say("What the model predicts"), [])
    behind, came_from = lineage_sections([whole], (), result.inputs, {whole.id: result.records})
    anchor = came_from.get(whole.id, method.id)
    return Document(
        title=result.fleet.name,
        subtitle=say("Noise and vibration of a traction drive: what the rapid model gives"),
        origin="calculated",
        summary=gear_answer(result),
        sections=[*sections, replace(method, blocks=[*method.blocks, *behind])],
        facts=[
            (say("Conditions"), ", ".join(state.condition.name for state in prediction.conditions)),
            (say("Train speeds"), _speeds_words(prediction)),
            (say("Teeth"), " : ".join(str(teeth) for teeth in prediction.unit.geometry.teeth)),
        ],
        footer=[
            say("Made with tdacoustic {version}.", version=__version__),
            say("Levels re 20 µPa."),
            *map(say, PREDICTED_FOOTER),
        ],
        lineage={"summary": anchor} | {section.id: anchor for section in sections},
    )


def _speeds_words(prediction: Prediction) -> str:
    speeds = [state.condition.train_speed_km_h for state in prediction.conditions]
    slowest, fastest = f"{min(speeds):.4g} km/h", f"{max(speeds):.4g} km/h"
    return slowest if slowest == fastest else say("{slowest} to {fastest}", slowest=slowest, fastest=fastest)


def predicted_sections(result: FleetPrediction) -> list[Section]:
    """Return the sections on the model, its parameters last; not those on method and provenance.

    Parameters
    ----------
    result : FleetPrediction
    """
    found = [
        gear_pair,
        mesh_stiffness,
        transmission_error,
        bearing_loads,
        speed_sweep,
        meshing_noise,
        housing_section,
        coupling_section,
        sound_field,
        insertion_loss_section,
        what_if_of,
        directivity,
        near_field_section,
        helix_sweep,
        paper_features,
        design_sweeps,
        sensitivity,
        model_parameters,
    ]
    return [section for section in (make(result) for make in found) if section is not None]
