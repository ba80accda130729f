#!/usr/bin/env bash
# A sweep spread by GNU parallel over the cores of this machine, or over several machines, and merged at the end.
#
#     examples/sweep-parallel.sh SHARDS FILE.npz SCENE --vary … --periods P --discard D …
#
# JOINTPLAY names the program (default: jointplay), PARALLEL_OPTIONS further options for parallel, e.g. "--jobs 4" or
# "--sshloginfile nodes" for machines that share this folder. After an interruption the same command resumes: finished shards
# remain, and an unfinished shard resumes from its own partial file.
set -euo pipefail

if (($# < 3)); then
    sed -n '2,8s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2
    exit 2
fi
shards=$1 out=$2
shift 2
jointplay=${JOINTPLAY:-jointplay}
folder=$out.shards
mkdir -p "$folder"

missing=()
for ((k = 1; k <= shards; k++)); do
    [[ -e $folder/$k.npz ]] || missing+=("$k")
done
if ((${#missing[@]})); then
    read -ra options <<< "${PARALLEL_OPTIONS:-}"
    # -q: the arguments are passed unchanged. --halt: the first failure ends the run and is its exit code.
    parallel --will-cite -q --halt now,fail=1 "${options[@]}" \
        "$jointplay" sweep "$@" --shard "{}/$shards" --threads 1 --quiet --out "$folder/{}.npz" ::: "${missing[@]}" \
        > /dev/null
fi
files=()
for ((k = 1; k <= shards; k++)); do
    files+=("$folder/$k.npz")
done
"$jointplay" merge "${files[@]}" --out "$out"
rm -r -- "$folder"
