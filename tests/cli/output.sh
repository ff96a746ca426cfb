#!/usr/bin/env bash
# What the program prints arrives or is missed; what names hold is never obeyed, nor a path.
# usage: output.sh TRACEUR
set -u
traceur=$(realpath "$1")
export TRACEUR_DATA=$PWD
nod=$PWD/tests/cli/nod.toml
dir=$(mktemp -d)
export XDG_CACHE_HOME=$dir/cache  # nothing of the user's is touched
trap 'rm -rf "$dir"' EXIT
failures=0
wrong() { failures=$((failures + 1)); printf '%s\n' "$*"; }
# Whether the task was reached (exit 3: not) does not matter here.
accept() { local code=0; "$traceur" "$@" || code=$?; [ $code -eq 0 ] || [ $code -eq 3 ]; }
learn() { accept learn "$@"; }
show() { accept show "$@"; }

# harmless FILE…: nothing in it that a terminal obeys, but the ends of lines.
harmless() {
  local file
  for file in "$@"; do
    LC_ALL=C.UTF-8 grep -aqP '[^\P{Cc}\n]|[\x{2028}-\x{202e}\x{2066}-\x{2069}]' "$file" &&
      wrong "control characters: $(LC_ALL=C cat -v "$file" | head -20)"
    iconv -f UTF-8 -t UTF-8 "$file" >/dev/null || wrong "not UTF-8: $(LC_ALL=C cat -v "$file" | head -20)"
  done
}

cd "$dir" || exit 1
learn "$nod" --budget 32 --out a.run --quiet || wrong "learn failed"

# ------------------------------------------------------------------ results that cannot be written
lost() {  # CODE WORDS -- the exit code and message of a program whose output goes nowhere
  local code=$1
  shift
  "$traceur" "$@" >/dev/full 2>err
  [ $? -eq "$code" ] || wrong "$* >/dev/full: not exit $code"
  [ "$(grep -c 'standard output: No space left' err)" -eq 1 ] || wrong "$* >/dev/full: said $(cat err)"
  "$traceur" "$@" >&- 2>err
  [ $? -eq "$code" ] || wrong "$* >&-: not exit $code"
  [ "$(grep -c 'standard output: Bad file' err)" -eq 1 ] || wrong "$* >&-: said $(cat err)"
}
lost 1 show a.run --json
lost 1 show a.run
lost 1 --help
lost 1 learn --help
lost 1 --version
lost 1
lost 1 inspect bioloid-gp
lost 1 export a.run
lost 1 plot a.run --what cost
learn "$nod" --budget 32 --out quiet.run --quiet >&- || wrong "learn --quiet >&-: nothing was lost, and yet it failed"

# --------------------------------------------------------------------- notes that cannot be written
"$traceur" nosuch 2>&-; [ $? -eq 2 ] || wrong "nosuch 2>&-: not exit 2"
"$traceur" nosuch 2>/dev/full; [ $? -eq 2 ] || wrong "nosuch 2>/dev/full: not exit 2"
"$traceur" show none.run >&- 2>&- <&-; [ $? -eq 2 ] || wrong "everything closed: not exit 2"
learn "$nod" --budget 64 --out full.run >/dev/null 2>/dev/full || wrong "learn 2>/dev/full: failed"
learn "$nod" --budget 64 --out closed.run >/dev/null 2>&- <&- || wrong "learn 2>&-: failed"
python3 - "$traceur" "$nod" <<'END' || wrong "learn, its notes into a broken pipe: failed"
import os, subprocess, sys
r, w = os.pipe()
os.close(r)
sys.exit(subprocess.run([sys.argv[1], "learn", sys.argv[2], "--budget", "64", "--out", "pipe.run"],
                        stdout=subprocess.DEVNULL, stderr=w).returncode not in (0, 3))
END
for run in full closed pipe; do
  show $run.run | grep -q '^stop ' || wrong "$run.run: was not finished"
done
# No file of ours becomes a standard descriptor.
"$traceur" reproduce table-7 --seeds 1 --row Toy3 --column CMA-C --out t.csv >/dev/null 2>&- <&- ||
  wrong "reproduce 2>&-: failed"
"$traceur" reproduce table-7 --no-run --out t.csv >/dev/null || wrong "reproduce 2>&-: notes are in the table"

