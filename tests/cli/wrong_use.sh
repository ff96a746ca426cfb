#!/usr/bin/env bash
# Wrong input to the program: one clear message naming the thing, exit 1 or 2, nothing left behind.
# usage: wrong_use.sh TRACEUR
set -u
traceur=$1
nod=tests/cli/nod.toml
dir=$(mktemp -d)
export XDG_CACHE_HOME=$dir/cache  # nothing of the user's is touched
trap 'chmod -R u+w "$dir"; rm -rf "$dir"' EXIT
failures=0

# expect CODE WORDS… -- ARGUMENTS…: the exit code, and words the message must hold.
expect() {
  local code=$1 words=()
  shift
  while [ "$1" != -- ]; do words+=("$1"); shift; done
  shift
  local text got
  text=$("$traceur" "$@" 2>&1 >/dev/null)
  got=$?
  local wrong=""
  [ "$got" -eq "$code" ] || wrong="exit $got instead of $code"
  for w in "${words[@]}"; do
    case $text in *"$w"*) ;; *) wrong="$wrong; no \"$w\"" ;; esac
  done
  if [ -n "$wrong" ]; then
    failures=$((failures + 1))
    printf 'traceur %s: %s\n%s\n' "$*" "$wrong" "$text"
  fi
}

# Whether the task was reached (exit 3: not) does not matter here.
accept() { local code=0; "$traceur" "$@" || code=$?; [ $code -eq 0 ] || [ $code -eq 3 ]; }

expect 2 'no verb "lern"' 'Did you mean "learn"' -- lern
expect 2 'no verb "frobnicate"' -- frobnicate
expect 2 'SKILL is required' -- learn
expect 2 '--seeed' 'Did you mean "--seed"' -- learn "$nod" --seeed 3
expect 2 'no/such.toml' 'No such file' -- learn no/such.toml
expect 2 'got a folder' -- learn tests
expect 2 '--budget' -- learn "$nod" --budget 0 --out "$dir/a.run"
expect 2 '--budget' -- learn "$nod" --budget many --out "$dir/a.run"
expect 2 'task 7 rad' '[0, 1]' -- learn "$nod" --task 7 --out "$dir/a.run"
expect 2 '--task' 'got nan' -- learn "$nod" --task nan --out "$dir/a.run"
expect 2 'cma-es' -- learn "$nod" --optimiser cma --out "$dir/a.run"
expect 1 '/proc/nowhere' -- learn "$nod" --out /proc/nowhere/a.run
printf 'name = "x"\nrobot = \n' >"$dir/bad.toml"
expect 2 'bad.toml:2:' -- learn "$dir/bad.toml" --out "$dir/a.run"
sed 's/bioloid-gp/bioloid/' "$nod" >"$dir/robot.toml"
expect 2 'Did you mean "bioloid-gp"' -- learn "$dir/robot.toml" --out "$dir/a.run"
sed 's/shoulder = "shoulder"/sholder = "shoulder"/' "$nod" >"$dir/joint.toml"
expect 2 'Did you mean "shoulder"' -- learn "$dir/joint.toml" --out "$dir/a.run"
sed 's/(raised - task)^2/sqrt(-1 - raised^2)/' "$nod" >"$dir/nan.toml"
expect 1 'no trial gave a cost' 'budget' -- learn "$dir/nan.toml" --budget 40 --quiet --out "$dir/nan.run"
expect 2 'no such run file' -- show "$dir/none.run"
echo 'not a database, only some text that goes on' >"$dir/text.run"
expect 2 'text.run' 'left as it is' -- show "$dir/text.run"
expect 2 'text.run' -- learn "$nod" --out "$dir/text.run" --resume
expect 2 'neither a file nor one of' -- inspect nobody
if [ ! -e /usr/local/share/traceur ]; then
  program=$(realpath "$traceur")
  (cd / && "$program" inspect nobody 2>&1) | grep -q 'found no models/ in: ' ||
    { echo "inspect without any models/: does not say where it looked"; failures=$((failures + 1)); }
