#!/usr/bin/env bash
# Signals end the program soon, its programs with it, and what breaks down does not end a search.
# usage: signals.sh TRACEUR
set -u
traceur=$(realpath "$1")
nod=$(realpath tests/cli/nod.toml)
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
failures=0
complain() { echo "$1"; failures=$((failures + 1)); }

# soon SECONDS COMMAND…: whether it comes true by then.
soon() {
  local end=$(($(date +%s%N) + $1 * 1000000000))
  shift
  until "$@"; do
    [ "$(date +%s%N)" -lt $end ] || return 1
    sleep 0.02
  done
}
gone() { ! kill -0 "$1" 2>/dev/null; }
# What a machine under load takes longer for, no longer than this [s].
slack=8

cat >"$dir/stuck.sh" <<'END'
#!/bin/sh
# Starts helpers, one of another session, and never answers.
sleep 2000 & one=$!
setsid sleep 2000 & two=$!
read line
echo $$ $one $two >pids.part
mv pids.part pids
sleep 2000
END
chmod +x "$dir/stuck.sh"
cat >"$dir/deaf.sh" <<'END'
#!/bin/sh
echo $$ >pids.part
mv pids.part pids
sleep 2000
END
chmod +x "$dir/deaf.sh"

all_gone() { for p in $(cat "$dir/pids"); do gone "$p" || return 1; done; }

# stop NAME SIGNAL CODE COMMAND…: begun, then sent the signal as soon as there are pids.
stop() {
  local name=$1 signal=$2 code=$3
  shift 3
  rm -f "$dir/pids"
  (cd "$dir" && exec "$@") >"$dir/said" 2>&1 &
  local pid=$!
  soon $slack test -e "$dir/pids" || complain "$name: never began"
  sleep 0.1
  kill -s "$signal" $pid
  soon $slack gone $pid || { complain "$name: SIG$signal does not end it"; kill -9 $pid; }
  { wait $pid; } 2>/dev/null
  local got=$?
  [ $got -eq "$code" ] || complain "$name: exit $got instead of $code after SIG$signal"
  soon $slack all_gone || complain "$name: SIG$signal leaves processes: $(cat "$dir/pids")"
}

for signal in HUP TERM INT; do
  stop "a program that hangs" $signal 130 \
    "$traceur" minimise --var x=-1:1 --threads 1 --out $signal.run -- ./stuck.sh
done
stop "a program that hangs" KILL 137 \
  "$traceur" minimise --var x=-1:1 --threads 2 --out kill.run -- ./stuck.sh
stop "a program that does not read" TERM 130 \
  "$traceur" minimise --var x=-1:1 --threads 1 --out deaf.run -- ./deaf.sh

# While a file is read: here one that never ends.
mkfifo "$dir/fifo.toml"
"$traceur" learn "$dir/fifo.toml" --out "$dir/fifo.run" >/dev/null 2>&1 &
pid=$!
sleep 0.5
kill -TERM $pid
soon $slack gone $pid || { complain "learn: the first SIGTERM is not heeded while it reads"; kill -9 $pid; }
wait $pid 2>/dev/null

# nohup: a hang-up is nothing.
cat >"$dir/square.py" <<'END'
import sys, time
for line in sys.stdin:
    time.sleep(0.01)
    print(sum(float(t) ** 2 for t in line.split()), flush=True)
END
search="--var x=-1:1 --var y=-1:1 --threads 2 --seed 5"
(trap '' HUP; cd "$dir"; exec "$traceur" minimise $search --budget 120 --quiet --out nohup.run -- python3 square.py) &
pid=$!
sleep 0.7
kill -HUP $pid
wait $pid || complain "minimise: a SIGHUP that was ignored ends it"

