#!/usr/bin/env bash
# Learning to balance goes on from its logs, ends the same, and a folder holds one learning.
# usage: balance.sh TRACEUR
set -u
traceur=$1
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
failures=0
complain() { echo "$1"; failures=$((failures + 1)); }

printf 'start_angle = 0.4\n[faults]\ndelay = 0.002\n' >"$dir/machine.toml"
learn=("$traceur" balance learn --hardware "$dir/machine.toml" --search published --method none
       --iterations 1 --starts 2)
"${learn[@]}" --out "$dir/a" --quiet
[ $? -le 1 ] || complain "learn: failed"
"${learn[@]}" --out "$dir/b" --quiet
cmp -s "$dir/a/policy-01.json" "$dir/b/policy-01.json" || complain "equal seeds, other policies"
cmp -s "$dir/a/run-01-2.csv" "$dir/b/run-01-2.csv" || complain "equal seeds, other runs"

[ -s "$dir/a/learning.png" ] || complain "no figure of the learning"
grep -q '"delay": 0.002' "$dir/a/learning.json" || complain "learning.json names no fault"

# A run that is missing is made again, what is there is not.
rm "$dir/b/run-01-2.csv"
text=$("${learn[@]}" --out "$dir/b")
case $text in *"run 1 (recorded)"*"run 2:"*"left out:"*) ;; *) complain "no resume: $text" ;; esac
cmp -s "$dir/a/run-01-2.csv" "$dir/b/run-01-2.csv" || complain "another run after resume"

text=$("${learn[@]}" --out "$dir/b" --seed 2 2>&1)
[ $? -eq 2 ] || complain "another seed in the same folder: not refused"
case $text in *learning.json*) ;; *) complain "another seed: $text" ;; esac

text=$("$traceur" balance evaluate "$dir/a/policy-01.json" --starts 1 --video "$dir/v.mp4")
[ -s "$dir/v.mp4" ] || complain "no video: $text"

[ $failures -eq 0 ] && echo "all as expected"
[ $failures -eq 0 ]