# ---------------------------------------------------------------------------------- a broken pipe
python3 - "$traceur" <<'END' || wrong "show into a broken pipe: not as quiet as other programs"
import os, signal, subprocess, sys
r, w = os.pipe()
os.close(r)
done = subprocess.run([sys.argv[1], "show", "a.run"], stdout=w, stderr=subprocess.PIPE)
sys.exit(done.returncode != -signal.SIGPIPE or done.stderr != b"")
END

# ---------------------------------------------------------------------------------------- odd names
mkdir -p in/some/folder && cd in/some/folder || exit 1
python3 - "$nod" <<'END'
import sys
odd = r'../../X\u001b[31m\n|touch PWNED\u009b\u202E'
text = open(sys.argv[1]).read()
text = text.replace('"nod"', f'"{odd}"').replace('"shoulder angle"', r'"angle\n9,9,9\u001b[2J"')
text = text.replace('"raise"', r'"raise\n1,2\u001b[2J"')
text = text.replace('unit = "rad"', r'unit = "r\u001b[5mad\n"', 1)
open("odd.toml", "w").write(text)
END
learn odd.toml --budget 32 >out 2>err || wrong "learn odd.toml: $(cat -v err)"
run=$(ls runs)
echo "$run" >name.out
[ "$(ls runs | wc -l)" -eq 1 ] || wrong "learn: made $(ls runs)"
cp "runs/$run" one.run
show one.run >show.out && show one.run --json >show.json
"$traceur" export one.run >export.out 2>&1
"$traceur" plot one.run --format svg >plot.out 2>&1 || wrong "plot: $(cat -v plot.out)"
"$traceur" render one.run one.png >render.out 2>&1 || wrong "render: $(cat -v render.out)"
learn odd.toml --tasks 0:1:3 --budget 64 --quiet --out many.run || wrong "learn --tasks"
"$traceur" perform many.run --task 0.5 --no-picture >perform.out 2>&1
"$traceur" perform many.run --sweep 3 >>perform.out 2>&1
"$traceur" perform many.run --sweep 2 --perturb --no-picture >>perform.out 2>&1
for figure in ./*.svg; do tr -d '\t' <"$figure" >"$figure.out"; done  # gnuplot's own tabs
harmless out err ./*.out ./*.json ./*.csv
python3 - one-0.1-targets.csv many-sweep.csv many-perturb.csv <<'END' || wrong "a name breaks out of the CSV's comment"
import csv, sys
for file in sys.argv[1:]:
    comment, head, *rows = list(csv.reader(open(file)))
    assert comment[0].startswith("# ") and rows, file
    assert all(len(row) == len(head) for row in rows), file
END
python3 -c 'import json; json.load(open("show.json")); json.load(open("one-0.1-controller.json"))' || wrong "not JSON"
"$traceur" show $'no\e[31m\nsuch.run' 2>err; harmless err
"$traceur" $'le\e[31marn' 2>err; harmless err
"$traceur" learn --bud$'\e'get 2 2>err; harmless err
printf 'name = "x"\n"a\\u001b[31m\\nb" = 1\n' >key.toml
"$traceur" learn key.toml 2>err; harmless err
"$traceur" minimise --var x=0:1 --out m.run -- sh -c 'while read x; do printf "\033[31mone\a\n"; done' 2>err; harmless err
grep -q 'x1b\[31mone' err || wrong "minimise: the answer is not shown: $(cat -v err)"
# What is in a run file is no more to be trusted; what is no text is refused.
python3 - one.run <<'END'
import sqlite3, sys
db = sqlite3.connect(sys.argv[1])
for key in ("verb", "skill", "command", "optimiser", "stop", "task_unit"):
    db.execute("INSERT OR REPLACE INTO meta VALUES(?, ?)", (key, "\x1b[31m\n\x9b x"))
db.commit()
END
show one.run >show.out 2>&1 || wrong "show: $(cat -v show.out)"
show one.run --json >show.json 2>&1 || wrong "show --json: $(cat -v show.json)"
harmless show.out show.json
python3 -c 'import json; json.load(open("show.json"))' || wrong "show --json: not JSON"

# Where a run lies is only a name, too.
for name in '|touch PWNED;#' '`touch PWNED`' "it's" -- ; do
  mkdir -p -- "$name" && cp "$dir/a.run" "./$name/$name.run"
  "$traceur" plot "./$name/$name.run" --what cost >plot.out 2>&1 && [ -s "./$name/$name-cost.png" ] || wrong "plot $name: $(cat -v plot.out)"
  (cd -- "$name" && "$traceur" plot "../$name/$name.run" --what cost,com --format svg >/dev/null) || wrong "plot in $name"
done
"$traceur" plot '|touch PWNED;#/|touch PWNED;#.run' --what cost --out '|touch PWNED;#.svg' >/dev/null && [ -s '|touch PWNED;#.svg' ] || wrong "plot --out '|…'"
GNUTERM=qt "$traceur" plot "$dir/a.run" --what cost --out q.png >/dev/null && [ -s q.png ] || wrong "plot with GNUTERM"

# Falls of a robot and stances of odd names.
cp -r "$TRACEUR_DATA/models/bioloid-gp" odd-robot
python3 - odd-robot <<'END'
import re, sys
robot = open(sys.argv[1] + "/robot.toml").read()
robot = re.sub(r'(?m)^name = .*', r'name = "x/../../../../ESCAPED"', robot, count=1)
falls = open(sys.argv[1] + "/falls.toml").read()
stance = re.search(r'stance = "(\w+)"', falls)[1]
falls = falls.replace(f'stance = "{stance}"', 'stance = "../../../STANCE"')
robot = re.sub(rf'(?m)^\[poses\.{stance}\]', '[poses."../../../STANCE"]', robot)
robot = re.sub(rf'(?m)^{stance} = ', '"../../../STANCE" = ', robot)
open(sys.argv[1] + "/robot.toml", "w").write(robot)
open(sys.argv[1] + "/falls.toml", "w").write(falls)
END
mkdir c && (cd c && "$traceur" fall compile --robot ../odd-robot/falls.toml >out 2>&1 || wrong "fall compile: $(cat -v out)"
  [ "$(ls runs)" = fall-x-..-..-..-..-ESCAPED ] || wrong "fall compile: made $(ls runs)"
  find . -name '*STANCE*' | grep -q 'runs/fall-x[^/]*/-.-..-..-STANCE[^/]*$' || wrong "fall compile: $(find .)"
  exit "$failures") || failures=$((failures + 1))

