#!/bin/bash
# A campaign on a real Slurm, controller and node daemon on this machine, run by hand:
#
#     apt-get install slurm-wlm munge
#     tests/campaign/on_slurm.sh target/release/fretwear
#
# It runs an array of 42 rows through pipelines/slurm/array.sbatch. One long row meets its limit of time and is queued again, one is
# killed outright and submitted again, and the node daemon is killed and restarted meanwhile. In the end the tables of all rows are those
# of a local campaign, bit for bit. It wants root, or the user of Slurm, takes some three minutes, and ends what it has started.
set -euo pipefail
here=$(cd "$(dirname "$0")/../.." && pwd)
program=$(realpath "${1:-$here/target/release/fretwear}")
work=$(mktemp -d)
cd "$work"
echo "in $work"
host=$(hostname -s)
started=()
finish() {
    code=$?
    scancel --user="$(id -un)" 2>/dev/null && sleep 2
    for pid in "${started[@]}" $(cat slurmd.pid slurmctld.pid 2>/dev/null); do
        kill "$pid" 2>/dev/null || true
    done
    [ "$code" -eq 0 ] && rm -rf "$work" || echo "failed; logs are in $work"
}
trap finish EXIT

# ---- the daemons, away from those of the system
mkdir -m 0700 munge state spool
dd if=/dev/urandom bs=1 count=1024 of=munge/key status=none
chmod 0400 munge/key
munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/munge/pid" \
    --log-file="$work/munge/log" --seed-file="$work/munge/seed" > munge/out 2>&1 &
started+=($!)
cat > slurm.conf <<END
ClusterName=test
SlurmctldHost=$host(localhost)
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket,cred_expire=5
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2,bf_interval=2,batch_sched_delay=0
SlurmctldPort=16817
SlurmdPort=16818
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
ReturnToService=2
NodeName=$host NodeAddr=localhost CPUs=2 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
export SLURM_CONF=$work/slurm.conf
for _ in $(seq 50); do [ -S munge/socket ] && break; sleep 0.1; done
slurmctld
slurmd
for _ in $(seq 100); do
    case $(sinfo --noheader --format=%T 2>/dev/null) in idle | mixed | allocated) break ;; esac
    sleep 0.3
done
sinfo

# ---- the campaign: 40 short rows and two long ones
cat > scene.toml <<'END'
[joint]
size = ["4 mm", "3 mm"]
grid = [26, 22]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "1 um"
correlation_length = ["0.5 mm", "0.4 mm"]
seed = 3
[contact]
friction_coefficient = 0.6
normal_load = "200 N"
[motion]
amplitude = "1 um"
[wear]
coefficient = "2e3 um^3/J"
cycles = 600_000
END
cat > campaign.toml <<'END'
scene = "scene.toml"
[list]
surface.seed = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30,
    31, 32, 33, 34, 35, 36, 37, 38, 39, 40, 41, 42]
END
{
    printf 'joint.grid = ['
    for _ in $(seq 40); do printf '[26, 22], '; done
    printf '[170, 128], [170, 128]]\nwear.tolerance = ['
    for _ in $(seq 40); do printf '1e-3, '; done
    printf '%s, %s]\n' 1e-5 1e-5
} >> campaign.toml
export FRETWEAR=$program FRETWEAR_CACHE=$work/cache
"$program" campaign plan campaign.toml --dir slurm --no-rehearsal
submit() {
    sbatch --parsable --time=1 --signal=B:TERM@50 --array="$1" "$here/pipelines/slurm/array.sbatch" "$work/slurm"
}
begun=$(date +%s.%N)
array=$(submit 40,41,0-39)
echo "array $array"
waits() { # until something is so, for so many seconds
    for _ in $(seq $((4 * $1))); do
        eval "$2" && return
        sleep 0.25
    done
    echo "it never came: $2"
    squeue
    exit 1
}
state() { scontrol show job "$1" 2>/dev/null | sed -n "s/.*$2=\([^ ]*\).*/\1/p" | head -1; }

# ---- one is killed outright
waits 60 '[ -d slurm/runs/000041/iterations/wear_iteration=2 ]'
kill -9 "$(cat slurm/runs/000041/lock)"
echo "row 41 was killed after $(ls slurm/runs/000041/iterations | wc -l) iterations"
# ---- the node daemon is killed and restarted
kill -9 "$(cat slurmd.pid)"
sleep 2
slurmd
echo "the node daemon was killed and restarted"
# ---- one meets its limit of time, ends with 75 and is queued again
waits 90 '[ "$(state ${array}_40 Restarts)" = 1 ]'
echo "row 40 was queued again after $(ls slurm/runs/000040/iterations | wc -l) iterations"
again=$(submit 41)
echo "row 41 is submitted again as $again"
# Queued again as often as it needs.
waits 600 '[ -z "$(squeue --noheader)" ]'
echo "all done after $(echo "$(date +%s.%N) - $begun" | bc | cut -c1-6) s; row 40 was restarted $(state ${array}_40 Restarts) times"
"$program" campaign status --dir slurm
[ "$("$program" campaign status --dir slurm --json | sed -n 's/.*"done":\([0-9]*\).*/\1/p')" -eq 42 ]

# ---- the same at home
"$program" campaign plan campaign.toml --dir local --no-rehearsal > /dev/null
"$program" campaign run --dir local --jobs 2 --quiet
files=0
while read -r file; do
    cmp "local/runs/$file" "slurm/runs/$file"
    files=$((files + 1))
done < <(cd local/runs && find . -name '*.parquet' ! -name 'timing.parquet' ! -name history.parquet)
[ "$files" -gt 420 ]
[ "$files" -eq "$(cd slurm/runs && find . -name '*.parquet' ! -name 'timing.parquet' ! -name history.parquet | wc -l)" ]
echo "$files tables of 42 rows are the same, bit for bit"