fi
expect 2 '--push is required' -- fall --robot atlas
expect 2 'has no fall "stand forward"' 'two_feet backward' -- fall --robot atlas --stance stand --push 9
expect 2 'cannot leave out "tail"' 'hands' -- fall --robot bioloid-gp --without tail --push 9
expect 2 'fly not in {' -- fall --robot atlas --push 9 --strategy fly
expect 2 "100000: the simulation of" diverges -- fall --robot bioloid-gp --push 100000 --strategy hold
expect 2 'no fall has a "nose"' -- fall compile --robot atlas --without nose --out "$dir/nose"
expect 0 -- fall --robot atlas --push 9 --strategy planned
expect 2 'come after it, not --literal' -- fall --literal compile --robot atlas
expect 2 'no falls.toml beside it' -- fall --robot tests/cli/nod.toml --push 9
printf '<mujoco><worldbody></mujoco>' >"$dir/broken.xml"
expect 2 'broken.xml:1' -- inspect "$dir/broken.xml"
if [ -e "$dir/a.run" ]; then
  echo "a refused run left a file behind"
  failures=$((failures + 1))
fi

accept learn "$nod" --budget 32 --out "$dir/b.run" --quiet || failures=$((failures + 1))
expect 2 'b.run' 'exists already' '--resume' -- learn "$nod" --budget 32 --out "$dir/b.run"
expect 2 'another seed' 'it has 1, got 2' -- learn "$nod" --budget 32 --out "$dir/b.run" --resume --seed 2
expect 2 'another task' -- learn "$nod" --budget 32 --out "$dir/b.run" --resume --task 0.2
cp "$dir/b.run" "$dir/x.run"
python3 -c 'import sqlite3, sys; d = sqlite3.connect(sys.argv[1]); d.execute("update meta set value = ? where key = ?", ("x", "budget")); d.commit()' "$dir/x.run"
expect 2 'x.run: budget: "x" is not a number in' -- learn "$nod" --budget 64 --out "$dir/x.run" --resume
expect 2 'budget 16 is less' -- learn "$nod" --budget 16 --out "$dir/b.run" --resume
sed 's/horizon = 0.1/horizon = 0.2/' "$nod" >"$dir/changed.toml"
expect 2 'has changed since' -- learn "$dir/changed.toml" --budget 32 --out "$dir/b.run" --resume
expect 2 'b.gif' '.png' -- render "$dir/b.run" "$dir/b.gif"
expect 2 '--view' 'above' 'side' -- render "$dir/b.run" "$dir/b.png" --view above
expect 1 '/proc/nowhere' -- plot "$dir/b.run" --what cost --out /proc/nowhere/a.png
expect 2 'changed.toml' 'exists already' -- inspect bioloid-gp --mjcf "$dir/changed.toml"
expect 1 '/proc/nowhere/a.xml' -- inspect bioloid-gp --mjcf /proc/nowhere/a.xml
expect 2 'changed.toml' 'exists already' -- inspect models/atlas/robot.xml --write "$dir/changed.toml"
expect 2 'says already what a draft would' -- inspect atlas --write "$dir/drafted.toml"
expect 2 'ending in .toml' -- inspect models/atlas/robot.xml --write "$dir/drafted.xml"
expect 1 '/proc/nowhere' -- inspect models/atlas/robot.xml --write /proc/nowhere/robot.toml
expect 2 'ending in .png' -- inspect atlas --picture "$dir/atlas.gif"
expect 2 'Did you mean "stand"' -- inspect atlas --picture "$dir/atlas.png" --pose stnad
expect 2 '--picture' -- inspect atlas --pose stand
expect 0 'stands: knees a little bent' -- inspect models/atlas/robot.xml --write "$dir/drafted.toml" --picture "$dir/drafted.png"
expect 0 -- inspect "$dir/drafted.toml"
[ -s "$dir/drafted.png" ] || { echo "inspect --picture: no picture"; failures=$((failures + 1)); }

