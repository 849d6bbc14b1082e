# What all jobs of this folder have in common. Nothing in here depends on the material.

# The task of the array, as Slurm names it. (SLURM_JOB_ID alone may stand for the whole array.)
this_task=${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}

# Which material, and which part of it: submit.sh names the material, and the array counts its parts; if it names none,
# the array counts materials.
if [ -n "$BTF_MATERIAL" ]; then
    material=$BTF_MATERIAL part=$SLURM_ARRAY_TASK_ID
else
    material=$SLURM_ARRAY_TASK_ID part=0
fi
printf '%s %s: task %s, material %s (%q), part %s, run %s\n' "$(date '+%F %T')" "$(hostname)" "$this_task" \
    "$material" "${measurements[material]}" "$part" "$((${SLURM_RESTART_COUNT:-0} + 1))"

# Slurm tells this shell that time is nearly over, or that the node is wanted. It tells the program, which stops at the
# next safe place and ends with 75.
stopped='' worker=''
trap 'stopped=yes; [ -z "$worker" ] || kill -TERM "$worker" 2>/dev/null' TERM

# Runs a command of btf, and returns its exit code.
once() {
    local code
    [ -z "$stopped" ] || return 75
    "$btf" "$@" --memory "$memory" --threads "${SLURM_CPUS_PER_TASK:-1}" &
    worker=$!
    [ -z "$stopped" ] || kill -TERM "$worker" 2>/dev/null
    # A signal ends `wait` early.
    while wait "$worker"; kill -0 "$worker" 2>/dev/null; do :; done
    wait "$worker"
    code=$?
    worker=''
    return "$code"
}

# As `once`. 66 says that something is not there yet: over a network, what another node has written may be seen late.
run() {
    local code
    once "$@"
    code=$?
    [ "$code" = 66 ] || return "$code"
    echo "looking again in $patience seconds"
    sleep "$patience" &
    wait $!
    once "$@"
}

# Ends the job with the exit code of its command. After 75 the same command goes on where it stopped: Slurm is asked to
# run the task again, but not for ever, and not if it was cancelled or is put back by Slurm itself.
finish() {
    if [ "$1" = 75 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt "$requeues" ] &&
        [ "$(squeue --noheader --jobs "$this_task" --format %T 2>/dev/null)" = RUNNING ]; then
        echo "stopped; to be run again"
        scontrol requeue "$this_task"
    fi
    exit "$1"
}
