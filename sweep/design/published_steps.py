"""The requirement that a model calls `publish`."""

from kernels.robots.abilities import remedy, to_publish, why_not
from sweep.spec import Place, Study


def check_published(
    study: Study, name: str, ability: str, place: Place | None = None
) -> None:
    """Raise SpecError if the model of a study calls no `publish`.

    Parameters
    ----------
    study : Study
    name : str
        Name of the parameter that needs the call, or a noun phrase for the error.
    ability : str
        Words after "a model" in the error, about the missing ability.
    place : Place, optional
        Key of the spec for the error; by default the key of the parameter.

    Raises
    ------
    SpecError
        If the model calls no `publish`, or declares the absence of the call.
    """
    model = study.catalogue.models[study.model]
    why = why_not(model, "publishes")
    if not why:
        return
    change = remedy(model, "publishes", to_publish(model.advance))
    raise study.document.error(
        place or study.place_of(name) or ("model",),
        f"{name} needs a model {ability}, but {why}:"
        f" {change + '; ' if change else ''}see docs/own-models.md",
    )
