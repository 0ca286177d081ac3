"""The code that computes the trials of a study."""

from kernels.identity import Code, code_of
from sweep.spec.settings import preset_settings
from sweep.spec.study import Study


def study_code(study: Study) -> Code:
    """The stamps of the flight, the model, the metrics that are recorded, and those
    built-in maps on which points of the study may lie.
    """
    maps = _maps(study) - study.maps.keys()
    return code_of(study.model, study.preset, study.record.metrics, maps)


def _maps(study: Study) -> set[str]:
    """The names of the maps on which points may lie."""
    found = {study.fixed.get("map", preset_settings(study.model, study.preset)["map"])}
    axes, search = study.axes, study.search
    for axis in (*axes, *search.over) if search else axes:
        found.update(axis.columns.get("map", ()))
    for parameter in search.parameters if search else ():
        found.update(parameter.arguments if parameter.name == "map" else ())
    return {str(name) for name in found}
