#!/usr/bin/env bash
# export: the rows of targets are the steps they say they are, and the JSON counts them.
# usage: export.sh TRACEUR
set -euo pipefail
traceur=$1
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
export XDG_CACHE_HOME=$dir/cache  # nothing of the user's is touched

# Shoulders that rise evenly until 0.06 s, then stay.
sed -e 's/^pose = .*/pose = { base = "stand", shoulder = "0.25 + 0 * shoulder + 0 * elbow" }\nblend = 0.06/' \
  tests/cli/nod.toml >"$dir/rise.toml"
"$traceur" learn "$dir/rise.toml" --budget 8 --population 8 --out "$dir/rise.run" --quiet || [ $? -eq 3 ]
for period in 0.001 0.007 0.01 0.05 0.1; do
  "$traceur" export "$dir/rise.run" --period $period --out "$dir/rise" --json >"$dir/said.json"
  python3 - "$dir" $period <<'END'
import csv, json, math, sys
folder, period = sys.argv[1], float(sys.argv[2])
said = json.load(open(folder + "/said.json"))
controller = json.load(open(said["controller"]))
head, *rows = list(csv.reader(open(said["targets"])))[1:]
start = controller["joints"]["l_shoulder"]["start"]
goal = controller["phases"][0]["targets"]["l_shoulder"]
assert goal == 0.25, goal
assert abs(goal - start) > 0.01, (start, goal)
# The trial is 0.1 s of steps of 1 ms, a target for each; every so many of them is a row.
count = math.ceil(round(0.1 / 0.001) / round(period / 0.001))
assert said["rows"] == len(rows) == count, (said["rows"], len(rows), count)
column = head.index("l_shoulder [rad]")
for i, row in enumerate(rows):
    t = i * period
    expected = start + (goal - start) * min(1, t / 0.06)
    assert abs(float(row[0]) - t) < 1e-9, row
    assert abs(float(row[column]) - expected) < 1e-5, (t, row[column], expected)
END
done

# What was learned becomes the file's: tried, it does what the run's best trial did.
cp tests/cli/nod.toml "$dir/nod.toml"
"$traceur" learn "$dir/nod.toml" --budget 32 --out "$dir/nod.run" --quiet || [ $? -eq 3 ]
"$traceur" export "$dir/nod.run" --into "$dir/nod.toml" >/dev/null
"$traceur" try "$dir/nod.toml" --json >"$dir/tried.json" || [ $? -eq 3 ]
"$traceur" show "$dir/nod.run" --json >"$dir/show.json" || [ $? -eq 3 ]
python3 - "$dir" <<'END'
import json, sys
tried, shown = (json.load(open(f"{sys.argv[1]}/{name}.json")) for name in ("tried", "show"))
assert isinstance(tried["cost"], float) and tried["cost"] == shown["best_cost"], (tried["cost"], shown["best_cost"])
END
head -1 "$dir/nod.toml" | grep -q '^# ' || { echo "export --into: the comment is gone"; exit 1; }
"$traceur" export "$dir/nod.run" --into "$dir/nothing.toml" 2>/dev/null && { echo "export --into: of no file"; exit 1; }
sed 's/^elbow /bend /; s/hand = "elbow"/hand = "bend"/' "$dir/nod.toml" >"$dir/other.toml"
cp "$dir/other.toml" "$dir/before.toml"
"$traceur" export "$dir/nod.run" --into "$dir/other.toml" 2>/dev/null && { echo "export --into: of another skill"; exit 1; }
cmp "$dir/other.toml" "$dir/before.toml"
