"""Specs: from a YAML text to a checked Study.

Every mistake of a spec is reported with its line.

strict_yaml      YAML in a strict form
document         values with their lines
mistakes         all mistakes in one error
contents         the allowed values of a key

keys             each key described once
adding           the text of a spec with more metrics
key_table        the table of all keys

study            the Study, and its reader
settings         the parameters of a model, with units
setting_values   fixed, sweep, derive, require

expressions      checked formulas
evaluation       formulas on whole columns
units            units of formulas

axes             the ways to write an axis
axis_keys        the fixed keys of an axis

sampling         the definition of a sampler
samplers         all samplers of points
whole_samples    samples that need all points
distributions    uniform, normal, choice

ablation         axes of ablation studies
point_tables     points of a CSV or parquet file
parquet_sizes    the unpacked size of a parquet file
limits           the largest size of a study

maps             shapes, copies, images, ROS maps
polygons         obstacles of any shape
copied_maps      differences from a built-in map
images           pixels as few rectangles

replication      the number of trials per point
continuing       axes along which trials are links of chains
continued_checks the requirements of a continued axis

section          sections that methods add
failure_policy   the handling of failed trials

recorded         names of metrics and columns
recording        tracked individuals in place of a model
profiles         metrics with values along an axis
derived_metrics  metrics that formulas define

study_folder     names of a study and of the files in its folder
built_in         the folders of the built-in studies
seeds            random streams by purpose

schema           the JSON Schema of a spec
schema_settings  the schema of parameters
schema_parts     the parts of the schema
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
