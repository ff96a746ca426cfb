#!/usr/bin/env bash
# Killed with SIGKILL at random instants and started again: the same bytes as undisturbed, and
# nothing is left of the killed one, no file and no process.
# usage: kills.sh TRACEUR [KILLS [SEED [KIND…]]]   KILLS of each kind; the seed chooses the instants
set -eu
traceur=$(realpath "$1")
kills=${2:-20}
RANDOM=${3:-1}
kinds=("${@:4}")
[ ${#kinds[@]} -gt 0 ] || kinds=(learn family reproduce perform render plot)
nod=$(realpath tests/cli/nod.toml)
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
export TRACEUR_TEST_KILLS=$dir  # by which the processes are found that came of ours
export XDG_CACHE_HOME=$dir/cache
export TRACEUR_DATA=$PWD

jump=("$nod" --seed 7 --quiet)
"$traceur" learn "${jump[@]}" --budget 64 --out "$dir/given.run" || [ $? -eq 3 ]
"$traceur" learn "${jump[@]}" --budget 200 --tasks 0:1:3 --out "$dir/given-family.run"

# A kind is what it is given, and what it runs in a folder of its own.
declare -A given=([learn]="" [family]="" [reproduce]="" [perform]=given-family.run
                  [render]=given.run [plot]=given.run)
work() {
  case $1 in
    learn) exec "$traceur" learn "${jump[@]}" --budget 640 --resume --out a.run ;;
    family) exec "$traceur" learn "${jump[@]}" --budget 320 --tasks 0:1:3 --resume --out a.run ;;
    reproduce) exec "$traceur" reproduce table-7 --seeds 6 --quiet --out a.csv ;;
    perform) exec "$traceur" perform given-family.run --sweep 200 ;;
    render) exec "$traceur" render given.run a.mp4 --speed 0.05 --quiet ;;
    plot) exec "$traceur" plot given.run ;;
  esac >/dev/null
}
begin() { (cd "$2" && work "$1") || true; }  # exit 1, 3: some task was missed

# What a folder holds: names, and what is in them; of a run its rows.
contents() {
  python3 - "$1" <<'END'
import hashlib, os, sqlite3, sys
for name in sorted(os.listdir(sys.argv[1])):
    path = os.path.join(sys.argv[1], name)
    if name.endswith(".run"):
        content = "\n".join(sqlite3.connect(path).iterdump()).encode()
    else:
        content = open(path, "rb").read()
    print(name, hashlib.sha256(content).hexdigest())
END
}
processes() { grep -lzs "^TRACEUR_TEST_KILLS=$dir\$" /proc/[0-9]*/environ | sed 's,[^0-9],,g' | grep -vx "$$" || true; }
# Of ours that the killed one started, none may live on.
left() { for p in $(processes); do [ "$p" = "$BASHPID" ] || readlink "/proc/$p/exe" || true; done | grep -v -e bash -e grep -e sed -e readlink || true; }

failed=0
for kind in "${kinds[@]}"; do
  make() { mkdir "$1"; for f in ${given[$kind]}; do cp "$dir/$f" "$1/"; done; }
  make "$dir/$kind"
  start=$(date +%s%N)
  begin $kind "$dir/$kind"
  lasts=$(($(date +%s%N) - start))
  expected=$(contents "$dir/$kind")
  killed=0 with_rests=0
  for round in $(seq "$kills"); do
    here=$dir/$kind-$round
    make "$here"
    (cd "$here" && work $kind) &
    pid=$!
    sleep "$(awk -v l="$lasts" -v s="$RANDOM" 'BEGIN { print 1.05 * l * s / 32768 / 1e9 }')"
    kill -9 "$pid" 2>/dev/null && killed=$((killed + 1))
    wait "$pid" 2>/dev/null || true
    for _ in $(seq 100); do [ -n "$(left)" ] || break; sleep 0.05; done
    [ -z "$(left)" ] || { echo "$kind, round $round: processes are left: $(left)"; failed=1; }
    ls -A "$here" | grep -q -e '\.part$' -e '-journal$' -e '-lock$' && with_rests=$((with_rests + 1))
    begin $kind "$here"
    if [ "$(contents "$here")" != "$expected" ]; then
      echo "$kind, round $round: differs:"
      diff <(echo "$expected") <(contents "$here") || true
      failed=1
    fi
    rm -r "$here"
  done
  echo "$kind: $killed of $kills killed in the middle, $with_rests of them left files behind; all gone and equal after another start"
done
exit $failed