expect 2 'FIRST:LAST:COUNT' -- learn "$nod" --tasks 0:1 --out "$dir/k.run"
expect 2 '[0, 1]' -- learn "$nod" --tasks 0:2:3 --out "$dir/k.run"
expect 2 'contextual' -- learn "$nod" --tasks 0:1:3 --optimiser cma-es --out "$dir/k.run"
expect 2 'for a family' -- learn "$nod" --tasks 0:1:3 --task 0.5 --out "$dir/k.run"
accept learn "$nod" --tasks 0:1:3 --budget 200 --out "$dir/k.run" --quiet || failures=$((failures + 1))
expect 2 'expected FIRST:LAST:COUNT, got ""' -- learn "$nod" --tasks "" --out "$dir/none.run"
expect 2 'expected optimiser cma-c' -- learn "$nod" --experience "$dir/b.run" --out "$dir/none.run"
expect 2 'expected tasks' -- learn "$nod" --curve cubic --out "$dir/none.run"
expect 2 'at least 4 tasks, got 3' -- learn "$nod" --tasks 0:1:3 --curve cubic --out "$dir/none.run"
expect 2 'individual' 'cubic' -- learn "$nod" --tasks 0:1:4 --curve cubic --optimiser individual --out "$dir/none.run"
expect 1 'no curve was run at all 6 tasks' '--budget' -- learn "$nod" --tasks 0:1:6 --budget 20 --out "$dir/few.run"
accept learn "$nod" --tasks 0.0:1.0:3 --budget 200 --out "$dir/k.run" --quiet --resume || failures=$((failures + 1))
expect 2 'another tasks' -- learn "$nod" --tasks 0:1:4 --budget 200 --out "$dir/k.run" --resume
expect 2 'learned for 0 to 1' -- perform "$dir/k.run" --task 1.5
expect 2 'expected --task or --sweep' -- perform "$dir/k.run"
expect 2 'is not a number' -- perform "$dir/k.run" --task 0.1,,0.2 --no-picture
expect 2 'expected a number, got none' -- perform "$dir/k.run" --task ""
"$traceur" perform "$dir/k.run" --task 0.2,1.5 --no-picture 2>/dev/null | grep -q . &&
  { echo "perform: began before it had checked every task"; failures=$((failures + 1)); }
expect 2 'a family: expected --task' -- render "$dir/k.run" "$dir/k.png"
expect 2 'not a family' -- render "$dir/b.run" "$dir/b.png" --task 0.5
expect 2 '--seed' 'got 18446744073709551616' -- learn "$nod" --seed 18446744073709551616 --out "$dir/none.run"
expect 2 '--seed' 'got 0x10' -- learn "$nod" --seed 0x10 --out "$dir/none.run"
expect 2 '--budget' 'got 010' -- learn "$nod" --budget 010 --out "$dir/none.run"
expect 2 '--budget' -- learn "$nod" --budget 4294967296 --out "$dir/none.run"
for number in nan inf -inf 1e999; do  # of every verb, by name
  expect 2 '--push' "$number" -- fall --robot bioloid-gp --push=$number
  expect 2 '--step-size' "$number" -- learn "$nod" --step-size=$number --out "$dir/none.run"
  expect 2 '--target' "$number" -- minimise --var x=0:1 --target=$number -- false
  expect 2 '--angle' "$number" -- balance fit --angle=$number
  expect 2 '--speed' "$number" -- render "$dir/none.run" "$dir/a.mp4" --speed=$number
done
expect 2 'expected a number in [0, 18446744073709551615], got -1' -- learn "$nod" --seed -1 --out "$dir/none.run"
sed '/^range = /d; /^default = /d' "$nod" >"$dir/no-range.toml"
expect 2 'no [task] with a range' -- learn "$dir/no-range.toml" --tasks 0:1:3 --out "$dir/none.run"
sed 's/- task/- 0.5/' "$nod" >"$dir/no-task.toml"
expect 2 'no cost depends on "task"' -- learn "$dir/no-task.toml" --tasks 0:1:3 --out "$dir/none.run"
expect 2 'got a folder' -- reproduce families --no-run --out "$dir"
: >"$dir/empty.csv"
expect 2 'no whole run' -- reproduce families --no-run --out "$dir/empty.csv"
mkdir -p "$dir/other/models" "$dir/other/sub"
cp -r models/bioloid-gp "$dir/other/models/"
sed -i 's/mass_scale = .*/mass_scale = 2.2/' "$dir/other/models/bioloid-gp/robot.toml"
cp "$dir/k.run" "$dir/other/sub/"
( traceur=$(realpath "$traceur"); cd "$dir/other/sub"
  expect 2 'learned with another robot' -- perform k.run --task 0.5 --no-picture
  expect 2 'learned with another robot' -- export k.run --task 0.5
  exit "$failures" ) || failures=$((failures + 1))
