#!/usr/bin/env bash
# Equal bits for 1 and 2 threads, and after being killed at random moments and resumed.
# usage: kill_and_resume.sh TRACEUR SKILL BUDGET KILLS LONGEST_PAUSE [OPTIONS OF LEARN]
set -eu
traceur=$1 skill=$2 budget=$3 kills=$4 pause=$5
more=("${@:6}")
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

# Whether the task was reached (exit 3: not) does not matter here.
finish() { (learn "$@") || [ $? -eq 3 ]; }
learn() { exec "$traceur" learn "$skill" --budget "$budget" --seed 7 --resume --quiet "${more[@]}" "$@"; }
print() { "$traceur" show "$1" --json || [ $? -eq 3 ]; }

finish --out "$dir/one.run" --threads 1
finish --out "$dir/two.run" --threads 2
reference=$(print "$dir/one.run")
[ "$(print "$dir/two.run")" = "$reference" ] || { echo "1 and 2 threads differ"; exit 1; }

killed=0
for round in $(seq "$kills"); do
  run=$dir/killed-$round.run
  learn --out "$run" --threads 2 &  # exec: the process killed is the program itself
  pid=$!
  sleep "$(awk -v p="$pause" -v s="$RANDOM" 'BEGIN { print p * s / 32768 }')"
  kill -9 "$pid" 2>/dev/null && killed=$((killed + 1))
  wait "$pid" 2>/dev/null || true
  finish --out "$run" --threads 2
  [ "$(print "$run")" = "$reference" ] ||
    { echo "round $round differs:"; echo "$reference"; print "$run"; exit 1; }
done
echo "equal: 1 and 2 threads, and $killed of $kills rounds killed in the middle"
[ "$killed" -gt 0 ]
