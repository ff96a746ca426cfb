#!/usr/bin/env bash
# traceur coach: what it tells, what it refuses, and that a second run goes on.
# usage: coach.sh TRACEUR
set -u
traceur=$(realpath "$1")
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
failures=0
complain() { echo "$1"; failures=$((failures + 1)); }

"$traceur" coach skills/athlete/precision-jump.coach --readings >"$dir/text" || complain "readings: exit $?"
grep -q "FeedbackVirtualForce<contact, C_bal>" "$dir/text" || complain "readings: BALANCE has no rig"
"$traceur" coach skills/athlete/precision-jump.coach --readings --json | python3 -c '
import json, sys
j = json.load(sys.stdin)
assert len(j["instructions"]) == 17, "14, and the one of all phases three times more"' ||
  complain "readings --json: not what it should be"

printf 'Robot: athlete\nLeaning:\n  MOVE downwrad BY 0.1m\n  FLEX elbows BY 20\n' >"$dir/wrong.coach"
"$traceur" coach "$dir/wrong.coach" --out "$dir/no" 2>"$dir/text"
[ $? -eq 2 ] || complain "a wrong script: another exit code"
grep -q 'wrong.coach:3:8: "downwrad" is no word known here. Did you mean "downward"?' "$dir/text" ||
  complain "a wrong word: $(cat "$dir/text")"
grep -q 'wrong.coach:4:18: 20 of what unit?' "$dir/text" || complain "no unit: $(cat "$dir/text")"
[ -e "$dir/no" ] && complain "a wrong script left a folder"
"$traceur" coach "$dir/nothing.coach" 2>"$dir/text" && complain "a missing script passes"
grep -q "nothing.coach" "$dir/text" || complain "a missing script is not named"

printf 'Robot: athlete\nLeaning:\n  POSE lean\n  UNTIL 0.2 s\n  lower your body a bit\n' >"$dir/sink.coach"
"$traceur" coach "$dir/sink.coach" --budget 2 --out "$dir/out" --json 2>"$dir/text" | python3 -c '
import json, sys
j = json.load(sys.stdin)
assert j["instructions"] == 1 and not j["failed"] and j["trials"] > 0, j' || complain "sink: $(cat "$dir/text")"
"$traceur" show "$dir/out/sink.run" >/dev/null || complain "the whole cannot be shown"
"$traceur" try "$dir/out/sink.toml" >/dev/null || complain "the whole cannot be tried"
"$traceur" coach "$dir/sink.coach" --budget 2 --out "$dir/out" 2>"$dir/text" && complain "a second run writes over it"
grep -q -- "--resume" "$dir/text" || complain "a second run is not told of --resume"
"$traceur" coach "$dir/sink.coach" --budget 2 --out "$dir/out" --resume --quiet || complain "resume: exit $?"

# A session: an instruction changes the script, one that is not understood does not, undo takes it back.
hash_of() { "$traceur" show "$1" --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["hash"])'; }
printf 'show\nbranch first\nbranch first\nbranch\ncompare now first\nleaning: bend your elbows to 60 degrees\nbranch bent\nbranch ..\ncompare first bent\nswitch frst\nflap your wings\nsave %s\nswitch first\nundo\nundo\nquit\n' "$dir/saved.coach" |
  "$traceur" coach "$dir/sink.coach" --budget 2 --out "$dir/s" --session >"$dir/text" 2>"$dir/complaints" ||
  complain "session: exit $?"
grep -q "^> Robot: athlete$" "$dir/text" || complain "session: show does not show the script"
grep -q "understood: FLEX elbows BY 60 deg" "$dir/text" || complain "session: $(cat "$dir/text")"
grep -q '^1-leaning  *[0-9.e-]*  *[0-9.e-]*$' "$dir/text" || complain "session: compare: $(cat "$dir/text")"
[ -s "$dir/s/branches/first-bent.png" ] || complain "session: compare draws nothing"
cmp -s "$dir/s/branches/first/sink.toml" "$dir/out/sink.toml" || complain "session: a branch is not what was"
cmp -s "$dir/s/branches/bent/sink.toml" "$dir/out/sink.toml" && complain "session: branches are the same"
[ -s "$dir/s/branches/now-first.png" ] || complain "session: what is now cannot be compared"
grep -q 'there is a branch "first" already' "$dir/complaints" || complain "session: a branch is written over"
grep -q '"branch": expected "branch NAME"' "$dir/complaints" || complain "session: a branch needs no name"
grep -q '".." is no name of a branch' "$dir/complaints" || complain "session: a branch may be anywhere"
grep -q 'no branch "frst": expected one of bent, first, now. Did you mean "first"?' "$dir/complaints" ||
  complain "session: $(cat "$dir/complaints")"