name=$(basename "$nod")
(program=$(realpath "$traceur"); TRACEUR_DATA=$PWD; export TRACEUR_DATA; cd tests/cli &&
  "$program" learn "$name" --budget 16 --out "$dir/named.run" --quiet || [ $? -eq 3 ]) ||
  { echo "learn: not a file named without its folder"; failures=$((failures + 1)); }
"$traceur" plot "$dir/k.run" >/dev/null && [ -s "$dir/k-cost.png" ] && [ ! -e "$dir/k-joints.png" ] ||
  { echo "plot: not a family's cost"; failures=$((failures + 1)); }
expect 2 'not a family' -- perform "$dir/b.run" --task 0.5
"$traceur" perform "$dir/k.run" --task 0.2,0.4 --json --no-picture |
  python3 -c 'import json, sys; d = json.load(sys.stdin)["performed"]; sys.exit(not (len(d) == 2 and all(abs(p["error"]) < 0.2 for p in d)))' ||
  { echo "perform --json: not the object it should be"; failures=$((failures + 1)); }
accept perform "$dir/k.run" --sweep 5 --no-picture --json >/dev/null && [ "$(wc -l <"$dir/k-sweep.csv")" -eq 7 ] ||
  { echo "perform --sweep: no table of five"; failures=$((failures + 1)); }
expect 2 '--perturb requires --sweep' -- perform "$dir/k.run" --perturb
"$traceur" perform "$dir/k.run" --sweep 2 --perturb --no-picture --json |
  python3 -c 'import json, sys; k = json.load(sys.stdin)["kinds"]; sys.exit(not (k["mass"]["trials"] == 10 and k["drawn"]["trials"] == 40))' ||
  { echo "perform --perturb: not the object it should be"; failures=$((failures + 1)); }
expect 2 'a family: expected --task' -- export "$dir/k.run"
expect 2 'learned for 0 to 1' -- export "$dir/k.run" --task 2
expect 2 'was learned for' -- export "$dir/b.run" --task 0.77
expect 2 'multiple' '0.01' -- export "$dir/k.run" --task 0.4 --period 0.0123456
expect 2 "--out $dir/" -- export "$dir/k.run" --task 0.4 --out "$dir/"
expect 2 'time step' -- export "$dir/k.run" --task 0.4 --period 0.0001
[ ! -e "$dir/k-0.4-targets.csv" ] || { echo "export: left a file after a mistake"; failures=$((failures + 1)); }
"$traceur" export "$dir/k.run" --task 0.4 >/dev/null && [ "$(wc -l <"$dir/k-0.4-targets.csv")" -eq 12 ] &&
  python3 - "$dir/k-0.4-controller.json" <<'END' || { echo "export: not what it should be"; failures=$((failures + 1)); }
import json, sys
c = json.load(open(sys.argv[1]))
target = c["phases"][0]["targets"]["l_shoulder"]
sys.exit(not (0 < target < 1 and target == c["phases"][0]["targets"]["r_shoulder"]
              and c["parameters"]["shoulder"]["value"] == target))
END
"$traceur" export "$dir/b.run" >/dev/null || { echo "export: not of one task"; failures=$((failures + 1)); }
# A name with a dot and a phase with a comma.
sed 's/"raise"/"raise, both"/' "$nod" >"$dir/comma.toml"
accept learn "$dir/comma.toml" --budget 16 --out "$dir/v1.2" --quiet &&
  "$traceur" export "$dir/v1.2" --json |
  python3 -c 'import json, sys; d = json.load(sys.stdin); sys.exit("within_tolerance" not in d)' &&
  python3 - "$dir/v1.2-0.1-targets.csv" <<'END' || { echo "export: not what it should be of v1.2"; failures=$((failures + 1)); }
