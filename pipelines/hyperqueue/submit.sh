#!/bin/bash
# Submits the rows of a campaign as a task array of HyperQueue (https://it4innovations.github.io/hyperqueue), with one task per row.
#
#     hq server start &                                       # and workers, or `hq alloc add slurm …`
#     fretwear campaign plan campaign.toml --dir DIR
#     pipelines/hyperqueue/submit.sh DIR                      # all rows; more arguments go to `hq submit`
#     fretwear campaign status --dir DIR
#
# In HyperQueue, a task with an exit code other than 0 has failed, also a stopped task (75). Submit the unfinished rows again with the
# same command; finished rows take no time. HyperQueue restarts a task whose worker is lost, up to --crash-limit times. If the lost worker
# still runs, the lock of the run lets only one task compute, and the other task ends with exit code 75.
#
# The command `hq` is a release binary, and no test runs it. tests/campaign/on_hyperqueue.py runs the same tasks with the Python interface
# of HyperQueue.
#
# FRETWEAR        program [fretwear]
# FRETWEAR_CACHE  folder of the shared reduced structures [DIR/cache]
set -euo pipefail
dir=$(realpath "${1:?"the folder of the campaign is missing: submit.sh DIR [options of hq submit]"}")
shift
program=$(command -v "${FRETWEAR:-fretwear}")
all=$("$program" campaign status --dir "$dir" --json | sed -n 's/.*"rows":\([0-9]*\).*/\1/p')
exec hq submit --array "0-$((all - 1))" --name "$(basename "$dir")" --cpus 1 --crash-limit 20 \
    --env FRETWEAR_CACHE="${FRETWEAR_CACHE:-$dir/cache}" "$@" \
    -- sh -c 'exec "$0" campaign run --dir "$1" --index "$HQ_TASK_ID" --quiet' "$program" "$dir"