# Stopped and resumed: the same bits.
"$traceur" minimise $search --budget 120 --quiet --out "$dir/whole.run" -- python3 "$dir/square.py"
"$traceur" minimise $search --budget 120 --quiet --resume --out "$dir/part.run" -- python3 "$dir/square.py" &
pid=$!
sleep 0.7
kill -HUP $pid 2>/dev/null
wait $pid
"$traceur" minimise $search --budget 120 --quiet --resume --out "$dir/part.run" -- python3 "$dir/square.py"
trials() { python3 -c '
import sqlite3, sys
print(sqlite3.connect(sys.argv[1]).execute("SELECT generation, number, cost, failed, hex(x) FROM trial ORDER BY 1, 2").fetchall())' "$1"; }
[ "$(trials "$dir/whole.run")" = "$(trials "$dir/part.run")" ] || complain "stopped and resumed: other bits"

# A program that breaks down on some trials.
cat >"$dir/crash.py" <<'END'
import os, signal, sys
for line in sys.stdin:
    x = [float(t) for t in line.split()]
    how = sys.argv[1]
    if how == "once":
        print(sum(v * v for v in x), flush=True)
        break
    if x[0] > 0.3:
        if how == "segv": os.kill(os.getpid(), signal.SIGSEGV)
        if how == "exit": sys.exit(3)
        if how == "quiet": sys.exit(0)
        if how == "failed": print("failed", flush=True); continue
        if how == "lines": print("Traceback:\n  no\n  cost", flush=True); continue
        print({"empty": "", "word": "None", "complex": "(1+2j)"}[how], flush=True)
        continue
    print(sum(v * v for v in x), flush=True)
END
search="--var x=-1:1 --var y=-1:1 --optimiser cma-es --quiet"
crash="$search --budget 36"
"$traceur" minimise $crash --out "$dir/failed.run" -- python3 -S "$dir/crash.py" failed || complain "failed: not done"
reference=$(trials "$dir/failed.run")
for how in segv exit quiet lines empty word complex; do
  for threads in $([ $how = segv ] && echo 1) 3; do
    text=$("$traceur" minimise $crash --threads $threads --out "$dir/$how-$threads.run" -- python3 -S "$dir/crash.py" $how 2>&1) ||
      complain "crash.py $how: ended with $?: $text"
    [ "$(trials "$dir/$how-$threads.run")" = "$reference" ] || complain "crash.py $how: not as if it had said failed"
    [ "$(grep -c 'asked:' <<<"$text")" -eq 1 ] || complain "crash.py $how: not told once: $text"
  done
  "$traceur" minimise $crash --on-crash stop --out "$dir/$how-stop.run" -- python3 -S "$dir/crash.py" $how 2>/dev/null
  [ $? -eq 2 ] || complain "crash.py $how: --on-crash stop does not"
done
"$traceur" minimise $crash --out "$dir/once.run" -- python3 -S "$dir/crash.py" once 2>/dev/null || complain "crash.py once: not done"
trials "$dir/once.run" | grep -q ', inf, ' && complain "crash.py once: a trial failed that had an answer"
# The choice stays with the run, until another is made.
cat >"$dir/later.py" <<'END'
import os, sys
for line in sys.stdin:
    x = [float(t) for t in line.split()]
    if x[0] > 0.3 and os.path.exists(sys.argv[1]): sys.exit(3)
    print(sum((v - 1) ** 2 for v in x), flush=True)
END
choice() { "$traceur" minimise $search --resume --out "$dir/choice.run" "$@" -- python3 "$dir/later.py" "$dir/later" 2>/dev/null; }
choice --budget 12 --on-crash stop || complain "--on-crash stop: not done"
touch "$dir/later"
choice --budget 60
[ $? -eq 2 ] || complain "--on-crash stop: not kept with the run"
choice --budget 60 --on-crash fail || complain "--on-crash fail: another choice is not taken"
choice --budget 90 || complain "--on-crash fail: not kept with the run"

# One that never works ends at once, and leaves nothing.
text=$("$traceur" minimise $crash --out "$dir/typo.run" -- python3 "$dir/no-such.py" 2>&1)
[ $? -eq 2 ] || complain "typo: not refused"
case $text in *"none of the first 10 trials could be run"*) ;; *) complain "typo: $text" ;; esac
[ ! -e "$dir/typo.run" ] || complain "typo: left a file"
text=$(timeout 20 "$traceur" minimise $crash --out "$dir/zero.run" -- cat /dev/zero 2>&1)
[ $? -eq 2 ] || complain "an endless line: $text"

# As large as a file may be: an error, and no file.
"$traceur" learn "$nod" --budget 16 --quiet --out "$dir/a.run"
for name in a.mp4 a.png; do
  text=$(cd "$dir" && ulimit -f 4 && "$traceur" render a.run "$name" --quiet 2>&1)
  [ $? -eq 1 ] || complain "render $name beyond the largest size: $text"
done
text=$(cd "$dir" && ulimit -f 4 && "$traceur" plot a.run --what joints --out a.svg 2>&1)
[ $? -eq 1 ] || complain "plot beyond the largest size: $text"
[ -z "$(find "$dir" -name '*a.mp4*' -o -name '*a.png*' -o -name '*a.svg*')" ] || complain "cut short, and left: $(ls -A "$dir")"

[ $failures -eq 0 ] && echo "all as expected" || echo "$failures failures"
[ $failures -eq 0 ]
