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

"$traceur" land --strategy ragdoll --stress --json --time-step 0.003 | python3 -c '
import json, sys
fall = json.load(sys.stdin)
assert abs(fall["stress_ratio"]["mean"] - 1) < 1e-9, fall["stress_ratio"]' ||
  complain "a ragdoll bears other than a ragdoll"
"$traceur" land --falls 2 --set easy --stress --time-step 0.003 >"$dir/stress" || complain "stress: exit $?"
grep -q "^neck" "$dir/stress" || complain "land --falls --stress: no neck"

"$traceur" land --falls 4 --set easy --json --time-step 0.003 --threads 1 >"$dir/one" || complain "falls: exit $?"
"$traceur" land --falls 4 --set easy --json --time-step 0.003 --threads 2 >"$dir/two" || complain "falls: exit $?"
cmp -s "$dir/one" "$dir/two" || complain "falls differ with the threads"

# Whatever happens on the way, the same limp fall comes down later or earlier for it.
touch_down() {
  "$traceur" land --strategy ragdoll --height 3 --velocity 2 --time-step 0.003 --json "$@" |
    python3 -c 'import json, sys; print(json.load(sys.stdin)["touch_down"])'
}
python3 - "$(touch_down)" "$(touch_down --drag time=0.2 up=1)" "$(touch_down --push time=0.1 up=60)" \
  "$(touch_down --cannon time=0.1 mass=5 left=10)" "$(touch_down --onto height=1)" <<'END' ||
import sys
plain, drag, push, cannon, onto = map(float, sys.argv[1:])
assert drag > plain + 0.1 and push > plain + 0.05 and onto < plain - 0.1, sys.argv
assert abs(cannon - plain) < 0.1 and cannon != plain, sys.argv
END
  complain "drag, push, cannon, onto: not as they should be"
"$traceur" land --robot odd --skill land-dissertation --time-step 0.002 --json >"$dir/odd" || complain "odd: exit $?"
grep -q '"touch_down": 0' "$dir/odd" || complain "odd: comes down nowhere"
for surface in ice gym trampoline; do
  "$traceur" land --surface $surface --time-step 0.003 --json --perturb mass=1.1 delay=0.002 >"$dir/$surface" ||
    complain "land --surface $surface: exit $?"
done
cmp -s "$dir/ice" "$dir/gym" && complain "ice is as a mat"

# refused WORDS ARGUMENTS…
refused() {
  local words=$1
  shift
  local text
  text=$("$traceur" land "$@" 2>&1 >/dev/null) && complain "land $*: not refused"
  case $text in *"$words"*) ;; *) complain "land $*: $text" ;; esac
}
refused "--height 0: height is within [1, 25] m" --height 0
refused "no surface named \"ics\". Did you mean \"ice\"?" --surface ics
refused "begins inside" --height 3 --velocity 0 --onto height=2.5
refused "expected --height and --velocity too" --onto height=1
refused "expected --height and --velocity too" --height 3 --onto height=1
refused "has no number \"tim\"" --push tim=3
refused "expected a velocity" --cannon time=0.2
refused "expected no --falls" --falls 2 --height 3 --velocity 1 --onto height=1
refused "no set of falls named" --falls 2 --set esy
refused "to judge a landing by" --robot bioloid-gp
refused "looked in" --robot nobody
refused "lnd" --skill lnd
refused "has no condition" --given heigth=3
refused "expected NAME=VALUE" --given height
refused "pictures are of one fall" --falls 2 --out "$dir/x.png"
refused "no such run file" --from "$dir/none.run"
exit $((failures > 0))
