#!/bin/bash
# The rows of a campaign as a task array of HyperQueue (https://it4innovations.github.io/hyperqueue), a task a row.
#
#     hq server start &                                       # and workers, or `hq alloc add slurm …`
#     fretwear campaign plan campaign.toml --dir DIR
#     pipelines/hyperqueue/submit.sh DIR                      # all rows; more arguments go to `hq submit`
#     fretwear campaign status --dir DIR
#
# For HyperQueue a task that ends with another code than 0 has failed, one that was stopped (75) too: submit again what is not done
# (the same command; rows that are done take no time). A task whose worker is lost is started again by itself, up to --crash-limit
# times; should the lost worker still live, the lock of the run lets one of them compute, and the other ends with 75.
#
# The command `hq` comes as a release binary and is not among the tests; the same tasks are run by HyperQueue's Python interface in
# tests/campaign/on_hyperqueue.py.
#
# FRETWEAR        the program [fretwear]
# FRETWEAR_CACHE  where reduced structures are shared [DIR/cache]
set -euo pipefail
dir=$(realpath "${1:?"the folder of the campaign is missing: submit.sh DIR [options of hq submit]"}")
shift
program=$(command -v "${FRETWEAR:-fretwear}")
all=$("$program" campaign status --dir "$dir" --json | sed -n 's/.*"rows":\([0-9]*\).*/\1/p')
exec hq submit --array "0-$((all - 1))" --name "$(basename "$dir")" --cpus 1 --crash-limit 20 \
    --env FRETWEAR_CACHE="${FRETWEAR_CACHE:-$dir/cache}" "$@" \
    -- sh -c 'exec "$0" campaign run --dir "$1" --index "$HQ_TASK_ID" --quiet' "$program" "$dir"
