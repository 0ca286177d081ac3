"""From a YAML text to a Study: everything that can be wrong is said here, with its
line.

strict_yaml      YAML without surprises
document         values that know their line
mistakes         all mistakes in one answer
contents         what may stand under a key
keys             each key described once
adding           the text of a spec with more metrics
key_table        the table of all keys
study            the Study, and its reader
settings         what can be set, with units
axes             the ways to write an axis
axis_keys        the fixed keys of an axis
setting_values   fixed, sweep, derive, require
sampling         what a sampler is
whole_samples    samples that count only whole
samplers         all samplers of points
distributions    uniform, normal, choice
ablation         an axis between two presets
point_tables     points of a CSV or parquet file
parquet_sizes    what parquet unpacks to
limits           how large a study may be
expressions      checked formulas
evaluation       formulas on whole columns
units            units of formulas
maps             shapes, copies, images, ROS maps
polygons         obstacles of any shape
copied_maps      what differs from a built-in map
images           pixels as few rectangles
replication      how many trials a point has
continuing       axes along which trials are links of chains
continued_checks what such an axis needs
sections         sections that methods add
sizes            flocks of several sizes
failure_policy   what follows a failed trial
recorded         names of metrics and columns
derived_metrics  metrics that formulas give
study_folder     names of a study and its files
built_in         where the built-in studies lie
search           a checked search
search_section   its reader
search_checks    what its parts must fulfil
search_samplers  what proposes candidates
search_schema    its JSON Schema
objectives       what a search asks for
statistics       mean, worst, quantile, CVaR
seeds            random streams by purpose
schema           the JSON Schema of a spec
schema_settings  the schema of settings
schema_parts     what the schema is put together from
"""
