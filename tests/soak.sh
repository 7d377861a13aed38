#!/usr/bin/env bash
# Leaves the window to itself for ten minutes with a live scene, and for ten with a recording in a loop, plots open, and reads
# the process's memory every ten seconds.
#
#   tests/soak.sh target/release/meniscus OUT [SECONDS]
#
# Needs Xvfb and xdotool. It ends with an error if memory grows by more than 16 MiB after the first quarter of the time.
# With `-v` the window says on closing how long its thread was busy; that is printed too.
set -euo pipefail
binary=$(realpath "$1")
out=$(mkdir -p "$2" && realpath "$2")
seconds=${3:-600}
scene=$(realpath "$(dirname "$0")/../data/scenes/pool.toml")
display=:$((70 + RANDOM % 900))
cd "$out"

Xvfb "$display" -screen 0 1280x800x24 -nolisten tcp >/dev/null 2>&1 &
server=$!
trap 'kill $server 2>/dev/null || true' EXIT
sleep 1
export DISPLAY=$display XDG_CONFIG_HOME=$out/config
failed=0

# Opens the window on a file, presses the keys that follow, and watches the process.
soak() {
    local name=$1
    shift
    local file=("$1" "${@:2:2}")
    "$binary" -v view "${file[@]}" 2>"$name.log" &
    local window=$!
    local id
    id=$(xdotool search --sync --onlyvisible --pid "$window" --name Meniscus | head -1)
    xdotool windowmove "$id" 0 0 windowsize "$id" 1280 800 windowfocus "$id"
    sleep 5
    xdotool key --clearmodifiers P
    [ "$name" = loop ] && xdotool key --clearmodifiers shift+L
    : >"$name.rss"
    local begin=$SECONDS
    while [ $((SECONDS - begin)) -lt "$seconds" ]; do
        sleep 10
        awk -v t=$((SECONDS - begin)) '/^VmRSS/ { print t, $2 }' "/proc/$window/status" >>"$name.rss"
    done
    xdotool key --clearmodifiers ctrl+q
    wait "$window" || true
    awk -v name="$name" -v quarter=$((seconds / 4)) '
        $1 >= quarter && !early { early = $2 }
        { late = $2; if ($2 > most) most = $2 }
        END {
            printf "%s: %.0f MiB after a quarter of the time, %.0f at the end, %.0f at most\n", name, early / 1024, late / 1024, most / 1024
            exit (late - early > 16384)
        }' "$name.rss" || failed=1
    grep -E 'panels|window|frames' "$name.log" || true
}

"$binary" record "$scene" --set solver.spacing=0.05 --duration 4 -o loop.mrec --force --quiet 2>/dev/null ||
    "$binary" record "$scene" --set solver.spacing=0.05 --duration 4 -o loop.mrec --quiet
soak live "$scene" --set solver.spacing=0.05
soak loop loop.mrec
exit $failed
