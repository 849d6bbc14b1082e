#!/bin/bash
# Submits the jobs of this folder; each waits for those whose results it reads. Run it again whenever jobs were lost or
# failed: what is done is found done within seconds, and two runs at once do no harm.
set -eo pipefail
case $0 in */*) cd -- "${0%/*}" ;; esac
. ./settings.sh
command -v sbatch >/dev/null || {
    echo "submit.sh: no sbatch here: run this where jobs are submitted to Slurm" >&2
    exit 66
}
mkdir -p logs
unset BTF_MATERIAL BTF_PASS
# The numbers of all jobs that were ever submitted from here; of those that have ended Slurm says nothing.
cancel="scancel --quiet \$(cat $(printf %q "$PWD/jobs"))"
submitted=''
tell() {
    if [ -z "$submitted" ]; then
        echo "submit.sh: nothing was submitted" >&2
    else
        echo "submit.sh: not all were submitted; to cancel those that were: $cancel" >&2
    fi
}
trap '[ $? = 0 ] || tell' EXIT

# Submits a script as an array of so many tasks, after the job before it. `last` is that job; `waits` is afterok (for
# all of its tasks) or aftercorr (task by task, for the one of the same material).
job() {
    local script=$1 tasks=$2 after=()
    [ -z "$last" ] || after=("--dependency=$waits:$last" --kill-on-invalid-dep=yes)
    local number
    number=$(sbatch --parsable --export=ALL "${sbatch_options[@]}" "${after[@]}" \
        --array="0-$((tasks - 1))${at_once:+%$at_once}" "$script")
    last=${number%%;*} submitted=yes
    echo "$last" >>jobs
    echo "${script%.sh}: job $last, $tasks task(s)"
}

