"""A spec that records more: its text with metrics added, and all else as it stands."""

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
    """The text of a spec with more under `record`. Comments stay where they are.

    text     a valid spec of one study
    usual    what it records where it names no metrics
    metrics  further ones, as a spec names them
    derive   further expressions by the names of new metrics

    Raises SpecError for a text that is no spec: it may come from anyone.
    """
    _check(parse_document(text, Path("stored spec")))
    yaml = YAML()
    yaml.preserve_quotes, yaml.width = True, 2**16
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
    """Raise SpecError where what is to be added to is neither missing nor right."""
    spec.mapping()
    if record := spec.get("record"):
        record.mapping()
        if metrics := record.get("metrics"):
            metrics.entries()
        if derive := record.get("derive"):
            derive.mapping()
