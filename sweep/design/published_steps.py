"""That a model calls `publish`, where settings need it."""

from kernels.robots.publishers import publishes, to_publish
from sweep.spec.document import Place
from sweep.spec.study import Study


def check_published(
    study: Study, name: str, what: str, place: Place | None = None
) -> None:
    """Raise SpecError for a model that calls no `publish`: the setting `name`, or what
    else stands at `place`, needs one that does `what`.
    """
    model = study.known.models[study.model]
    if publishes(model.advance):
        return
    change = to_publish(model.advance)
    raise study.document.error(
        place or study.place_of(name) or ("model",),
        f"{name} needs a model {what}, and {model.name} calls no `publish`:"
        f" {change + ', and ' if change else ''}see docs/own-models.md",
    )
