"""Addition of metrics to the text of a spec."""

from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from sweep.spec.document import Entry
from sweep.spec.strict_yaml import parse_document


def with_metrics(
    text: str, usual: Sequence[str], metrics: Sequence[str], derive: Mapping[str, str]
) -> str:
    """Return the text of a spec with more metrics under `record`.

    Comments and all other keys stay unchanged.

    Parameters
    ----------
    text : str
        A valid spec of one study.
    usual : sequence of str
        Metrics that the study records without a list in the spec.
    metrics : sequence of str
        Further metrics, as a spec names them.
    derive : mapping
        Further expressions, by the names of new metrics.

    Returns
    -------
    str

    Raises
    ------
    SpecError
        If `text` is not a spec. A stored text may be untrusted.
    """
    _check(parse_document(text, Path("stored spec")))
    yaml = YAML()
    yaml.preserve_quotes = True
    # At this width the writer folds no line.
    yaml.width = 2**16
    spec = yaml.load(text)
    record: dict[str, Any] = spec.setdefault("record", {})
    if metrics:
        record.setdefault("metrics", [*usual]).extend(metrics)
    if derive:
        record.setdefault("derive", {}).update(derive)
    stream = StringIO()
    yaml.dump(spec, stream)
    return stream.getvalue()


def _check(spec: Entry) -> None:
    """Raise SpecError unless each part that is extended is missing or valid."""
    spec.mapping()
    if record := spec.get("record"):
        record.mapping()
        if metrics := record.get("metrics"):
            metrics.entries()
        if derive := record.get("derive"):
            derive.mapping()
