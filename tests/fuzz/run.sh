#!/usr/bin/env bash
# Fuzzes every target, or those named, for T seconds or, if it is given, RUNS executions each, and adds a line for
# each to executions.tsv. Inputs that crash are left in found/; once mended they belong into corpus/.
set -uo pipefail
cd "$(dirname "$0")"
T=${T:-60}
RUNS=${RUNS:--1}
[ "$RUNS" = -1 ] || T=0
cargo fuzz build -s none || exit 1
# Forged packs are small files: in memory, where there is such a folder.
# Inputs are small: threads would cost more than they give.
export RAYON_NUM_THREADS=1
[ -d /dev/shm ] && export TMPDIR=/dev/shm
crashes=0
for target in ${@:-$(ls fuzz_targets | sed 's/\.rs$//')}; do
  mkdir -p "found/$target"
  echo "$target:"
  start=$(date +%s)
  cargo fuzz run -s none "$target" "found/$target" "corpus/$target" -- \
    -max_total_time="$T" -runs="$RUNS" -max_len=65536 -print_final_stats=1 -artifact_prefix="found/$target-" \
    2>"found/$target.log"
  ended=$?
  executions=$(awk '/^stat::number_of_executed_units:/ { print $2 }' "found/$target.log")
  seconds=$(($(date +%s) - start))
  printf '%s\t%s\t%s\t%s\t%s\n' "$(date +%F)" "$target" "${executions:-0}" "$seconds" "$((ended != 0))" \
    | tee -a executions.tsv
  if [ $ended != 0 ]; then
    crashes=$((crashes + 1))
    grep -E "panicked|Test unit written|ERROR" -A1 "found/$target.log"
  fi
done
exit $((crashes != 0))
