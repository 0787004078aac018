"""A fleet on Dask: python on_dask.py plan.toml answers 20 [tcp://scheduler:8786]; without a scheduler on this machine's cores."""
import os, subprocess, sys

def shard(number, of, plan, answers):
    command = [os.environ.get("ROTORBENCH", "rotorbench"), "fleet", "run", plan, "--shard", f"{number}/{of}", "-o", answers]
    return subprocess.run(command).returncode

if __name__ == "__main__":
    from dask.distributed import Client
    plan, answers, of, *scheduler = sys.argv[1:]
    with Client(*scheduler, **({} if scheduler else {"threads_per_worker": 1})) as client:
        codes = client.gather(client.map(shard, range(1, int(of) + 1), of=int(of), plan=plan, answers=answers))
    sys.exit(max(codes))
