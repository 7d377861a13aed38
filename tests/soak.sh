#!/usr/bin/env bash
# Leaves two windows to themselves for ten minutes, plots open, one with a live scene and one with a recording in a loop, and
# reads the memory of both processes every ten seconds.
#
#   tests/soak.sh target/release/meniscus OUT [SECONDS]
#
# Needs Xvfb and xdotool. It ends with an error if either grows by more than 16 MiB after the first quarter of the time.
# On closing the windows say how long their threads were busy; that is printed too.
set -euo pipefail
binary=$(realpath "$1")
out=$(mkdir -p "$2" && realpath "$2")
seconds=${3:-600}
scene=$(realpath "$(dirname "$0")/../data/scenes/pool.toml")
display=:$((70 + RANDOM % 900))
cd "$out"

Xvfb "$display" -screen 0 2560x800x24 -nolisten tcp >/dev/null 2>&1 &
server=$!
trap 'kill $server 2>/dev/null || true' EXIT
sleep 1
export DISPLAY=$display XDG_CONFIG_HOME=$out/config

rm -f loop.mrec
"$binary" record "$scene" --set solver.spacing=0.05 --duration 4 -o loop.mrec --quiet

declare -A process window
# Opens a window at `$2` pixels from the left on what follows, with plots.
open() {
    local name=$1 left=$2
    shift 2
    "$binary" -v view "$@" 2>"$name.log" &
    process[$name]=$!
    window[$name]=$(xdotool search --all --sync --onlyvisible --pid "${process[$name]}" --name Meniscus | head -1)
    xdotool windowmove "${window[$name]}" "$left" 0 windowsize "${window[$name]}" 1280 800 windowfocus "${window[$name]}"
    sleep 6
    xdotool key --clearmodifiers P
    : >"$name.rss"
}
open live 0 "$scene" --set solver.spacing=0.05
open loop 1280 loop.mrec
# By now it may have played to its end: from the beginning, in a loop.
for key in K Home shift+L space; do
    xdotool key --clearmodifiers "$key"
    sleep 1
done

begin=$SECONDS
while [ $((SECONDS - begin)) -lt "$seconds" ]; do
    sleep 10
    for name in live loop; do
        awk -v t=$((SECONDS - begin)) '/^VmRSS/ { print t, $2 }' "/proc/${process[$name]}/status" >>"$name.rss"
    done
done

failed=0
for name in live loop; do
    xdotool windowfocus "${window[$name]}"
    sleep 1
    xdotool key --clearmodifiers ctrl+q
    wait "${process[$name]}" || true
    awk -v name="$name" -v quarter=$((seconds / 4)) '
        $1 >= quarter && !early { early = $2 }
        { late = $2; if ($2 > most) most = $2 }
        END {
            printf "%s: %.0f MiB after a quarter of the time, %.0f at the end, %.0f at most\n", name, early / 1024, late / 1024, most / 1024
            exit (late - early > 16384)
        }' "$name.rss" || failed=1
    grep -E 'panels|window|processor|frames' "$name.log" || true
done
exit $failed
