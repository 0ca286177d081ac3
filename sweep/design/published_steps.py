"""That a model calls `publish`, where settings need it."""

from kernels.robots.publishers import publishes, to_publish
from sweep.spec.study import Study


def check_published(study: Study, name: str, what: str) -> None:
    """Raise SpecError for a model that calls no `publish`: the setting `name` needs one
    that does `what`.
    """
    model = study.known.models[study.model]
    if publishes(model.advance):
        return
    change = to_publish(model.advance)
    raise study.document.error(
        study.place_of(name) or ("model",),
        f"{name} needs a model {what}, and {model.name} calls no `publish`:"
        f" {change + ', and ' if change else ''}see docs/own-models.md",
    )
