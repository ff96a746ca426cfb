#!/usr/bin/env bash
# Files that nobody wrote in good faith: one message naming the file, exit 2, soon.
# usage: strangers.sh TRACEUR
set -u
traceur=$1
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
failures=0

# refused WORDS -- ARGUMENTS…
refused() {
  local words=$1
  shift 2
  local text got
  text=$(timeout 30 "$traceur" "$@" 2>&1 >/dev/null)
  got=$?
  case "$got:$text" in
    2:*"$words"*) ;;
    *)
      failures=$((failures + 1))
      printf 'traceur %s: exit %s, expected 2 and "%s"\n%.300s\n' "$*" "$got" "$words" "$text"
      ;;
  esac
}

"$traceur" learn tests/cli/nod.toml --tasks 0:1:3 --budget 100 --out "$dir/whole.run" --quiet || exit 1
# run NAME SQL…: the whole run, changed.
run() {
  cp "$dir/whole.run" "$dir/$1.run"
  python3 - "$dir/$1.run" "${@:2}" <<'END'
import sqlite3, sys
run = sqlite3.connect(sys.argv[1])
for statement in sys.argv[2:]:
    run.execute(statement)
run.commit()
END
}
run family "UPDATE meta SET value = '{}' WHERE key = 'family'"
refused 'family.run: not a run file of this version' -- show "$dir/family.run"
refused 'family.run: not a run file of this version' -- perform "$dir/family.run" --task 0.5
run view 'DROP TABLE trial' 'CREATE VIEW trial AS WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL
  SELECT i + 1 FROM n) SELECT i AS generation, 0 AS number, 1.0 AS cost, 0 AS failed,
  "" AS violated, zeroblob(16) AS x FROM n'
refused 'view.run: not a run file of this version' -- show "$dir/view.run"
run bytes "UPDATE meta SET value = CAST(x'ff' AS TEXT) WHERE key = 'skill'"
refused 'bytes.run: not a run file of this version' -- show "$dir/bytes.run"
refused 'bytes.run: not a run file of this version' -- show "$dir/bytes.run" --json
run blob "UPDATE trial SET cost = 'cheap'" "DELETE FROM meta WHERE key = 'family_costs'"
refused 'blob.run: not a run file of this version' -- plot "$dir/blob.run" --what cost

mkfifo "$dir/pipe.toml" "$dir/pipe.xml"
refused 'a pipe that is not at its end' -- learn "$dir/pipe.toml" --out "$dir/none.run"
printf '<mujoco><include file="/dev/zero"/></mujoco>' >"$dir/zero.xml"
refused 'got a device' -- inspect "$dir/zero.xml"
printf '<mujoco><include file="pipe.xml"/></mujoco>' >"$dir/includes.xml"
refused 'pipe.xml' -- inspect "$dir/includes.xml"
python3 -c 'print("name = 1\n" + "a." * 31000 + "b = 1")' >"$dir/dots.toml"
refused 'dots.toml:2:' -- learn "$dir/dots.toml" --out "$dir/none.run"
python3 -c 'print("".join(f"key{i} = 1\n" for i in range(10**6)))' >"$dir/keys.toml"
refused 'keys.toml' -- learn "$dir/keys.toml" --out "$dir/none.run"
python3 -c 'print("".join(f"key{i} = 1\n" for i in range(70000)))' >"$dir/mistakes.toml"
refused '100 mistakes' -- learn "$dir/mistakes.toml" --out "$dir/none.run"
[ ! -e "$dir/none.run" ] || { echo "a refused run left a file behind"; failures=$((failures + 1)); }
exit $((failures > 0))
