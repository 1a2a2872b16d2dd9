#!/usr/bin/env bash
# A campaign on a Slurm cluster: each task of the array works on a part, and the last one puts all together.
#   sbatch --array=1-8 --requeue examples/slurm.sh campaign.toml whole
# A part is worked on upon the node's own disk (SQLite's log is not for network file systems) and copied when it ends; a
# task that was stopped and comes again goes on where it was.
#SBATCH --job-name=ice
#SBATCH --cpus-per-task=4
#SBATCH --mem=8G
set -euo pipefail
scene=$1 whole=$2 parts=$2.parts
number=${SLURM_ARRAY_TASK_ID:-1} count=${SLURM_ARRAY_TASK_COUNT:-1}
here=$(mktemp -d)
keep() { # first beside the old copy, so that there is always a whole one
  rm -rf "$parts/$number.new" && cp -r "$here/part" "$parts/$number.new"
  rm -rf "$parts/$number" && mv "$parts/$number.new" "$parts/$number"
}
trap '[ ! -d "$here/part" ] || keep; rm -rf "$here"' EXIT
mkdir -p "$parts"
[ ! -d "$parts/$number" ] || cp -r "$parts/$number" "$here/part"
status=0
ice -q validate "$scene" --shard "$number/$count" --workers "${SLURM_CPUS_PER_TASK:-1}" --out "$here/part" || status=$?
[ "$status" -le 1 ] || exit "$status" # 1: this part alone contradicts the predictions; what all together say counts
keep
touch "$parts/$number.done"
if [ "$(find "$parts" -name '*.done' | wc -l)" -eq "$count" ] && mkdir "$parts/merging" 2>/dev/null; then
  mapfile -t each < <(seq -f "$parts/%.0f" 1 "$count")
  ice merge "${each[@]}" --fresh -o "$whole"
fi