[ -s "$dir/s/strip.png" ] || complain "session: no film strip"
grep -q "^  bend your elbows to 60 degrees$" "$dir/saved.coach" || complain "session: saved another script"
grep -q "wings" "$dir/saved.coach" && complain "session: keeps what it did not understand"
[ "$(hash_of "$dir/s/sink.run")" = "$(hash_of "$dir/out/sink.run")" ] ||
  complain "session: undo did not bring back what was"

# What helps is found by trying.
printf 'Robot: athlete\nLeaning:\n  POSE crouch\n  UNTIL 0.4 s\n  head IN FRONT OF root\n  head BEHIND root; UNTIL 0.3 s\n' >"$dir/both.coach"
"$traceur" coach "$dir/both.coach" --budget 8 --out "$dir/both" --why >"$dir/text" 2>"$dir/tries"
[ $? -eq 3 ] || complain "why: another exit code"
grep -q '"head BEHIND root" opposes "head IN FRONT OF root"' "$dir/text" || complain "why: $(cat "$dir/text")"
grep -q '^helps: leave out "head BEHIND root" of leaning$' "$dir/text" || complain "why: $(cat "$dir/text")"
grep -q '^trying: leave out "head BEHIND root" of leaning$' "$dir/tries" || complain "why: $(cat "$dir/tries")"
"$traceur" coach "$dir/both.coach" --budget 8 --out "$dir/both" --resume --why --json | python3 -c '
import json, sys
j = json.load(sys.stdin)
assert j["helps"]["say"] == "" and j["helps"]["instead_of"] == {"line": 6, "text": "head BEHIND root"}, j
assert j["helps"]["all"] and j["helps"]["against"] == "a contradiction", j' || complain "why --json"
[ -e "$dir/both/tried" ] && complain "why left what it tried"
printf 'why\nquit\n' | "$traceur" coach "$dir/both.coach" --budget 8 --out "$dir/both" --session >"$dir/text" 2>"$dir/tries"
grep -q '^helps: leave out "head BEHIND root" of leaning$' "$dir/text" || complain "session: why: $(cat "$dir/text")"

mkdir "$dir/empty"
"$traceur" coach "$dir/sink.coach" --from "$dir/empty" --out "$dir/from" 2>"$dir/text"
[ $? -eq 2 ] && grep -q "empty: has no run of a phase of this script: expected 1-leaning.run" "$dir/text" ||
  complain "from nothing: $(cat "$dir/text")"
[ -e "$dir/from" ] && complain "from nothing left a folder"
"$traceur" coach "$dir/sink.coach" --budget 2 --from "$dir/out" --out "$dir/from" --quiet || complain "from: exit $?"

# A run goes to other programs, and a clip becomes a script.
"$traceur" render "$dir/out/sink.run" "$dir/sink.bvh" "$dir/sink.glb" --quiet || complain "render for others: exit $?"
head -c 9 "$dir/sink.bvh" | grep -q HIERARCHY || complain "no skeleton"
[ "$(head -c 4 "$dir/sink.glb")" = glTF ] || complain "no scene"
"$traceur" coach "$dir/mine.coach" --demonstration "$dir/sink.bvh" 2>"$dir/text" && complain "a clip without a jump passes"
grep -q "sink.bvh: the clip shows no jump" "$dir/text" || complain "no jump: $(cat "$dir/text")"
[ -e "$dir/mine.coach" ] && complain "a clip without a jump left a script"
"$traceur" coach "$dir/sink.coach" --demonstration "$dir/sink.bvh" 2>"$dir/text" && complain "a script is written over"
"$traceur" coach "$dir/mine.coach" --demonstration "$dir/text" 2>"$dir/no"
[ $? -eq 2 ] && grep -q 'text:1: expected "HIERARCHY"' "$dir/no" || complain "no BVH: $(cat "$dir/no")"
rm -f "$dir/no"

printf 'Robot: athlete\nLeaning:\n  POSE stand\n  UNTIL feet leave\n' >"$dir/stuck.coach"
"$traceur" coach "$dir/stuck.coach" --budget 2 --out "$dir/stuck" >"$dir/text" 2>/dev/null
[ $? -eq 3 ] || complain "a phase that is not learned: another exit code"
grep -q "^why: leaning never ends" "$dir/text" || complain "no why: $(cat "$dir/text")"

exit $((failures > 0))