import csv, sys
head, *rows = list(csv.reader(open(sys.argv[1])))[1:]
sys.exit(not (rows and all(len(r) == len(head) and r[1] == "raise, both" for r in rows)))
END
expect 2 'none of this name' 'Did you mean "contextual"' -- reproduce figure-32 --column contextal
expect 2 '--picture' 'is no figure' -- reproduce table-7 --picture "$dir/x.png"
expect 2 'f.svg' 'expected .png' -- reproduce figure-39 --out "$dir/f.svg"
expect 2 'f.pdf' '.png or .svg' -- reproduce figure-40 --out "$dir/f.pdf"

expect 2 'no table or figure "table-12"' 'table-11' -- reproduce table-12
expect 2 '--seeds' -- reproduce table-7 --seeds 0
expect 2 'excludes' -- reproduce table-7 --seeds 3 --full
expect 1 'none.csv' -- reproduce table-7 --no-run --out "$dir/none.csv"
echo 'x,y' >"$dir/foreign.csv"
expect 2 'foreign.csv:1' -- reproduce table-7 --no-run --out "$dir/foreign.csv"
printf 'a note' >"$dir/note.txt"
expect 2 'note.txt:1' 'a note' -- reproduce table-7 --seeds 1 --quiet --out "$dir/note.txt"
[ "$(cat "$dir/note.txt")" = 'a note' ] || { echo "reproduce: a foreign file is gone"; failures=$((failures + 1)); }
expect 2 '--no-run' 'drawn anew' -- reproduce figure-28 --no-run

disc="python3 examples/disc.py"
minimise="minimise --var x=-2:2 --var y=-2:2"
expect 2 'is not below' -- minimise --var x=2:-2 -- $disc
expect 2 'NAME=MIN:MAX' -- minimise --var x -- $disc
expect 2 'NAME=MIN:MAX' -- minimise --var x=0:1: -- $disc
expect 2 'without spaces and commas' -- minimise --var x=0:1 --constraint a,b -- $disc
expect 2 'more than one line' -- minimise --var x=0:1 --out "$dir/two.run" -- sh -c 'while read x; do echo 1; echo 2; done'
expect 2 '"one" is not a number' -- minimise --var x=0:one -- $disc
expect 2 'outside [0, 1]' -- minimise --var x=0:1:3 -- $disc
expect 2 '"x" is named twice' -- minimise --var x=0:1 --var x=0:1 -- $disc
expect 2 'FIRST:LAST:COUNT' -- $minimise --tasks 3 --out "$dir/m.run" -- $disc
expect 2 'no optimiser "sgd"' -- $minimise --optimiser sgd --out "$dir/m.run" -- $disc
expect 2 'no --constraint "outside"' 'asked:' -- $minimise --out "$dir/m.run" -- $disc
expect 1 'cannot run nonesuch' -- $minimise --out "$dir/m.run" -- nonesuch
expect 2 'exit 3' -- $minimise --out "$dir/m.run" -- sh -c 'read x; exit 3'
expect 2 'answered "cost"' 'not a number' -- $minimise --out "$dir/m.run" -- sh -c 'while read x; do echo cost; done'
expect 1 'no trial gave a cost' -- $minimise --out "$dir/failing.run" -- sh -c 'while read x; do echo failed; done'
expect 2 'no such run file' -- $minimise --constraint outside --experience "$dir/none.run" --out "$dir/m.run" -- $disc
if [ -e "$dir/m.run" ]; then
  echo "a refused search left a file behind"
  failures=$((failures + 1))
fi
"$traceur" $minimise --constraint outside --budget 120 --out "$dir/disc.run" --json -- $disc 2>/dev/null |
  python3 -c 'import json, sys; d = json.load(sys.stdin); sys.exit(not (d["feasible"] and d["best_cost"] < -1.2))' ||
  { echo "minimise --json: not the object it should be"; failures=$((failures + 1)); }
