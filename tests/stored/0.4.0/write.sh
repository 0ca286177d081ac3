#!/bin/sh
# Writes studies/ and expected/ anew: sh write.sh SWEEP, the `sweep` of version 0.4.0.
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

# Shares are not merged: this study has two parts. Some of its trials diverge: exit code 1.
sweep launch specs/room.yaml --workers 1 --shard 1/2 || [ $? -eq 1 ]
sweep launch specs/room.yaml --workers 1 --shard 2/2 || [ $? -eq 1 ]
tables room trials heatmaps trajectories
sweep status room > expected/room/status.txt
sweep table room --json > expected/room/table.json
sweep compare room:cohesion_weight=0.01 room:cohesion_weight=5,alignment_weight=0.5 --json \
    > expected/room/compare.json

sweep launch specs/narrow.yaml --workers 1
tables narrow trials series
sweep status narrow > expected/narrow/status.txt
sweep table narrow --json > expected/narrow/table.json
sweep compare narrow:as_run narrow:detail=drag --json > expected/narrow/compare.json

sweep search specs/gains.yaml --workers 1
tables gains trials
sweep status gains > expected/gains/status.txt
sweep search specs/gains.yaml --workers 1 --json > expected/gains/search.json
