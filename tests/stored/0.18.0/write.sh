#!/bin/sh
# Writes studies/ and expected/ anew: sh write.sh SWEEP, the `sweep` of version 0.18.0.
# In a copy of this folder outside of any repository, whose state results would name.
set -eu
program=$(realpath "$1")
cd "$(dirname "$0")"

sweep() {
    "$program" "$@" --results studies
}

# Each table as CSV, which has the bits of every number.
tables() {
    study=$1
    shift
    mkdir -p "expected/$study"
    for table in "$@"; do
        sweep export "$study" --table "$table" --to "expected/$study/$table.csv"
    done
    rm expected/"$study"/*.csv.json expected/"$study"/*.csv.sha256
}

rm -rf studies expected

sweep launch specs/own.yaml --workers 1
tables own trials series trajectories
sweep table own --json > expected/own/table.json


sweep search specs/gains.yaml --workers 1
tables gains trials
sweep search specs/gains.yaml --workers 1 --json > expected/gains/search.json

sweep launch specs/loop.yaml --workers 1
tables loop trials series

sweep launch specs/robots.yaml --workers 1
tables robots trials trajectories
sweep compare robots:as_run robots:detail=late --json > expected/robots/compare.json

sweep launch specs/edge.yaml --workers 1
tables edge trials
sweep boundary edge --json > expected/edge/boundary.json

sweep launch specs/steps.yaml --workers 1
tables steps trials