expect 2 'expected optimiser cma-c' 'cma-es does not' -- $minimise --optimiser cma-es --constraint outside --experience "$dir/disc.run" --out "$dir/m.run" -- $disc
expect 2 'expected --tasks' -- $minimise --constraint outside --curve cubic --out "$dir/m.run" -- $disc
expect 2 'expected a run of the same parameters' 'disc.run' -- minimise --var u=-2:2 --var v=-2:2 --optimiser cma-c --constraint outside --experience "$dir/disc.run" --out "$dir/m.run" -- $disc
"$traceur" $minimise --constraint outside --budget 60 --experience "$dir/disc.run" --out "$dir/taught.run" --quiet -- $disc ||
  { echo "minimise --experience: failed"; failures=$((failures + 1)); }

# try: a skill as it stands, or with parameters of a person's.
expect 2 'SKILL is required' -- try
expect 2 'expected NAME=VALUE' -- try "$nod" --set shoulder
expect 2 'expected NAME=VALUE' -- try "$nod" --set =1
expect 2 'no parameter "sholder"' 'Did you mean "shoulder"' -- try "$nod" --set sholder=1
expect 2 '"much" is not a number' -- try "$nod" --set shoulder=much
expect 2 'shoulder is within [-1, 1] rad' -- try "$nod" --set shoulder=7
expect 2 'task 7 rad' '[0, 1]' -- try "$nod" --task 7
expect 2 'x.gif' 'expected a name ending in .png' -- try "$nod" --out "$dir/try.run" --out "$dir/x.gif"
[ ! -e "$dir/try.run" ] || { echo "try: left a file after a mistake"; failures=$((failures + 1)); }
expect 3 -- try "$nod"
expect 0 -- try "$nod" --set shoulder=0.123 --set elbow=0 --out "$dir/by-hand.run" --out "$dir/by-hand.png"
[ -s "$dir/by-hand.png" ] || { echo "try: no picture"; failures=$((failures + 1)); }
expect 2 'exists already' -- try "$nod" --out "$dir/by-hand.run"
sed 's/when = "com.z < 0.1"/when = "time > 0.05"/' "$nod" >"$dir/falls.toml"
expect 1 -- try "$dir/falls.toml"
for verb in "try $nod --set shoulder=0.123 --set elbow=0" "show $dir/by-hand.run"; do
  "$traceur" $verb --json | python3 -c '
import json, sys
d = json.load(sys.stdin)
raised = d["measures"]["raised [rad]"]
sys.exit(not (d["reached"] is True and abs(raised - 0.1) < 0.01 and d["achieved"] == raised
              and abs(d["objectives"]["arms"]) < 1e-2 and d["ended"] == "horizon"
              and d["parameters"]["shoulder [rad]"] == 0.123))' ||
    { echo "$verb --json: not the object it should be"; failures=$((failures + 1)); }
done
"$traceur" export "$dir/by-hand.run" >/dev/null || { echo "export: not of a trial by hand"; failures=$((failures + 1)); }

# learn --from: where another run ended, by names.
sed 's/elbow/bend/' "$nod" >"$dir/bend.toml"
expect 2 'no such run file' -- learn "$nod" --from "$dir/none.run" --out "$dir/g.run"
sed 's/shoulder = { unit = "rad"/shoulder = { unit = "deg"/' "$nod" >"$dir/deg.toml"
expect 2 'by-hand.run' 'its shoulder is in "rad", here it is in "deg"' -- learn "$dir/deg.toml" --from "$dir/by-hand.run" --out "$dir/g.run"
expect 2 'knows none of the parameters' 'it has x, y' -- learn "$nod" --from "$dir/disc.run" --out "$dir/g.run"
[ ! -e "$dir/g.run" ] || { echo "learn --from: left a file after a mistake"; failures=$((failures + 1)); }
text=$("$traceur" learn "$dir/bend.toml" --from "$dir/by-hand.run" --budget 16 --step-size 1e-6 --out "$dir/g.run" 2>/dev/null)
case $text in *"began at   shoulder of $dir/by-hand.run"*) ;; *) echo "learn --from: said $text"; failures=$((failures + 1)) ;; esac
"$traceur" show "$dir/g.run" --json | python3 -c '
import json, sys
p = json.load(sys.stdin)["parameters"]
sys.exit(not (abs(p["shoulder [rad]"] - 0.123) < 1e-3 and abs(p["bend [rad]"] - 0.5) < 1e-3))' ||
  { echo "learn --from: began elsewhere"; failures=$((failures + 1)); }
