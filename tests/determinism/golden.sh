#!/usr/bin/env bash
# The first 48 trials of three skills, and falls of two robots by every way there is, have the bits
# they had when these prints were taken. They may differ with another engine or kind of processor;
# then this is skipped. Whoever changes what a trial or a search does on purpose writes the new prints
# here, and says why.
# usage: golden.sh TRACEUR
set -eu
traceur=$1
engine="MuJoCo 4.0.1" processor=x86_64
declare -A prints=([jump]=9ea1b3e1ecdc062a [kick]=b9ec5c4e4a3b2b11 [walk]=eedc416ecf9c9380)

version=$("$traceur" --version)
case $version in
  *"$engine"*) ;;
  *) echo "skipped: the prints are of $engine, this is $version"; exit 77 ;;
esac
if [ "$(uname -m)" != $processor ]; then
  echo "skipped: the prints are of $processor, this is $(uname -m)"
  exit 77
fi
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
wrong=0
for skill in "${!prints[@]}"; do
  run=$dir/$skill.run
  "$traceur" learn "skills/bioloid-gp/$skill.toml" --budget 48 --seed 3 --out "$run" --quiet || [ $? -eq 3 ]
  got=$("$traceur" show "$run" --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["trials_hash"])')
  [ "$got" = "${prints[$skill]}" ] ||
    { echo "$skill: expected trials_hash ${prints[$skill]}, got $got"; wrong=1; }
done
falls() {  # ROBOT STANCE DIRECTION PUSH EXPECTED
  local got
  got=$(XDG_CACHE_HOME=$dir "$traceur" fall --robot "$1" --stance "$2" --direction "$3" --push "$4" --json |
    sha256sum | cut -c 1-16)
  [ "$got" = "$5" ] || { echo "falls of $1: expected $5, got $got"; wrong=1; }
}
falls bioloid-gp one_foot forward 5 827a0942a2f106c4
falls atlas two_feet backward 500 59e1bc42855c876a
exit $wrong