cd "$dir" || exit 1
[ -z "$(find . -name 'PWNED*')" ] || wrong "a shell was run: $(find . -name 'PWNED*')"
escaped=$(find "$dir" -maxdepth 3 \( -name '*ESCAPED*' -o -name '*STANCE*' -o -name 'X*' \) -not -path "$dir/in/some/folder/*"; find /tmp -maxdepth 1 -name 'X-*')
[ -z "$escaped" ] || wrong "a name was a path: $escaped"

# A cost is told as it is, also where no float has room for it.
"$traceur" minimise --var x=-1e300:1e300 --budget 24 --out wide.run -- sh -c 'while read x; do echo "$x"; done' >wide 2>err
grep -q '^cost -[1-9][0-9.]*e+[0-9]* ' wide || wrong "minimise: a cost beyond a float's numbers: $(cat wide)"

# What comes after -- is the command's, also right after an option that may come again.
printf '#!/bin/sh\necho "$*" >args\nwhile read -r x; do echo "$x"; done\n' >told.sh && chmod +x told.sh
for last in "--constraint far --var x=0:1" "--var x=0:1 --constraint far"; do
  "$traceur" minimise --budget 24 --quiet --threads 1 --out told.run $last -- ./told.sh --seed 3 -u
  [ "$(cat args)" = "--seed 3 -u" ] || wrong "minimise $last: its command was told '$(cat args)'"
  rm -f told.run args
done

# --------------------------------------------------------------------------------- a progress line
sed 's/"nod"/"a skill of a very long name, so long that no terminal has the room for it\\u001b[31m"/' "$nod" >long.toml
for columns in 20 40 200; do
  script -qc "stty cols $columns; '$traceur' learn long.toml --budget 640 --threads 1 --out p$columns.run >/dev/null" p.log </dev/null >/dev/null
  python3 - p.log "$columns" <<'END' || wrong "progress: wider than $columns columns"
import re, sys
log = open(sys.argv[1], encoding="utf-8", newline="").read()
lines = re.findall(r"\r\x1b\[K([^\r\n]*)", log)
assert lines and "\x1b[31m" not in log, log
assert all(len(line) < int(sys.argv[2]) for line in lines), lines
END
done

exit $((failures > 0))
