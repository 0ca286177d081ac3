"""The code that computes the trials of a study."""

from kernels.identity import Code, code_of
from sweep.spec.study import Study


def study_code(study: Study) -> Code:
    """The stamps of the flight, the model, the metrics that are recorded, and those
    maps with code and starts that points of the study may have.
    """
    return code_of(
        study.known,
        [(study.model, study.preset)],
        study.record.metrics,
        _values(study, "map") - study.maps.keys(),
        _values(study, "start_draws"),
    )


def _values(study: Study, setting: str) -> set[str]:
    """The values that a setting, which is a choice, may have at points."""
    found = {study.fixed.get(setting, study.preset_settings[setting])}
    axes, search = study.axes, study.search
    for axis in (*axes, *search.over) if search else axes:
        found.update(axis.columns.get(setting, ()))
    for parameter in search.parameters if search else ():
        found.update(parameter.arguments if parameter.name == setting else ())
    return {str(name) for name in found}
