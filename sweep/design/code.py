"""The code that computes the trials of a study."""

from kernels.identity import Code, code_of
from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.starts import STARTS
from kernels.worlds import MAPS
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


def is_built_in(study: Study) -> bool:
    """Whether the model, the metrics, and all maps and starts of a study come with this
    package: they are known to run, and at what cost.
    """
    named = (
        (MODELS, {study.model}),
        (METRICS, set(study.record.metrics)),
        (MAPS, _values(study, "map") - study.maps.keys()),
        (STARTS, _values(study, "start_draws")),
    )
    return all(
        name in registry and name not in registry.origins
        for registry, names in named
        for name in names
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