expect 2 'another from' 'got none' -- learn "$dir/bend.toml" --budget 32 --step-size 1e-6 --out "$dir/g.run" --resume
accept learn "$dir/bend.toml" --from "$dir/by-hand.run" --budget 32 --step-size 1e-6 --out "$dir/g.run" --resume --quiet ||
  { echo "learn --from: cannot be resumed"; failures=$((failures + 1)); }

# Whether the task was reached: the exit code, and true, false or null.
reached() {  # CODE VALUE ARGUMENTS…
  local got code
  got=$("$traceur" "${@:3}" --json 2>/dev/null)
  code=$?
  [ $code -eq "$1" ] && echo "$got" | grep -q "\"reached\": $2" ||
    { echo "${*:3}: exit $code, expected $1, and reached $2: $got"; failures=$((failures + 1)); }
}
reached 3 false learn "$nod" --budget 32 --out "$dir/h.run"
reached 3 false show "$dir/h.run"
reached 0 true learn "$nod" --budget 960 --out "$dir/h.run" --resume
reached 0 true show "$dir/h.run"
reached 0 null learn "$nod" --tasks 0:1:3 --budget 200 --out "$dir/h-family.run"
reached 0 null show "$dir/h-family.run"

# --json: one object, and only that, on standard output.
"$traceur" learn "$nod" --budget 32 --out "$dir/c.run" --json 2>/dev/null |
  python3 -c 'import json, sys; d = json.load(sys.stdin); sys.exit(not (d["evaluations"] == 32 and d["run"].endswith("c.run") and d["unit"] == "rad"))' ||
  { echo "--json: not the object it should be"; failures=$((failures + 1)); }
verbs=$("$traceur" --help | sed -n '/^Subcommands:/,$s/^  \([a-z][a-z-]*\) .*/\1/p')
[ "$(echo "$verbs" | wc -l)" -ge 5 ] || { echo "traceur --help: no verbs in it"; failures=$((failures + 1)); }
for verb in $verbs; do
  "$traceur" "$verb" --help | grep -q 'Example' || { echo "$verb --help: no example"; failures=$((failures + 1)); }
done

# inspect judges only verbs there are, and a robot without a TOML can be learned with.
for robot in bioloid-gp models/bioloid-gp/robot.xml; do
  "$traceur" inspect "$robot" --json | VERBS=$verbs python3 -c '
import json, os, sys
missing = json.load(sys.stdin)["missing"]
sys.exit(not (set(missing) <= set(os.environ["VERBS"].split()) and missing["learn"] == []))' ||
    { echo "inspect $robot: missing is not what it should be"; failures=$((failures + 1)); }
done

# A skill that does not say what a trial achieved is neither reached nor not.
sed '/^achieved/d; /^tolerance/d' "$nod" >"$dir/plain.toml"
"$traceur" learn "$dir/plain.toml" --budget 32 --out "$dir/d.run" --json 2>/dev/null |
  python3 -c 'import json, sys; d = json.load(sys.stdin); sys.exit(not (d["reached"] is None and d["achieved"] is None))' ||
  { echo "no achieved: not null"; failures=$((failures + 1)); }
"$traceur" learn "$dir/plain.toml" --budget 32 --out "$dir/e.run" 2>/dev/null | grep -q 'nod: best cost' ||
  { echo "no achieved: no cost in the answer"; failures=$((failures + 1)); }

# Killed before there was a run in its file: --resume begins it.
: >"$dir/empty.run"
expect 2 'exists already' -- learn "$nod" --budget 32 --out "$dir/empty.run"
expect 2 'before it began' -- show "$dir/empty.run"
expect 3 -- learn "$nod" --budget 32 --out "$dir/empty.run" --resume --quiet

