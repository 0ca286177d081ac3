"""The code that computes the trials of a study."""

from kernels.identity import Code, code_of
from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.starts import STARTS
from kernels.worlds import MAPS
from sweep.spec import Study


def study_code(study: Study) -> Code:
    """Return the code hashes of the code that computes the trials of a study.

    The hashes cover the simulation loop, the model with the preset and the recorded
    metrics, and all maps with code and all starts that points of the study may have.
    """
    return code_of(
        study.catalogue,
        [(study.model, study.preset)],
        metrics=(*study.record.metrics, *study.record.profile_names),
        maps=_values(study, "map") - study.maps.keys(),
        starts=_values(study, "start_draws"),
    )


def is_built_in(study: Study) -> bool:
    """Return whether a study uses only built-in models, metrics, maps and starts.

    Built-in code is known to run, with a known cost. The cost of profiles is not known.
    """
    if study.record.profiles:
        return False
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
    """Return the values that a categorical parameter may have at points."""
    values = {study.fixed.get(setting, study.preset_settings[setting])}
    for axis in study.axes:
        values.update(axis.columns.get(setting, ()))
    if from_section := study.section_values.get(setting):
        values.update(from_section.values)
    return {str(value) for value in values}
