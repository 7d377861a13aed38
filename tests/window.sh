#!/usr/bin/env bash
# Drives the real window under Xvfb, as hands would, and takes the pictures of docs/viewer.md.
#
#   tests/window.sh target/release/meniscus OUT [WIDTHxHEIGHT]
#
# Needs Xvfb, xdotool and ImageMagick (Debian: xvfb xdotool imagemagick) and any Vulkan driver. What it opens: play, seek,
# switch renderer, compare, touch the water, record, reopen the recording. It ends with an error if a step leaves no file.
set -euo pipefail
binary=$(realpath "$1")
out=$(mkdir -p "$2" && realpath "$2")
size=${3:-1280x800}
scene=$(realpath "$(dirname "$0")/../data/scenes/pool.toml")
display=:$((70 + RANDOM % 900))
cd "$out"

Xvfb "$display" -screen 0 "${size}x24" -nolisten tcp >/dev/null 2>&1 &
server=$!
trap 'kill $server 2>/dev/null || true' EXIT
sleep 1
export DISPLAY=$display XDG_CONFIG_HOME=$out/config

shot() { import -window root "$out/$1.png"; }
key() { xdotool key --clearmodifiers "$@"; sleep "${PAUSE:-0.4}"; }
at() { xdotool mousemove "$1" "$2"; sleep 0.15; }
click() { at "$1" "$2"; xdotool click 1; sleep 0.4; }
# Opens the window on a file and waits for its first picture.
open() {
    "$binary" -v view "$@" 2>"$out/window.log" &
    window=$!
    id=$(xdotool search --sync --onlyvisible --pid "$window" --name Meniscus | head -1)
    xdotool windowmove "$id" 0 0 windowsize "$id" "${size%x*}" "${size#*x}" windowfocus "$id"
    sleep "${SETTLE:-6}"
}
# Closes the window, and shows how long its thread was busy.
shut() {
    key ctrl+q
    wait "$window" || true
    grep -E 'panels|window|processor' "$out/window.log" || true
}

rm -f "$out"/*.mrec "$out"/*.png
"$binary" record "$scene" --set solver.spacing=0.04 --duration 3 -o run.mrec --quiet

open run.mrec
key Home; key K; sleep 3
shot replay
key space; sleep 2
key K; key Right; key Right; key Left
key C; sleep 8
shot split
key S; sleep 1
key M; key M; sleep 1
shot difference
key C; key P; key l; sleep 5
shot plots
shut
test -s run_*.png

open "$scene" --set solver.spacing=0.05
sleep 2
key R
w=${size%x*} h=${size#*x}
# The tool "Push" is chosen in the panel; then the water is dragged along.
click $((w - 205)) "${PUSH_Y:-453}"
for x in 20 26 32 38 44 50; do
    at $((w * x / 100)) $((h * 55 / 100))
    [ "$x" = 20 ] && xdotool mousedown 1
    sleep 0.2
done
shot touch
xdotool mouseup 1
sleep 2
key R; sleep 1
shot recorded
shut
"$binary" info pool.mrec
open pool.mrec
sleep 3
key T; sleep 2
shot light
shut
