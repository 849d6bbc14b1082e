# A small Slurm on this machine, to be sourced: a controller and two nodes n1 and n2 of two processors each, all in the
# folder $cluster, without systemd and control groups, and without a file under /etc. Needs root, and Debian's packages
# slurmctld, slurmd, slurm-client and munge.
#
# Each node has process ids, mounts and a host name of its own, so that ids repeat between nodes, and the end of a node
# is that of all its tasks. Only processes that were started here are ever signalled, by their ids.

export PATH=$PATH:/usr/sbin:/sbin
declare -A pid_of=()

# start NAME COMMAND...: in the background, in a session of its own.
start() {
    local name=$1
    shift
    setsid "$@" </dev/null >>"$cluster/log/$name" 2>&1 &
    pid_of[$name]=$!
}

# halt NAME SIGNAL: a process that was started, and waits for it.
halt() {
    [ -n "${pid_of[$1]:-}" ] || return 0
    kill "-$2" "${pid_of[$1]}" 2>/dev/null || true
    wait "${pid_of[$1]}" 2>/dev/null || true
    unset "pid_of[$1]"
}

start_controller() { start slurmctld slurmctld -D; }
kill_controller() { halt slurmctld KILL; }

# The shell is the first process of the node: it outlives the daemon, and with it all tasks end.
start_node() {
    mkdir -p "$cluster/spool/$1"
    start "$1" unshare --fork --kill-child=KILL --pid --mount-proc --uts \
        sh -c 'hostname "$1"; slurmd -D -N "$1" & while :; do wait; sleep 600 & wait; done' sh "$1"
}
crash_node() { halt "$1" KILL; }

# The daemon of a node: a stopped one looks like a lost network, while the tasks of the node go on.
daemon_of() {
    local first
    first=$(pgrep -P "${pid_of[$1]}") && pgrep -P "$first" -x slurmd
}
freeze_node() { kill -STOP "$(daemon_of "$1")"; }
thaw_node() { kill -CONT "$(daemon_of "$1")"; }

# free_port: one that nobody listens on, nor on the two after it.
free_port() {
    local port
    while port=$((20000 + RANDOM % 10000)); do
        grep -qE "$(printf ':(%04X|%04X|%04X) 0{8}:0{4} 0A' $port $((port + 1)) $((port + 2)))" /proc/net/tcp || break
    done
    echo "$port"
}

start_cluster() {
    local host port node
    host=$(hostname -s) port=$(free_port)
    mkdir -p "$cluster/log" "$cluster/state" "$cluster/spool"
    chmod 755 "$cluster"
    export SLURM_CONF=$cluster/slurm.conf
    (umask 077 && head -c 128 /dev/urandom >"$cluster/key")
    # A silent node is noticed after seconds, where a site has minutes; a task that is run again waits cred_expire.
    cat >"$SLURM_CONF" <<CONF
ClusterName=btfkit
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
AuthInfo=socket=$cluster/munge,cred_expire=5
CredType=cred/munge
StateSaveLocation=$cluster/state
SlurmdSpoolDir=$cluster/spool/%n
SlurmctldPidFile=$cluster/slurmctld.pid
SlurmdPidFile=$cluster/%n.pid
SlurmctldLogFile=$cluster/log/controller
SlurmdLogFile=$cluster/log/daemon-%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SlurmdParameters=config_overrides
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=1,sched_min_interval=0,bf_interval=1,batch_sched_delay=0
PriorityType=priority/basic
SlurmctldTimeout=10
SlurmdTimeout=6
MessageTimeout=5
KillWait=3
InactiveLimit=0
MinJobAge=900
ReturnToService=2
CompleteWait=0
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
JobAcctGatherType=jobacct_gather/linux
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=2 RealMemory=4000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=2 RealMemory=4000
PartitionName=batch Nodes=ALL Default=YES State=UP PriorityTier=1 PreemptMode=REQUEUE GraceTime=2
PartitionName=urgent Nodes=ALL State=UP PriorityTier=10 PreemptMode=OFF
CONF
    start munged munged --foreground --force --num-threads=2 --key-file="$cluster/key" --socket="$cluster/munge" \
        --pid-file="$cluster/munged.pid" --log-file="$cluster/log/munge" --seed-file="$cluster/seed"
    until_true 10 test -S "$cluster/munge"
    start_controller
    for node in n1 n2; do start_node $node; done
    until_true 30 nodes_are_idle || {
        tail -n 20 "$cluster"/log/* >&2
        return 1
    }
}
nodes_are_idle() { [ "$(sinfo -h -p batch -t idle -o %D 2>/dev/null)" = 2 ]; }

stop_cluster() {
    crash_node n1
    crash_node n2
    halt slurmctld TERM
    halt munged TERM
}

# until_true SECONDS COMMAND...: looks again and again until the command succeeds.
until_true() {
    local end=$((SECONDS + $1))
    shift
    until "$@"; do
        [ $SECONDS -lt $end ] || return 1
        sleep 0.1
    done
}
