#!/bin/bash
# A fleet as a Slurm job array. The folder of answers has to be one that every node sees.
#
#     sbatch --array=1-20 slurm.sh plan.toml answers 20
#
# Again, for what is missing, or after a node died: the same line. What is there already is not done again.
#SBATCH --job-name=rotorbench --cpus-per-task=2 --output=%x-%A-%a.out
"${ROTORBENCH:-rotorbench}" fleet run "$1" --shard "$SLURM_ARRAY_TASK_ID/$3" -o "$2"
# 1 says that a bench failed: its answer says why, and the shard is done.
code=$?
[ "$code" -le 1 ]