# A machine's logs and faults.
log=models/bongo-board/example-log.csv
expect 2 'Did you mean "learn"' 'evaluate, export' -- balance lern
expect 2 'Did you mean "--hardware"' 'traceur balance learn --help' -- balance learn --hardwar x
expect 2 'no/such.toml' -- balance learn --hardware no/such.toml --out "$dir/balance"
printf '[faults]\ndelays = 1\n' >"$dir/machine.toml"
expect 2 'machine.toml:2:' 'Did you mean "delay"' -- balance learn --hardware "$dir/machine.toml" --out "$dir/balance"
expect 2 'magic' 'There is: bias' -- balance fit --method magic --out "$dir/p.json"
expect 2 'no/such.csv' -- balance fit --data no/such.csv --out "$dir/p.json"
sed 's/"torque":"N·m"/"torque":"kN"/' $log >"$dir/unit.csv"
expect 2 'unit.csv' 'torque' 'kN' -- balance fit --data "$dir/unit.csv" --out "$dir/p.json"
sed 's/wheel_rate,board_rate/wheel_rates,board_rate/' $log >"$dir/column.csv"
expect 2 'column.csv:2' 'wheel_rate' -- balance fit --data "$dir/column.csv" --out "$dir/p.json"
awk -F, -v OFS=, 'NR == 50 {$3 = "nan"} {print}' $log >"$dir/nan.csv"
expect 2 'nan.csv:50' 'board' -- balance fit --data "$dir/nan.csv" --out "$dir/p.json"
{ head -60 $log; sed -n 40,60p $log; } >"$dir/back.csv"
expect 2 'back.csv:61' 'time' -- balance fit --data "$dir/back.csv" --out "$dir/p.json"
sed 's/bongo board/unicycle/' $log >"$dir/other.csv"
expect 2 'unicycle' 'bongo board' -- balance fit --data "$dir/other.csv" --out "$dir/p.json"
head -90 $log >"$dir/short.csv"
expect 2 'usable samples' 'at least 10' -- balance fit --data "$dir/short.csv" --out "$dir/p.json"
expect 2 'usable samples' 'at least 10' -- balance fit --method identify --data "$dir/short.csv" --out "$dir/p.json"
[ ! -e "$dir/p.json" ] || { echo "a refused log left a policy behind"; failures=$((failures + 1)); }
echo '{}' >"$dir/policy.json"
expect 2 'policy.json' 'not a policy' -- balance evaluate "$dir/policy.json"
expect 2 'v.avi' 'expected .mp4' -- balance evaluate "$dir/policy.json" --video "$dir/v.avi"
expect 2 's.jpg' 'expected .png' -- balance evaluate "$dir/policy.json" --strip "$dir/s.jpg"
expect 2 'm.pdf' '.png or .svg' -- balance evaluate "$dir/policy.json" --map "$dir/m.pdf"
expect 2 'policy.json' 'not a policy' -- balance export "$dir/policy.json"

# A later generation makes what was found before outdated, also when it is never replaced.
accept learn "$nod" --budget 32 --out "$dir/f.run" --quiet || failures=$((failures + 1))
"$traceur" learn "$nod" --budget 1000000 --step-size 0.2 --out "$dir/f.run" --resume --quiet &
pid=$!
for _ in $(seq 100); do
  "$traceur" show "$dir/f.run" --json | grep -q '"generations": 2,' || break
  sleep 0.05
done
kill -9 $pid 2>/dev/null
wait $pid 2>/dev/null
"$traceur" show "$dir/f.run" --json |
  python3 -c 'import json, sys; d = json.load(sys.stdin); sys.exit("achieved" in d or d["generations"] <= 2)' ||
  { echo "killed after --resume: the outcome is the one before"; failures=$((failures + 1)); }
expect 2 'nothing is recorded yet' -- render "$dir/f.run" "$dir/f.mp4"

# Ctrl-C while a video is written leaves no part of it.
"$traceur" render "$dir/b.run" "$dir/g.mp4" --speed 0.01 --size 1280x960 --quiet &
pid=$!
sleep 1
kill -TERM $pid 2>/dev/null
wait $pid
code=$?
[ $code -eq 130 ] || { echo "render: exit $code instead of 130 when asked to stop"; failures=$((failures + 1)); }
if ls -A "$dir" | grep -q 'g.mp4'; then
  echo "a video that was stopped left a file behind"
  failures=$((failures + 1))
fi

[ $failures -eq 0 ] && echo "all as expected" || echo "$failures failures"
[ $failures -eq 0 ]
