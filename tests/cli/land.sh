#!/usr/bin/env bash
# traceur land: what it tells, what it refuses, and that many falls are counted alike on any threads.
# usage: land.sh TRACEUR
set -u
traceur=$(realpath "$1")
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
failures=0
complain() { echo "$1"; failures=$((failures + 1)); }

"$traceur" land --height 2.5 --out "$dir/land.png" >"$dir/text" || complain "land: exit $?"
grep -q "touches down" "$dir/text" || complain "land: no touch-down told"
[ -s "$dir/land.png" ] || complain "land: no film strip"
"$traceur" land --height 2.5 --json | python3 -c '
import json, sys
fall = json.load(sys.stdin)
assert fall["rolls"] in (True, False) and 0.3 < fall["touch_down"] < 0.8, fall' ||
  complain "land --json: not what it should be"
"$traceur" land --strategy ragdoll --json | python3 -c '
import json, sys
fall = json.load(sys.stdin)
assert not fall["stands"] and fall["ended"] == "does not stand", fall' ||
  complain "a ragdoll stands"

"$traceur" land --strategy ragdoll --stress --json | python3 -c '
import json, sys
fall = json.load(sys.stdin)
assert abs(fall["stress_ratio"]["mean"] - 1) < 1e-9, fall["stress_ratio"]' ||
  complain "a ragdoll bears other than a ragdoll"
"$traceur" land --falls 2 --set easy --stress >"$dir/stress" || complain "stress: exit $?"
grep -q "^neck" "$dir/stress" || complain "land --falls --stress: no neck"

"$traceur" land --falls 4 --set easy --json --threads 1 >"$dir/one" || complain "falls: exit $?"
"$traceur" land --falls 4 --set easy --json --threads 2 >"$dir/two" || complain "falls: exit $?"
cmp -s "$dir/one" "$dir/two" || complain "falls differ with the threads"

# refused WORDS ARGUMENTS…
refused() {
  local words=$1
  shift
  local text
  text=$("$traceur" land "$@" 2>&1 >/dev/null) && complain "land $*: not refused"
  case $text in *"$words"*) ;; *) complain "land $*: $text" ;; esac
}
refused "--height 0: height is within [1, 25] m" --height 0
refused "no set of falls named" --falls 2 --set esy
refused "to judge a landing by" --robot bioloid-gp
refused "looked in" --robot nobody
refused "has no condition" --given heigth=3
refused "expected NAME=VALUE" --given height
refused "pictures are of one fall" --falls 2 --out "$dir/x.png"
refused "no such run file" --from "$dir/none.run"
exit $((failures > 0))
