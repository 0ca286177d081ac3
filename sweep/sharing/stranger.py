"""The texts of a packed study for readers without boidsweep.

The texts are a README, and RO-Crate metadata (https://w3id.org/ro/crate/1.2).
"""

import json
from typing import Any

from sweep.sharing.citing import Citation, Work, origin_of, stored_at
from sweep.sharing.packed_file import CRATE, SUMS
from sweep.tables import StoredStudy

CONFORMS = "https://w3id.org/ro/crate/1.2"
NO_LICENCE = "not stated: ask the sender of this file for permission to use the data"
PARQUET = "application/vnd.apache.parquet"
MEMBERS = {
    "README.md": ("text/markdown", "description of this file"),
    SUMS: ("text/plain", "the sha256 of all files except this list, for sha256sum -c"),
    "CITATION.bib": ("text/x-bibtex", "works to cite"),
    "provenance.json": (
        "application/json",
        "origin of the results: the spec, the code, versions and machines",
    ),
    "tables/trials.csv": ("text/csv", "one row per trial: parameters and metrics"),
    "tables/columns.csv": ("text/csv", "one row per column: type, unit, text"),
    "study/spec.yaml": ("application/yaml", "the spec of the study, as last launched"),
    "study/plan.parquet": (PARQUET, "the trials of the spec"),
    "study/parts/": ("", "all tables in parts, as stored, in parquet files"),
}
"""Media type and description of the members that every packed study has."""


def readme(study: StoredStudy, citation: Citation) -> str:
    """Return the README: the content of the file, and how programs read the content."""
    members = "\n".join(f"| `{name}` | {text} |" for name, (_, text) in MEMBERS.items())
    cited = "\n".join(f"- {work.as_text()}" for work in citation.works)
    return f"""# The study {study.name}

{_described(study)} This is a file of boidsweep, a program for Monte Carlo experiments
and parameter sweeps over boid swarms. Readers of the file do not need the program.

| file | content |
|---|---|
| `{CRATE}` | machine-readable description (RO-Crate 1.2) |
{members}
| `code/` | custom models, metrics, maps and initial conditions of the study, if any |

## Read the file

`tables/trials.csv` opens in any program, and `tables/columns.csv` describes each column
with a unit. A string that begins with = + - @ or an apostrophe has an additional
apostrophe at the beginning. A trial with a `status` different from `done` has no
metrics.

Series, heatmaps and trajectories are in `study/parts/*/`, in parquet files that DuckDB,
pandas, polars or R read. Parts may contain trials of an earlier spec. The trials of
this spec have a `trial_id` in `study/plan.parquet`. If a trial is in several parts, the
last part by name is valid.

```sql
-- DuckDB, in the folder of this file: the trials of the spec
FROM read_parquet('study/parts/*/trials.parquet', filename = true, union_by_name = true)
WHERE trial_id IN (SELECT trial_id FROM 'study/plan.parquet')
QUALIFY row_number() OVER (PARTITION BY trial_id ORDER BY filename DESC) = 1;
```

`sha256sum -c {SUMS}` checks that every file is unchanged since the packing.

With boidsweep, `sweep load FILE` restores the study with bitwise identical values. You
can plot, verify and resume the study. Custom code runs only with your permission.

## Cite the study

{cited}

The licence of these data is {NO_LICENCE}.
"""


def crate(study: StoredStudy, citation: Citation, code_files: list[str]) -> str:
    """Return the metadata of the file as the JSON text of RO-Crate 1.2.

    Parameters
    ----------
    study : StoredStudy
    citation : Citation
        The works to cite, including the study.
    code_files : list of str
        Names of the members with custom code.

    Returns
    -------
    str
    """
    files = [_entity(name, *member) for name, member in MEMBERS.items()]
    files += [
        _entity(name, "text/x-python", "code of the study") for name in code_files
    ]
    works = [_work(work) for work in citation.works if work.kind != "study"]
    (itself,) = (work for work in citation.works if work.kind == "study")
    root = {
        "@id": "./",
        "@type": "Dataset",
        "name": study.name,
        "description": _described(study),
        "identifier": itself.note,
        "datePublished": stored_at(study).date().isoformat(),
        "license": NO_LICENCE,
        "hasPart": [{"@id": entity["@id"]} for entity in files],
        "citation": [{"@id": entity["@id"]} for entity in works],
        "mentions": [{"@id": "#launch"}],
    }
    launch = {
        "@id": "#launch",
        "@type": "CreateAction",
        "name": f"the trials of {study.name} were run",
        "instrument": {"@id": works[0]["@id"]},
        "object": [{"@id": "study/spec.yaml"}],
        "result": [{"@id": "./"}],
    }
    descriptor = {
        "@id": CRATE,
        "@type": "CreativeWork",
        "conformsTo": {"@id": CONFORMS},
        "about": {"@id": "./"},
    }
    graph = [descriptor, root, *files, *works, launch]
    context = f"{CONFORMS}/context"
    return json.dumps({"@context": context, "@graph": graph}, indent=1)


def _described(study: StoredStudy) -> str:
    statuses = study.statuses()
    counts = ", ".join(f"{count:,} {name}" for name, count in sorted(statuses.items()))
    return (
        f"{study.plan.num_rows:,} trials ({counts}) of {origin_of(study)}, at"
        f" {len(study.points):,} points."
    )


def _entity(name: str, encoding: str, text: str) -> dict[str, Any]:
    """Return the entity of a file, or of a folder if the name ends in a slash."""
    kind = "Dataset" if name.endswith("/") else "File"
    entity = {"@id": name, "@type": kind, "name": name, "description": text}
    return entity | ({"encodingFormat": encoding} if encoding else {})


def _work(work: Work) -> dict[str, Any]:
    kinds = {
        "software": "SoftwareApplication",
        "model": "CreativeWork",
        "data": "Dataset",
    }
    entity = {
        "@id": f"#{work.key}",
        "@type": kinds[work.kind],
        "name": work.title,
        "author": ", ".join(author.name for author in work.authors),
        "datePublished": "" if work.year is None else str(work.year),
        "version": work.version,
        "description": work.note,
    }
    return {name: text for name, text in entity.items() if text}
